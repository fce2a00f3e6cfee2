"""`swarmtalk-cli doctor` on the kernel's own 802.11: each test breaks one thing of the radio, and
doctor names that alone; on healthy robots it finds nothing, in every mode."""
import contextlib
import json
import os
import time

import guest
import pytest

pytestmark = pytest.mark.field
COUNTRY = "DE"
LINK = "air_rate_mbps = 6\n"  # the kernel does not tell a multicast rate that was set


@pytest.fixture(scope="module")
def machine():
    guest.needs_guest()
    if not os.path.exists("/lib/firmware/regulatory.db"):
        pytest.skip("wireless-regdb is not installed (tools/setup more): no country can be set")
    with guest.Guest(radios=3) as booted:
        booted.check("", f"mount -t debugfs none /sys/kernel/debug; iw reg reload; "
                         f"iw reg set {COUNTRY}; i=0; until iw reg get | grep -q '^country "
                         f"{COUNTRY}'; do i=$((i + 1)); [ $i -lt 50 ] || exit 1; sleep 0.1; done")
        yield booted


@contextlib.contextmanager
def swarm(machine, mode, link=LINK, **options):
    """A network of this mode in which robots 1 and 2 have daemons; robot 2 answers questions."""
    options.setdefault("robots", ["r1", "r2"])
    with machine.network(mode, **options) as network:
        for robot in ("r1", "r2"):
            if mode.startswith("ap"):
                machine.run(robot, "iw dev wlan0 set power_save off")
                address(machine, robot)
            machine.daemon(robot, link)
        answering = machine.start("r2", guest.program("swarmtalk-cli"), "--socket", "/run/r2.sock",
                                  "ping", "--answer")
        try:
            yield network
        finally:
            answering.end()
            answering.close()
            machine.end_daemons()


def address(machine, robot):
    machine.check(robot, f"ip link set lo up; ip address replace 10.231.79.{robot[1:]}/24 "
                         "dev wlan0")


def examine(machine, robot, *words):
    """({id: finding}, report, exit code); notes are no findings."""
    done = machine.cli(robot, "doctor", "--json", *words, timeout=120)
    assert done.stdout, done.stderr
    report = json.loads(done.stdout)
    found = {each["id"]: each for each in report["findings"] if each["severity"] != "note"}
    return found, report, done.returncode


def only(machine, name, *words, robot="r1"):
    found, report, code = examine(machine, robot, *words)
    assert (list(found), code) == ([name], 1), report
    return found[name]


def healthy(machine, *words, robot="r1"):
    found, report, code = examine(machine, robot, *words)
    assert (found, report["not_looked_at"], code) == ({}, [], 0), report
    return report


def phy(machine, where):
    return machine.check(where, "cat /sys/class/net/wlan0/phy80211/name").strip()


def neighbours(machine, robot):
    return json.loads(machine.cli(robot, "neighbours", "--json").stdout)["neighbours"]


@pytest.mark.parametrize("mode", ["ap", "ibss", "mesh"])
def test_healthy_robots_have_no_findings(machine, mode):
    with swarm(machine, mode):
        report = healthy(machine, "--peer", "2")
        radio = report["links"][0]["radio"]
        assert radio["mode"] == {"ap": "managed"}.get(mode, mode)
        assert (radio["channel"], radio["country"]) == (1, COUNTRY)
        healthy(machine, robot="r2")
        # A robot that the radio hears itself has a signal; through an access point nobody has.
        signal = neighbours(machine, "r1")[0]["signal_dbm"]
        assert signal is None if mode == "ap" else -100 < signal < 0
        assert (report["peer"]["signal_dbm"] is None) == (mode == "ap")


def test_client_isolation_is_named(machine):
    with swarm(machine, "ap-isolated"):
        only(machine, "client-isolation", "--peer", "2", "--address", "10.231.79.2")


def test_power_save_is_named_and_switched_off(machine):
    with swarm(machine, "ap"):
        machine.check("r1", "iw dev wlan0 set power_save on")
        only(machine, "power-save")
        found, _, code = examine(machine, "r1", "--fix")
        assert (found["power-save"]["fixed"], code) == (True, 0)
        assert "off" in machine.check("r1", "iw dev wlan0 get power_save")
        healthy(machine)


def test_broadcasts_that_wait_for_a_sleeping_client_are_named(machine):
    with swarm(machine, "ap", robots=["r1", "r2", "r3"]):
        healthy(machine, "--peer", "2")
        file = f"/sys/kernel/debug/ieee80211/{phy(machine, 'r3')}/hwsim/ps"
        machine.check("", f"echo 1 > {file}")
        try:
            only(machine, "multicast-delayed", "--peer", "2")
        finally:
            machine.check("", f"echo 0 > {file}")


def test_slow_broadcasts_of_an_access_point_are_named(machine):
    with swarm(machine, "ap", basic_rates=""):
        assert "1 Mb/s" in only(machine, "multicast-rate")["what"]


def test_a_slow_multicast_rate_is_named_and_set(machine):
    with swarm(machine, "ibss", link="", mcast_rate="1"):
        assert "1 Mb/s" in only(machine, "multicast-rate")["what"]
        found, report, code = examine(machine, "r1", "--fix")
        assert (found["multicast-rate"]["fixed"], code) == (True, 0), report


def test_a_country_that_is_not_set_is_named_and_set(machine):
    with swarm(machine, "ibss"):
        machine.check("", "iw reg set 00; sleep 2")
        try:
            only(machine, "regulatory-domain")
            found, report, _ = examine(machine, "r1", "--country", COUNTRY, "--fix")
            assert found["regulatory-domain"]["fixed"] is True, report
        finally:
            machine.check("", f"iw reg set {COUNTRY}; sleep 2")
        healthy(machine)


def test_a_weak_signal_is_named(machine):
    with swarm(machine, "ap"):
        file = f"/sys/kernel/debug/ieee80211/{phy(machine, 'ap1')}/hwsim/rx_rssi"
        # What it sends arrives at this, dBm, and its power; the file takes no sign.
        machine.check("", f"set -e; echo {2 ** 64 - 100} > {file}; sleep 6")
        try:
            assert "dBm" in only(machine, "signal-low")["what"]
        finally:
            machine.check("", f"echo {2 ** 64 - 50} > {file}")


def test_a_link_that_works_one_way_only_is_named(machine):
    with machine.medium() as medium, swarm(machine, "ibss"):
        healthy(machine, "--peer", "2")
        medium.lose("r1", "r2", 1)
        assert "does not hear this robot" in only(machine, "peer-silent", "--peer", "2")["what"]


def test_the_wrong_mode_is_named(machine):
    with swarm(machine, "ibss"):
        machine.check("r1", "ip link set wlan0 down; iw dev wlan0 set type monitor; "
                            "ip link set wlan0 up")
        assert "monitor" in only(machine, "wrong-mode")["what"]


def test_a_radio_outside_a_network_is_named(machine):
    with swarm(machine, "ibss"):
        machine.check("r1", "iw dev wlan0 ibss leave")
        only(machine, "not-joined")


def test_the_wrong_network_and_channel_are_named(machine):
    with swarm(machine, "ibss"):
        healthy(machine, "--network", "swarm", "--channel", "1", "--mode", "ibss")
        only(machine, "wrong-network", "--network", "others")
        only(machine, "wrong-channel", "--channel", "6")
        # Between two, by what the other says of itself.
        machine.check("r2", "iw dev wlan0 ibss leave; iw dev wlan0 ibss join swarm 2437 fixed-freq "
                            "02:11:22:33:44:55 basic-rates 6 mcast-rate 6; sleep 3")
        report = machine.cli("r2", "doctor", "--json").stdout
        file = machine.put("report.json", report)
        only(machine, "wrong-channel", "--peer", "2", "--peer-report", file)
        machine.check("r2", "iw dev wlan0 ibss leave; iw dev wlan0 ibss join others 2412 "
                            "fixed-freq 02:11:22:33:44:66 basic-rates 6 mcast-rate 6; sleep 3")
        machine.put("report.json", machine.cli("r2", "doctor", "--json").stdout)
        only(machine, "wrong-network", "--peer", "2", "--peer-report", file)


def test_packets_that_all_send_on_at_once_are_named(machine):
    def sent_on():
        assert machine.cli("r1", "pub", "far", "one", "--ttl", "3").returncode == 0
        return machine.stats("r2")["links"][0]["counters"]["node_packets_forwarded"] > 0

    for link, names in ((LINK, []), (LINK + "forward_jitter_us = 0\n", ["forwards-collide"])):
        with swarm(machine, "ibss", link=link):
            end = time.monotonic() + 60
            while not sent_on():
                assert time.monotonic() < end, "r2 sends nothing on"
            found, report, _ = examine(machine, "r2")
            assert list(found) == names, report
