#!/usr/bin/python3
"""The table of docs/wifi.md: what arrives in each mode of 802.11, at which rate, with how many
transmissions; unmodified daemons in a Wi-Fi guest. One boot for all runs.

    benchmarks/wifi_modes.py [--runs N] [--messages N] [--loss SHARE] [--modes MODE...]

Each run sends messages from one robot to two others over our own air, which first loses nothing,
then SHARE of all frames on each way. With several runs, intervals are Student's, 95 %. Ends with 1
if a message is unaccounted for. SWARMTALK_BUILD: another build.
"""
import argparse
import collections
import itertools
import math
import pathlib
import re
import statistics
import sys

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/wifi"))

import guest  # noqa: E402

MODES = ("ibss", "mesh", "ap", "ap-isolated")
LISTENERS = ("r2", "r3")
RATE_HZ = 20
# Two-sided, 95 %, by degrees of freedom; beyond: normal.
STUDENT = (0, 12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26)


def interval(values, digits=0) -> str:
    middle = statistics.fmean(values)
    if len(values) < 2:
        return f"{middle:.{digits}f}"
    factor = STUDENT[len(values) - 1] if len(values) <= len(STUDENT) else 1.96
    half = factor * statistics.stdev(values) / math.sqrt(len(values))
    return f"{middle:.{digits}f} ± {half:.{digits}f}"


def rates_of(frames) -> collections.Counter:
    """How many frames at which rate, Mbit/s."""
    rates = collections.Counter()
    for frame in frames:
        rate = re.search(r"(\d+\.\d+) Mb/s", frame)
        if rate:
            rates[float(rate[1])] += 1
    return rates


def run(machine, mode: str, messages: int) -> dict:
    """One run of one mode. @return the share that arrived in percent, transmissions a frame,
    rates"""
    address = machine.check("r1", "cat /sys/class/net/wlan0/address").strip()
    with guest.Capture(machine, "", "hwsim0") as air:
        before = machine.stats("r1")["links"][0]["counters"]["frames_sent"]
        accounts = machine.exchange("r1", list(LISTENERS), messages, RATE_HZ,
                                    expected=mode != "ap-isolated")
        sent = machine.stats("r1")["links"][0]["counters"]["frames_sent"] - before
    # The sender is the third address of what an access point repeats, the fourth in a mesh.
    of_robot = (f"type data and (wlan addr2 {address} or wlan addr3 {address} "
                f"or wlan addr4 {address})")
    frames = air.frames(of_robot)
    group = air.frames(f"{of_robot} and wlan addr1 ff:ff:ff:ff:ff:ff")
    shares = [100 * account.heard / account.sent for account in accounts.values()]
    return {"arrived": statistics.fmean(shares),
            "unaccounted": sum(abs(account.unaccounted) for account in accounts.values()),
            "duplicates": sum(account.duplicates for account in accounts.values()),
            "air": len(frames) / sent, "rates": rates_of(group)}


def measure(machine, mode: str, share: float, runs: int = 1, messages: int = 100):
    """Runs of one mode on our own air, which first loses nothing and then this share on each way.
    @return (without loss, with it), each with lists: arrived, unaccounted, duplicates, air, and
    rates"""
    with machine.medium() as medium, machine.network(mode):
        try:
            for robot in machine.robots:
                machine.daemon(robot)
            clear = runs_of(machine, mode, runs, messages)
            names = [*machine.robots, "ap1"]
            for sender, receiver in itertools.permutations(names, 2):
                medium.lose(sender, receiver, share)
            lossy = runs_of(machine, mode, runs, messages)
        finally:
            machine.end_daemons()
    return clear, lossy


def runs_of(machine, mode: str, runs: int, messages: int) -> dict:
    found = collections.defaultdict(list)
    rates = collections.Counter()
    for _ in range(runs):
        result = run(machine, mode, messages)
        for key in ("arrived", "unaccounted", "duplicates", "air"):
            found[key].append(result[key])
        rates += result["rates"]
    found["rates"] = [rate for rate, count in rates.most_common() if count * 20 > rates.total()]
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--messages", type=int, default=100)
    parser.add_argument("--loss", type=float, default=0.2)
    parser.add_argument("--modes", nargs="+", choices=MODES, default=MODES)
    options = parser.parse_args()
    reason = guest.wifi_guest.missing()
    if reason:
        sys.exit(f"benchmarks/wifi_modes.py: {reason}")
    unaccounted = 0
    print(f"| mode | arrives, % | group frames, Mbit/s | transmissions a frame | arrives with "
          f"{100 * options.loss:.0f} % loss, % |\n|---|---|---|---|---|", flush=True)
    with guest.Guest(radios=3, access_points=1) as machine:
        machine.check("", "ip link set hwsim0 up")
        for mode in options.modes:
            clear, lossy = measure(machine, mode, options.loss, options.runs, options.messages)
            unaccounted += sum(clear["unaccounted"]) + sum(lossy["unaccounted"])
            rates = ", ".join(f"{rate:g}" for rate in clear["rates"]) or "none"
            print(f"| {mode} | {interval(clear['arrived'])} | {rates} | "
                  f"{interval(clear['air'], 1)} | {interval(lossy['arrived'])} |", flush=True)
    print(f"\nRuns: {options.runs}, of {options.messages} messages to each of {len(LISTENERS)} "
          f"robots; {unaccounted} messages unaccounted for", flush=True)
    return 1 if unaccounted else 0


if __name__ == "__main__":
    sys.exit(main())
