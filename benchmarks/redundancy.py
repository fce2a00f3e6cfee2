#!/usr/bin/python3
"""What redundancy costs in air, and what it brings: the frontier, as a table and a picture.

usage: benchmarks/redundancy.py [--build build-test] [--picture FILE] [--seconds 200] [--loss ...]
       benchmarks/redundancy.py --waits         how long a late copy should wait for a frame
       benchmarks/redundancy.py --air           what the air of many robots carries: rate, beacon
       benchmarks/redundancy.py --daemons       the same with real daemons on a wire that loses
       benchmarks/redundancy.py --radio         the same on the radio medium of swarmtalk-lab

Simulated, but for --daemons: the daemon's own code for packets and frames, each frame lost at each
receiver by itself, none colliding. Air: the estimate of drivers/link/airtime.hpp at 6 Mb/s. With
--daemons it needs root; a wire has no air time, so the air is what the daemons' counters say. With
--radio (root) it is what the medium says that the frames took, and the mean wait before each.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/support"))
TIMEOUT_S = 600
CHANNEL_BYTES = 1383
MEAN_WAIT_US = 101.5  # before a broadcast: DIFS and 7.5 slots, as drivers/link/airtime.hpp has it
ONE = {"message_bytes": 24, "rate_hz": 8, "robots": 10, "talkers": 10}
LONG = {"rate_hz": 5, "robots": 11, "talkers": 1}
KINDS = {
    "one packet of 24 B": ONE,
    "two full packets": {**LONG, "message_bytes": 2 * CHANNEL_BYTES},
    "four full packets": {**LONG, "message_bytes": 4 * CHANNEL_BYTES},
    "eleven full packets": {**LONG, "message_bytes": 11 * CHANNEL_BYTES, "rate_hz": 2},
}
WAYS = [("nothing", {}), *((f"redundancy {n}", {"repairs": n}) for n in (1, 2, 3, 4, 6, 8)),
        ("automatic", {"auto": 1}), ("2 copies", {"copies": 2}), ("3 copies", {"copies": 3}),
        ("2 copies, redundancy 1", {"copies": 2, "repairs": 1})]
COLOURS = {"one packet of 24 B": "tab:blue", "two full packets": "tab:olive",
           "four full packets": "tab:red", "eleven full packets": "tab:purple"}


def parse():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--picture", type=pathlib.Path, help="written there (PNG, SVG, PDF)")
    parser.add_argument("--seconds", type=float, default=200, help="simulated, of each run")
    parser.add_argument("--loss", type=float, nargs="+", default=[0.05, 0.1, 0.2, 0.3])
    parser.add_argument("--waits", action="store_true")
    parser.add_argument("--air", action="store_true")
    parser.add_argument("--daemons", action="store_true")
    parser.add_argument("--radio", action="store_true")
    parser.add_argument("--messages", type=int, default=1000,
                        help="of each way, with --daemons and --radio")
    return parser.parse_args()


class Cell:
    """Runs of the simulator, each once."""

    def __init__(self, build, seconds):
        self._program = build / "benchmarks/redundancy/redundancy_cell"
        self._seconds = seconds

    def run(self, **options):
        words = [f"{name}={value}" for name, value in
                 {"seconds": self._seconds, **options}.items()]
        done = subprocess.run([self._program, *words], check=True, timeout=TIMEOUT_S, text=True,
                              capture_output=True)
        result = json.loads(done.stdout)
        for wrong in ("duplicates", "damaged", "shared", "resent"):
            if result[wrong] != 0:
                sys.exit(f"redundancy.py: {result[wrong]} {wrong} with {' '.join(words)}")
        return result

    def run_all(self, many):
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            return list(pool.map(lambda options: self.run(**options), many))


def frontier(cell, losses):
    """Rows (kind, loss, way, delivery, air, packets), printed as a table."""
    asked = [(kind, loss, way) for kind in KINDS for loss in losses for way in WAYS]
    results = cell.run_all([{**KINDS[kind], "loss": loss, **way[1]} for kind, loss, way in asked])
    rows, air = [], 1.0
    for (kind, loss, (way, _)), result in zip(asked, results):
        if way == "nothing":
            air = result["air_us_per_message"]
        rows.append((kind, loss, way, result["delivery"], result["air_us_per_message"] / air,
                     result["packets_per_message"], result["late_ms"]))
    heading = None
    for kind, loss, way, delivery, times, packets, late in rows:
        if heading != (kind, loss):
            heading = (kind, loss)
            print(f"\n{kind}, {100 * loss:.0f} % of frames lost")
            print(f"  {'':24}{'delivered':>10}{'air':>8}{'packets':>9}{'late':>10}")
        print(f"  {way:24}{100 * delivery:8.1f} %{times:8.2f}{packets:9.2f}{late:7.1f} ms")
    return rows


def draw(rows, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    losses = sorted({row[1] for row in rows})
    figure, panes = pyplot.subplots(1, len(losses), figsize=(3.4 * len(losses), 3.8), sharey=True,
                                    squeeze=False)
    for pane, loss in zip(panes[0], losses):
        for kind, colour in COLOURS.items():
            here = [row for row in rows if row[0] == kind and row[1] == loss]
            repaired = sorted((row[4], row[3]) for row in here
                              if row[2] == "nothing" or row[2].startswith("redundancy"))
            copied = sorted((row[4], row[3]) for row in here
                            if row[2] == "nothing" or row[2].endswith("copies"))
            automatic = [(row[4], row[3]) for row in here if row[2] == "automatic"]
            pane.plot(*zip(*repaired), "o-", color=colour, markersize=3, label=kind)
            pane.plot(*zip(*copied), "x:", color=colour, markersize=5)
            pane.plot(*zip(*automatic), "s", color=colour, markersize=7, fillstyle="none")
        pane.axhline(0.95, color="grey", linewidth=0.6)
        pane.set_title(f"{100 * loss:.0f} % of frames lost", fontsize=9)
        pane.set_xlabel("air, times that without redundancy", fontsize=8)
        pane.set_xlim(0.9, 3.1)
        pane.set_ylim(0, 1.02)
        pane.tick_params(labelsize=8)
    panes[0][0].set_ylabel("messages delivered", fontsize=8)
    panes[0][-1].legend(fontsize=7, loc="lower right",
                        title="o repair packets, x copies,\nsquare: automatic", title_fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=110, metadata={"Software": None} if path.suffix == ".png" else None)
    print(f"\n{path} is drawn")


def waits(cell):
    """How long a late copy waits: air, and how late it comes."""
    rates, times = (1, 2, 5, 8, 20), (50, 100, 200, 300, 500, 1000, -1)
    print("air of redundancy 1, times that without, 24 B, 20 % of frames lost (delivered)")
    print(f"{'messages/s':>11}" + "".join(f"{f'{ms} ms' if ms > 0 else 'for ever':>16}"
                                          for ms in times))
    for rate in rates:
        plain, *results = cell.run_all(
            [{**ONE, "rate_hz": rate, "loss": 0.2},
             *({**ONE, "rate_hz": rate, "loss": 0.2, "repairs": 1, "copy_wait_ms": ms}
               for ms in times)])
        print(f"{rate:11}" + "".join(
            f"{result['air_us_per_message'] / plain['air_us_per_message']:7.2f} "
            f"({100 * result['delivery']:.1f} %)" for result in results))


class Daemons:
    """One robot that publishes and others that hear it, on a wire that loses frames."""

    HEARERS = 4

    def __init__(self, build, loss):
        import wire
        self._build = build
        self._robots = wire.Robots(1 + self.HEARERS, "redundancy")
        self._loss = loss
        self._processes = []
        self._folder = tempfile.TemporaryDirectory(prefix="redundancy-")

    def __enter__(self):
        self._robots.__enter__()
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _start(self):
        ports = [f"robot{number}" for number in range(1, 2 + self.HEARERS)]
        for port in ports:
            self._robots.command(self._robots.hub, "ip", "link", "set", port, "nomaster")
        relay = self._keep(self._robots.start(
            self._robots.hub, sys.executable, ROOT / "tests/support/lossy_wire.py", self._loss, 1,
            *ports, stdout=subprocess.PIPE, text=True))
        assert relay.stdout.readline() == "ready\n", "the wire does not start"
        for number, name in enumerate(self._robots.names, 1):
            config = pathlib.Path(self._folder.name, f"{number}.toml")
            config.write_text(f'[node]\nid = {number}\n[links.air]\ntype = "raw_l2"\n'
                              'interface = "wlan0"\nair_rate_mbps = 6.0\n')
            self._keep(self._robots.start(
                name, self._build / "daemon/swarmtalkd", "--config", config, "--socket",
                self._socket(number), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        deadline = time.monotonic() + 30
        while not all(self._is_up(number) for number in range(1, 2 + self.HEARERS)):
            if time.monotonic() > deadline:
                sys.exit("redundancy.py: the daemons' links do not come up")
            time.sleep(0.1)

    def _keep(self, process):
        self._processes.append(process)
        return process

    def _socket(self, number):
        return pathlib.Path(self._folder.name, f"{number}.sock")

    def _cli(self, number, *words):
        return self._robots.words(self._robots.names[number - 1],
                                  self._build / "cli/swarmtalk-cli", "--socket",
                                  self._socket(number), *words)

    def _status(self, number):
        done = subprocess.run(self._cli(number, "status", "--json"), capture_output=True,
                              text=True, timeout=60, check=False)
        return json.loads(done.stdout) if done.returncode == 0 else None

    def _is_up(self, number):
        status = self._status(number)
        return status is not None and all(link["up"] for link in status["links"])

    def measure(self, messages, rate, payload, *words):
        """Share delivered, air a message in us, duplicates."""
        path = pathlib.Path(self._folder.name, "message")
        path.write_bytes(payload)
        files = [tempfile.TemporaryFile("w+", encoding="utf-8") for _ in range(self.HEARERS)]
        hearers = [subprocess.Popen(self._cli(number, "sub", "c", "--json"), stdout=file,
                                    stderr=subprocess.DEVNULL)  # a pipe holds few messages
                   for number, file in enumerate(files, 2)]
        deadline = time.monotonic() + 30
        while not all(self._status(number)["channels"] for number in range(2, 2 + self.HEARERS)):
            if time.monotonic() > deadline:
                sys.exit("redundancy.py: the programs do not subscribe")
            time.sleep(0.1)
        before = self._air_us()
        subprocess.run(self._cli(1, "pub", "c", "--file", path, "--repeat", messages, "--rate",
                                 rate, *words), check=True, timeout=TIMEOUT_S)
        time.sleep(1)
        after = self._air_us()
        heard = duplicates = 0
        for hearer, file in zip(hearers, files):
            hearer.send_signal(signal.SIGTERM)
            hearer.wait(timeout=60)
            file.seek(0)
            numbers = [json.loads(line)["message_number"] for line in file]
            file.close()
            heard += len(set(numbers))
            duplicates += len(numbers) - len(set(numbers))
        return heard / (messages * self.HEARERS), (after - before) / messages, duplicates

    def _air_us(self):
        """That the frames of robot 1 took so far."""
        return self._status(1)["links"][0]["counters"]["airtime_us_sent"]

    def __exit__(self, *_):
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            process.wait(timeout=30)
        self._robots.__exit__()
        self._folder.cleanup()


class RadioDaemons(Daemons):
    """The same on the radio of swarmtalk-lab: robots in one place, where frames take air, wait for
    each other, and this share of all receptions fails."""

    def __init__(self, build, loss):
        self._build = build
        self._loss = loss
        self._processes = []
        self._folder = tempfile.TemporaryDirectory(prefix="redundancy-")
        self._tool = [build / "lab/swarmtalk-lab", "--name", f"redundancy{os.getpid()}"]

    def __enter__(self):
        subprocess.run([*self._tool, "up", str(1 + self.HEARERS), "--medium", "radio", "--loss",
                        str(self._loss), "--config", ROOT / "tests/support/bare.toml"],
                       check=True, timeout=60)
        return self

    def __exit__(self, *_):
        subprocess.run([*self._tool, "down"], check=True, timeout=60)
        self._folder.cleanup()

    def _cli(self, number, *words):
        return [str(word) for word in (*self._tool, "exec", number, "--",
                                       self._build / "cli/swarmtalk-cli", *words)]

    def _air_us(self):
        done = subprocess.run([*self._tool, "medium", "status", "--json"], check=True, timeout=60,
                              capture_output=True, text=True)
        robot = json.loads(done.stdout)["robots"][0]
        return robot["air_us"] + MEAN_WAIT_US * robot["sent"]


def daemons(kind_of_lab, build, loss, messages):
    kinds = {"one packet of 24 B": (bytes(24), 20), "four full packets":
             (bytes(4 * CHANNEL_BYTES), 20)}
    ways = [("nothing", ()), *((f"redundancy {n}", ("--redundancy", n)) for n in (1, 2, 3, 4)),
            ("2 copies", ("--copies", 2)), ("3 copies", ("--copies", 3))]
    with kind_of_lab(build, loss) as lab:
        print(f"real daemons, {100 * loss:.0f} % of frames lost, {messages} messages to "
              f"{lab.HEARERS} robots")
        for kind, (payload, rate) in kinds.items():
            print(f"{kind}, {rate}/s\n  {'':24}{'delivered':>10}{'air':>8}{'twice':>7}")
            plain = None
            for way, words in ways:
                share, air, duplicates = lab.measure(messages, rate, payload, *map(str, words))
                plain = plain or air
                print(f"  {way:24}{100 * share:8.1f} %{air / plain:8.2f}{duplicates:7}",
                      flush=True)


def air(cell):
    """Robots in one place, 8 messages/s of 24 B: what share of the air they take."""
    print("share of the air at 6 Mb/s, 24 B at 8/s, no collisions counted")
    print(f"{'robots':>7}{'nothing':>10}{'redundancy 1':>14}")
    for robots in (10, 20, 50, 100):
        results = cell.run_all([{**ONE, "robots": robots, "talkers": robots, "loss": 0.2,
                                 "seconds": 20, "repairs": repairs} for repairs in (0, 1)])
        print(f"{robots:7}" + "".join(
            f"{100 * result['air_us_per_message'] * result['sent'] / 20e6:{width}.1f} %"
            for result, width in zip(results, (8, 12))))


def main():
    arguments = parse()
    if arguments.daemons or arguments.radio:
        return daemons(RadioDaemons if arguments.radio else Daemons, arguments.build.resolve(),
                       arguments.loss[0] if len(arguments.loss) == 1 else 0.2, arguments.messages)
    cell = Cell(arguments.build.resolve(), arguments.seconds)
    if arguments.waits:
        return waits(cell)
    if arguments.air:
        return air(cell)
    rows = frontier(cell, arguments.loss)
    if arguments.picture:
        draw(rows, arguments.picture)
    return None


if __name__ == "__main__":
    main()
