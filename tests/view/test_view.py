"""swarmtalk-view: what it shows of a lab. Whom it lets in is in test_server.py."""
import contextlib
import json
import os
import signal

import pytest
import swarmtalk
from conftest import one_line, serving, wait_for
from test_foxglove import serve_a_foxglove_client
from viewers import (beacons, channels_of, message_where, page, robots_of, state_with,
                     status_of_channels, watch)
from websocket import get


def get_the_page_in_one_small_file(view):
    status, head, body = get(view.port)
    assert status == 200
    assert 10_000 < len(body) < 60_000
    assert "default-src 'none'" in head and "X-Frame-Options: DENY" in head
    for word in (b"<script src", b"<link rel=\"stylesheet", b"@import", b"https://", b"url("):
        assert word not in body
    assert get(view.port, "/other")[0] == 404


def see_robots_where_the_lab_put_them(lab, view):
    with page(view) as viewer:
        state = state_with(viewer, 1, 2, 3, 4)
    assert state["self"] == 1
    for number, robot in robots_of(state).items():
        assert (robot["x"], robot["y"]) == pytest.approx(lab.place(number), abs=0.001)
        assert ("self" in robot) == (number == 1)
    assert sorted(link[:2] for link in state["links"]) == [[2, 1], [3, 1], [4, 1]]


def see_a_pose_that_changes(lab, view):
    with page(view) as viewer:
        state_with(viewer, 2)
        assert lab.cli(2, "pose", "set", "3.25", "-1.5", "0").returncode == 0
        message_where(viewer, lambda m: m["t"] == "state" and
                      robots_of(m).get(2, {}).get("x") == 3.25, 2.0, "the new pose")


def see_a_robot_that_falls_silent_get_older(lab, view):
    with page(view) as viewer:
        state = state_with(viewer, 2)
        assert robots_of(state)[2]["heard_age"] < 1000
        lab.kill(2)
        state = message_where(viewer, lambda m: m["t"] == "state" and
                              robots_of(m)[2]["heard_age"] > 3000, 6.0, "an older robot")
        assert robots_of(state)[2]["pose_age"] >= 3000


def hear_a_channel_that_is_asked_for(lab, view):
    with page(view) as viewer:
        viewer.send(json.dumps({"op": "watch", "channel": "alarm"}))
        message_where(viewer, lambda m: m["t"] == "info" and
                      any(c["name"] == "alarm" for c in m["channels"]))
        assert lab.cli(2, "pub", "alarm", "fire").returncode == 0
        heard = message_where(viewer, lambda m: m["t"] == "msg")
        assert (heard["from"], bytes.fromhex(heard["hex"])) == (2, b"fire")
        info = message_where(viewer, lambda m: m["t"] == "info" and
                             any(c["messages"] for c in m["channels"]))
        channel, = [c for c in info["channels"] if c["name"] == "alarm"]
        assert [sender for sender, _ in channel["senders"]] == [2]


def give_up_a_channel_with_its_window(lab):
    with serving(lab) as view:
        with page(view) as viewer:
            for number in range(100):
                watch(viewer, f"much{number}")
            watch(viewer, "late")
            wait_for(lambda: channels_of(lab, 1) == {"late", "debug", "harvest"},
                     what="unsubscribing")
            assert lab.cli(2, "pub", "late", "fire").returncode == 0
            heard = message_where(viewer, lambda m: m["t"] in ("msg", "notice"))
            assert heard.get("hex") == b"fire".hex(), heard
            with page(view) as other:
                watch(other, "late")
                message_where(other, lambda m: m["t"] == "info")
            viewer.send(json.dumps({"op": "card", "robot": 0}))
            message_where(viewer, lambda m: m["t"] == "info")
            assert "late" in channels_of(lab, 1), "one still looks"
        wait_for(lambda: channels_of(lab, 1) == {"debug", "harvest"}, what="a page that is gone")
        assert view.end() == (128 + signal.SIGTERM, "")


def keep_no_channel_that_no_program_uses(lab):
    with serving(lab), serving(lab):
        running = lab.start_cli(1, "sub", "tmp")
        wait_for(lambda: [each["onlookers"] for each in status_of_channels(lab, 1)
                          if each["name"] == "tmp" and each["subscribers"] == 3] == [2],
                 what="both viewers")
        running.kill()
        running.wait()
        wait_for(lambda: channels_of(lab, 1) == {"debug", "harvest"}, what="giving it up")


def leave_channels_to_programs(lab):
    with serving(lab) as view:
        with contextlib.ExitStack() as stack:
            viewers = [stack.enter_context(page(view)) for _ in range(30)]
            for number, viewer in enumerate(viewers):
                watch(viewer, f"window{number}")
            told = message_where(viewers[-1], lambda m: m["t"] == "notice")
            assert "window29" in told["text"] and "close one" in told["text"], told
            program_of_robot = lab.start_cli(1, "sub", "important")
            try:
                message_where(viewers[0], lambda m: m["t"] == "info" and any(
                    each["name"] == "important" and each["subscribers"] == 2
                    for each in m["channels"]), what="a channel of a program")
            finally:
                program_of_robot.kill()
                program_of_robot.wait()
            wait_for(lambda: "important" not in channels_of(lab, 1), what="a program that is gone")


def read_log_lines_of_all_robots(lab, view):
    with page(view) as viewer:
        message_where(viewer, lambda m: m["t"] == "hello")
        assert lab.cli(2, "pub", "debug", "tired").returncode == 0
        line = message_where(viewer, lambda m: m["t"] == "log")
        assert (line["from"], line["text"]) == (2, "tired")
        message_where(viewer, lambda m: m["t"] == "info" and any(
            each["name"] == "debug" and each["messages"] == 1 for each in m["channels"]))
    with page(view) as viewer:
        assert message_where(viewer, lambda m: m["t"] == "log")["text"] == "tired"


def read_values_that_robots_offer(lab, view):
    offering = lab.start_cli(2, "harvest", "--offer", "battery=71 %")
    try:
        with page(view) as viewer:
            viewer.send(json.dumps({"op": "card", "robot": 2}))
            wait_for(lambda: "battery" in lab.cli(1, "harvest", "-W", "0.3").stdout, what="offer")
            card = message_where(viewer, lambda m: m["t"] == "card" and "values" in m)
            assert card["values"] == {"battery": "71 %"}
    finally:
        offering.kill()
        offering.wait()


def send_as_an_operator_only(lab, view):
    request = json.dumps({"op": "publish", "channel": "go", "text": "now"})
    with page(view) as viewer:
        assert not message_where(viewer, lambda m: m["t"] == "hello")["operate"]
        viewer.send(request)
        assert "--operate" in message_where(viewer, lambda m: m["t"] == "notice")["text"]
    with serving(lab, "--operate") as operators, page(operators) as viewer:
        viewer.send(request)
        assert message_where(viewer, lambda m: m["t"] == "notice")["text"] == "sent on channel go"
        for number in (70000, "70000", "-1"):
            viewer.send(json.dumps({"op": "publish", "channel": number, "text": "now"}))
            text = message_where(viewer, lambda m: m["t"] == "notice")["text"]
            assert text == "a channel is a name, or a number from 0 to 65535", number


def wait_for_a_daemon_that_goes(lab):
    with serving(lab) as view:
        config = os.path.join(os.path.dirname(lab.socket(1)), "1.toml")
        with page(view) as viewer:
            message_where(viewer, lambda m: m["t"] == "state" and "no_daemon_age" not in m)
            lab.kill(1)
            message_where(viewer, lambda m: m["t"] == "state" and "no_daemon_age" in m)
        assert os.path.isdir(os.path.dirname(config))
        code, errors = view.end()
        assert code == 128 + signal.SIGTERM
        one_line(errors, "lost swarmtalkd: ", "; reconnecting")


def test_a_viewer_sees_hears_and_asks_what_robots_do(make_lab, make_view, tmp_path):
    lab = make_lab(4, *beacons(tmp_path, "[reserved]\ndebug = true\nharvest = true\n"))
    view = make_view(lab.socket(1))
    get_the_page_in_one_small_file(view)
    see_robots_where_the_lab_put_them(lab, view)
    see_a_pose_that_changes(lab, view)
    hear_a_channel_that_is_asked_for(lab, view)
    read_log_lines_of_all_robots(lab, view)
    read_values_that_robots_offer(lab, view)
    serve_a_foxglove_client(lab, view, tmp_path)
    send_as_an_operator_only(lab, view)
    view.end()
    give_up_a_channel_with_its_window(lab)
    keep_no_channel_that_no_program_uses(lab)
    leave_channels_to_programs(lab)
    with serving(lab) as another:
        see_a_robot_that_falls_silent_get_older(lab, another)
    wait_for_a_daemon_that_goes(lab)


def test_robots_that_are_not_heard_are_shown_by_their_reports(make_lab, make_view, tmp_path):
    """Robots half a metre apart that hear 0.6 m far: the last one is four hops away."""
    base = tmp_path / "base.toml"
    base.write_text("[links.wifi]\nbeacon_ms = 200\nvirtual_range_m = 0.6\n"
                    "[reserved]\nreport = true\nharvest = true\n"
                    "[node]\nname = \"scout\"\n")
    lab = make_lab(9, "--config", base)
    view = make_view(lab.socket(1))
    running = lab.start_cli(9, "sub", "alarm")
    offering = lab.start_cli(9, "harvest", "--offer", "battery=3.91")
    with page(view) as viewer, contextlib.ExitStack() as stack:
        robot = stack.enter_context(swarmtalk.Client("lamp", socket_path=lab.socket(9)))
        robot.advertise("light")
        robot.process()
        for process in (running, offering):
            stack.callback(process.wait)
            stack.callback(process.kill)
        viewer.send(json.dumps({"op": "card", "robot": 9}))
        state = state_with(viewer, *range(1, 10))
        last = robots_of(state)[9]
        assert (last["x"], last["y"]) == pytest.approx(lab.place(9), abs=0.001)
        assert "told_age" in last
        state = message_where(viewer, lambda m: m["t"] == "state" and
                              [8, 9] in [link[:2] for link in m["links"]], 30.0, "a far link")
        card = message_where(viewer, lambda m: m["t"] == "card" and "lost" in m, 30.0, "a card")
        assert card["id"] == 9
        card = message_where(viewer, lambda m: m["t"] == "card" and "programs" in m, 30.0,
                             "programs, which are told for an open card only")
        assert "swarmtalk-cli" in card["programs"]
        # A channel that is published there, and that nobody here listens to.
        info = message_where(viewer, lambda m: m["t"] == "info" and any(
            "publishing" in channel for channel in m["channels"]), 30.0, "a channel")
        lamp = [channel for channel in info["channels"] if "publishing" in channel]
        assert [(each["name"], each["publishing"]) for each in lamp] == [("", 1)], lamp
        viewer.send(json.dumps({"op": "watch", "channel": lamp[0]["n"]}))
        message_where(viewer, lambda m: m["t"] == "info" and any(
            channel["n"] == lamp[0]["n"] and channel.get("subscribers")
            for channel in m["channels"]), 30.0, "that it is listened to")
        card = message_where(viewer, lambda m: m["t"] == "card" and m.get("values"), 40.0,
                             "values that a program far away has set")
        assert card["values"] == {"battery": "3.91"}
        message_where(viewer, lambda m: m["t"] == "state" and all(
            robots_of(m)[number].get("name") == "scout" for number in (1, 9)), 30.0, "their names")
