"""Several links in one daemon, profiles side by side, and gateway rules, on real wires."""
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


def test_a_message_crosses_to_a_small_profile_and_back_with_its_origin(wires):
    wifi = wires.robot("a").start(node(1) + WIFI)
    small = wires.robot("b").start(node(9) + SMALL)
    wires.robot("a", "b").start(node(2) + WIFI + SMALL + "node_id = 250\n" + RULE)
    listener = small.subscribe("3", "-C", "1", "-W", "40")
    wifi.publish("alarm", "12345")
    message, = heard(listener)
    assert message["text"] == "12345"
    assert message["sender"] == 250
    assert message["origin"] == {"link": None, "node": None, "message_number": None}
    listener = wifi.subscribe("alarm", "-C", "1", "-W", "40")
    small.publish("3", "hot!!")
    message, = heard(listener)
    assert message["text"] == "hot!!"
    assert message["sender"] == 2
    assert (message["origin"]["link"], message["origin"]["node"]) == ("small", 9)


def test_the_gateways_own_programs_reach_both_links(wires):
    wifi = wires.robot("a").start(node(1) + WIFI)
    small = wires.robot("b").start(node(9) + SMALL)
    gateway = wires.robot("a", "b").start(node(2) + WIFI + SMALL + "node_id = 250\n" + RULE)
    listeners = [wifi.subscribe("alarm", "-C", "1", "-W", "40"),
                 small.subscribe("3", "-C", "1", "-W", "40")]
    gateway.publish("alarm", "stop!")
    assert [heard(each)[0]["text"] for each in listeners] == ["stop!", "stop!"]


def frames_sent(robot):
    return sum(link["counters"]["frames_sent"] for link in robot.status()["links"])


def from_others(listener):
    """Ends a listener; the texts it heard from other robots, in order."""
    listener.terminate()
    return sorted(message["text"] for message in heard(listener) if not message["local"])


@pytest.mark.parametrize("profile", ["kilobot", "wifi", "footbot"])
def test_two_gateways_side_by_side_do_not_go_round_in_circles(wires, profile):
    other = SMALL.replace("kilobot", profile)
    wifi = wires.robot("a").start(node(1) + WIFI)
    small = wires.robot("b").start(node(9) + other)
    gateways = [
        wires.robot("a", "b").start(node(number) + WIFI + other + f"node_id = {number}\n" + RULE)
        for number in (250, 251)]
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


def test_a_robot_on_both_links_hears_another_once(wires):
    both = WIFI + SMALL.replace('profile = "kilobot"\n', "")
    first = wires.robot("a", "b").start(node(1) + both)
    second = wires.robot("a", "b").start(node(2) + both)
    listener = second.subscribe("c")
    for number in range(3):
        first.publish("c", str(number))
    wait_for(lambda: second.counter("link_duplicates") == 3, what="the other link's packets")
    listener.terminate()
    assert [m["text"] for m in heard(listener)] == ["0", "1", "2"]


def test_who_hears_both_links_hears_once_also_after_one_was_down(wires):
    both = WIFI + SMALL.replace('profile = "kilobot"\n', "")
    first = wires.robot("a", "b").start(node(1) + both)
    second = wires.robot("a", "b").start(node(2) + both)
    listener = second.subscribe("c")
    first.publish("c", "0")
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


def test_one_link_goes_on_when_the_other_loses_its_interface(wires):
    both = WIFI + SMALL
    first = wires.robot("a").start(node(1) + WIFI)
    second = wires.robot("a", "b").start(node(2) + both)
    second.execute("ip", "link", "del", "b0")
    listener = first.subscribe("c", "-C", "1", "-W", "40")
    second.publish("c", "still here")
    assert heard(listener)[0]["text"] == "still here"
    assert second.link("small")["up"] is False
    assert "gone" in second.link("small")["state"]


def test_a_link_whose_interface_is_missing_is_named_at_the_start(wires):
    robot = wires.robot("a")
    robot.start(node(1) + WIFI + SMALL, wait=False)
    assert robot.daemon.wait(timeout=30) == 1
    one_line(robot.logged(), r"1\.toml:8: key 'links\.small\.interface'", "no such interface", "a0")


def test_too_long_for_the_small_link_says_so(wires):
    robot = wires.robot("a", "b").start(node(2) + WIFI + SMALL)
    one_line(robot.cli("pub", "3", "x" * 41).stderr, "41 bytes", "40")
    one_line(robot.cli("pub", "3", "").stderr, "at least 1 byte")
    robot.publish("big", "x" * 5000)
    one_line(robot.cli("pub", "3", "x", "--ttl", "16").stderr, "TTL 16", "15")
    robot.publish("big", "x", "--ttl", "16")


@pytest.mark.logic
def test_a_wrong_rule_is_told_by_check_with_its_line(tmp_path):
    config = tmp_path / "c.toml"
    config.write_text(WIFI + SMALL + '[[gateway]]\nfrom = "wifi/alarm"\nto = "small/alarm"\n')
    done = run(program("swarmtalkd"), "--check", "--config", config)
    assert done.returncode == 1
    one_line(done.stderr, r"c\.toml:10: key 'gateway\.to': channel 'alarm' \(number \d+\) does not "
                          r"exist on link 'small' \(profile kilobot\); it has 0 to 15")
