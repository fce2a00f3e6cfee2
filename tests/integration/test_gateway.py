"""Several links in one daemon, profiles side by side, and gateway rules, on real wires."""
import json
import time

import pytest
from conftest import needs_root, one_line, program, run, wait_for
from wires import Wires, heard

pytestmark = needs_root

WIFI = '[links.wifi]\ntype = "raw_l2"\ninterface = "a0"\n'
SMALL = '[links.small]\ntype = "raw_l2"\ninterface = "b0"\nprofile = "kilobot"\n'
RULE = '[[gateway]]\nfrom = "wifi/alarm"\nto = "small/3"\nboth_ways = true\n'


def node(number):
    return f"[node]\nid = {number}\n"


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        made.wire("b")
        yield made


def a_message_crosses_to_a_small_profile_and_back_with_its_origin(wifi, small):
    listener = small.subscribe("3", "-C", "1", "-W", "60")
    wifi.publish("alarm", "12345")
    message, = heard(listener)
    assert message["text"] == "12345"
    assert message["sender"] == 250
    assert message["origin"] == {"link": None, "node": None, "message_number": None}
    listener = wifi.subscribe("alarm", "-C", "1", "-W", "60")
    small.publish("3", "hot!!")
    message, = heard(listener)
    assert message["text"] == "hot!!"
    assert message["sender"] == 2
    assert (message["origin"]["link"], message["origin"]["node"]) == ("small", 9)


def the_gateways_own_programs_reach_both_links(wifi, small, gateway):
    listeners = [wifi.subscribe("alarm", "-C", "1", "-W", "60"),
                 small.subscribe("3", "-C", "1", "-W", "60")]
    gateway.publish("alarm", "stop!")
    assert [heard(each)[0]["text"] for each in listeners] == ["stop!", "stop!"]


def frames_sent(robot):
    return sum(link["counters"]["frames_sent"] for link in robot.status()["links"])


def from_others(listener):
    """Ends a listener; the texts it heard from other robots, in order."""
    listener.terminate()
    return sorted(message["text"] for message in heard(listener) if not message["local"])


def two_gateways_side_by_side_do_not_go_round_in_circles(wifi, small, gateways, profile):
    other = SMALL.replace("kilobot", profile)
    wifi.start(node(1) + WIFI)
    small.start(node(9) + other)
    for number, each in zip((250, 251), gateways):
        each.start(node(number) + WIFI + other + f"node_id = {number}\n" + RULE)
    at_wifi = wifi.subscribe("alarm")
    at_small = small.subscribe("3")
    for text in ("one__", "two__", "three"):
        wifi.publish("alarm", text, "--ttl", "2")
        small.publish("3", text.upper(), "--ttl", "2")

    def done(gateway):
        counters = gateway.status()["counters"]
        return counters["gateway_sent"] + counters["gateway_there"] >= 6

    wait_for(lambda: all(done(each) for each in gateways), what="the copies")
    frames = [frames_sent(each) for each in gateways]
    time.sleep(0.3)
    assert [frames_sent(each) for each in gateways] == frames, "something goes on by itself"
    assert from_others(at_wifi) == ["ONE__", "THREE", "TWO__"]
    texts = from_others(at_small)
    # Kilobot packets cannot name an origin: there each gateway's copy is a message of its own.
    assert sorted(set(texts)) == ["one__", "three", "two__"]
    assert len(texts) == 3 if profile == "wifi" else len(texts) <= 6
    for each in gateways:
        counters = each.status()["counters"]
        assert counters["gateway_sent"] + counters["gateway_there"] == 6
        assert counters["gateway_full"] == counters["gateway_link_down"] == 0


def test_messages_cross_a_gateway_and_two_go_round_in_no_circles(wires):
    wifi, small = wires.robot("a"), wires.robot("b")
    gateways = [wires.robot("a", "b") for _ in range(2)]
    wifi.start(node(1) + WIFI)
    small.start(node(9) + SMALL)
    gateways[0].start(node(2) + WIFI + SMALL + "node_id = 250\n" + RULE)
    a_message_crosses_to_a_small_profile_and_back_with_its_origin(wifi, small)
    the_gateways_own_programs_reach_both_links(wifi, small, gateways[0])
    for profile in ("kilobot", "wifi", "footbot"):
        wires.end_all()
        two_gateways_side_by_side_do_not_go_round_in_circles(wifi, small, gateways, profile)


def who_hears_both_links_hears_once_also_after_one_was_down(wires, first, second):
    both = WIFI + SMALL.replace('profile = "kilobot"\n', "")
    first.start(node(1) + both)
    second.start(node(2) + both)
    listener = second.subscribe("c")
    first.publish("c", "0")
    wait_for(lambda: second.counter("link_duplicates") == 1, what="the other link's packet")
    first.execute("ip", "link", "set", "a0", "down")
    wait_for(lambda: not first.link("wifi")["up"], what="the link to go down")
    first.publish("c", "1")
    first.execute("ip", "link", "set", "a0", "up")
    wait_for(lambda: first.link("wifi")["up"], what="the link")
    wires.wait_for_wire(first, "a")
    for text in ("2", "3"):
        first.publish("c", text)
    wait_for(lambda: second.counter("link_duplicates") == 3, what="the other link's packets")
    listener.terminate()
    assert [m["text"] for m in heard(listener)] == ["0", "1", "2", "3"]
    assert second.counter("messages_lost_air") == 0, "what one link lost, the other brought"


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


def too_long_for_the_small_link_says_so(robot):
    robot.start(node(2) + WIFI + SMALL)
    one_line(robot.cli("pub", "3", "x" * 41).stderr, "41 bytes", "40")
    one_line(robot.cli("pub", "3", "").stderr, "at least 1 byte")
    robot.publish("big", "x" * 5000)
    one_line(robot.cli("pub", "3", "x", "--ttl", "16").stderr, "TTL 16", "15")
    robot.publish("big", "x", "--ttl", "16")


def test_robots_on_two_links_hear_once_and_go_on_with_one(wires):
    first, second = (wires.robot("a", "b") for _ in range(2))
    who_hears_both_links_hears_once_also_after_one_was_down(wires, first, second)
    wires.end_all()
    too_long_for_the_small_link_says_so(first)
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
