"""Several links in one daemon whose interfaces go and come, on real wires. Gateways, and what two
links carry: tests/virtual/gateway_test.cpp."""
import json

import pytest
from conftest import needs_root, one_line, program, run, wait_for
from wires import Wires, heard

pytestmark = needs_root

WIFI = '[links.wifi]\ntype = "raw_l2"\ninterface = "a0"\n'
SMALL = '[links.small]\ntype = "raw_l2"\ninterface = "b0"\nprofile = "kilobot"\n'


def node(number):
    return f"[node]\nid = {number}\n"


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        made.wire("b")
        yield made


def a_link_that_was_down_brings_messages_again(wires, first, second):
    both = WIFI + SMALL.replace('profile = "kilobot"\n', "")
    first.start(node(1) + both)
    second.start(node(2) + both)
    listener = second.subscribe("c", "-C", "2", "-W", "60")
    first.execute("ip", "link", "set", "a0", "down")
    wait_for(lambda: not first.link("wifi")["up"], what="the link to go down")
    first.publish("c", "1")
    first.execute("ip", "link", "set", "a0", "up")
    wait_for(lambda: first.link("wifi")["up"], what="the link")
    wires.wait_for_wire(first, "a")
    first.publish("c", "2")
    wait_for(lambda: second.counter("link_duplicates") == 1, what="the other link's packet")
    assert [m["text"] for m in heard(listener)] == ["1", "2"]


def one_link_goes_on_when_the_other_loses_its_interface(first, second):
    first.start(node(1) + WIFI)
    second.start(node(2) + WIFI + SMALL)
    second.execute("ip", "link", "del", "b0")
    listener = first.subscribe("c", "-C", "1", "-W", "60")
    second.publish("c", "still here")
    assert heard(listener)[0]["text"] == "still here"
    assert second.link("small")["up"] is False
    assert "gone" in second.link("small")["state"]


def a_start_without_one_interface_waits_for_it(wires, first, second, small):
    """@param small  the section of the link on b0, which the second robot gets later"""
    for each in (first, second):
        each.stop()
    second.execute("ip", "link", "del", "b0")
    begin = len(second.logged())
    second.start(node(2) + WIFI + small, wait=False)
    wait_for(lambda: second.cli("status").returncode == 0, what="the daemon to serve")
    wait_for(lambda: second.link("wifi")["up"], what="the link that is there")
    state = second.link("small")["state"]
    assert state.startswith("down: waiting for interface 'b0'; at the start this machine had ")
    one_line("".join(line for line in second.logged()[begin:].splitlines(True) if "b0" in line),
             "warn", "waiting for interface 'b0'", "a0")
    assert second.cli("reload").returncode == 0
    report = json.loads(second.cli("doctor", "--json", "--period", "0.1").stdout)
    missing, = [each for each in report["findings"] if each["severity"] == "error"]
    assert (missing["id"], missing["subject"]) == ("interface-missing", "b0")
    first.start(node(1) + WIFI + small)
    listener = first.subscribe("c", "-C", "1", "-W", "60")
    second.publish("c", "one")
    assert heard(listener)[0]["text"] == "one"
    wires.plug(second, "b")
    second.execute("ip", "address", "add", "10.83.84.2/24", "brd", "+", "dev", "b0")
    for each in (first, second):
        wait_for(lambda robot=each: robot.link("small")["counters"]["frames_received"] > 0,
                 what="the other's frames")


def no_link_that_can_start_is_an_error(second):
    second.stop()
    begin = len(second.logged())
    second.start(node(2) + WIFI.replace("a0", "none0") + SMALL.replace("b0", "none1"), wait=False)
    assert second.daemon.wait(timeout=60) == 1
    one_line(second.logged()[begin:], r"2\.toml:5: key 'links\.wifi\.interface'",
             "no such interface", "a0")


def test_robots_on_two_links_go_on_with_one(wires):
    first, second = (wires.robot("a", "b") for _ in range(2))
    a_link_that_was_down_brings_messages_again(wires, first, second)
    wires.end_all()
    one_link_goes_on_when_the_other_loses_its_interface(first, second)
    first.execute("ip", "address", "add", "10.83.84.1/24", "brd", "+", "dev", "b0")
    for small in (SMALL, SMALL.replace("raw_l2", "udp"),
                  SMALL.replace("raw_l2", "udp") + 'address = "10.83.84.255"\n'):
        small += "beacon_ms = 100\n"
        a_start_without_one_interface_waits_for_it(wires, first, second, small)
    no_link_that_can_start_is_an_error(second)


@pytest.mark.logic
def test_a_wrong_rule_is_told_by_check_with_its_line(tmp_path):
    config = tmp_path / "c.toml"
    config.write_text(WIFI + SMALL + '[[gateway]]\nfrom = "wifi/alarm"\nto = "small/alarm"\n')
    done = run(program("swarmtalkd"), "--check", "--config", config)
    assert done.returncode == 1
    one_line(done.stderr, r"c\.toml:10: key 'gateway\.to': channel 'alarm' \(number \d+\) does not "
                          r"exist on link 'small' \(profile kilobot\); it has 0 to 15")
