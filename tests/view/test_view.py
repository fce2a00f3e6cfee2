"""swarmtalk-view: what it shows of a lab, whom it lets in, and how it bears what goes wrong."""
import contextlib
import json
import os
import signal
import socket
import time

import pytest
from conftest import one_line, program, run, wait_for
from websocket import Refused, WebSocket, get

PAGE = "swarmtalk.view.v1"


def page(view, **options):
    return WebSocket(view.port, protocol=PAGE, **options)


def message_where(viewer, condition, timeout=10.0, what="message"):
    """The first message for which the condition holds."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        message = json.loads(viewer.receive())
        if condition(message):
            return message
    raise AssertionError(f"timed out waiting for {what}")


def robots_of(state):
    return {robot["id"]: robot for robot in state["robots"]}


def state_with(viewer, *ids, timeout=10.0):
    """A state in which these robots have a place."""
    return message_where(viewer, lambda m: m["t"] == "state" and all(
        "x" in robots_of(m).get(number, {}) for number in ids), timeout, f"robots {ids}")


def beacons(tmp_path, text=""):
    """Options for a lab whose silent robots send ten beacons a second."""
    path = tmp_path / "base.toml"
    path.write_text("[links.wifi]\nbeacon_ms = 100\n" + text)
    return "--config", path


def test_the_page_is_one_small_file_that_loads_nothing_from_elsewhere(make_lab, make_view):
    view = make_view(make_lab(1).socket(1))
    status, head, body = get(view.port)
    assert status == 200
    assert 10_000 < len(body) < 60_000
    assert "default-src 'none'" in head and "X-Frame-Options: DENY" in head
    for word in (b"<script src", b"<link rel=\"stylesheet", b"@import", b"https://", b"url("):
        assert word not in body
    assert get(view.port, "/other")[0] == 404


def test_robots_are_where_the_lab_put_them(make_lab, make_view, tmp_path):
    lab = make_lab(4, *beacons(tmp_path))
    view = make_view(lab.socket(1))
    with page(view) as viewer:
        state = state_with(viewer, 1, 2, 3, 4)
    assert state["self"] == 1
    for number, robot in robots_of(state).items():
        assert (robot["x"], robot["y"]) == pytest.approx(lab.place(number), abs=0.001)
        assert ("self" in robot) == (number == 1)
    assert sorted(link[:2] for link in state["links"]) == [[2, 1], [3, 1], [4, 1]]


def test_a_pose_that_changes_is_shown_within_a_moment(make_lab, make_view, tmp_path):
    lab = make_lab(2, *beacons(tmp_path))
    view = make_view(lab.socket(1))
    with page(view) as viewer:
        state_with(viewer, 2)
        assert lab.cli(2, "pose", "set", "3.25", "-1.5", "0").returncode == 0
        message_where(viewer, lambda m: m["t"] == "state" and
                      robots_of(m).get(2, {}).get("x") == 3.25, 2.0, "the new pose")


def test_a_robot_that_falls_silent_gets_older(make_lab, make_view, tmp_path):
    lab = make_lab(2, *beacons(tmp_path))
    view = make_view(lab.socket(1))
    with page(view) as viewer:
        state = state_with(viewer, 2)
        assert robots_of(state)[2]["heard_age"] < 1000
        lab.kill(2)
        state = message_where(viewer, lambda m: m["t"] == "state" and
                              robots_of(m)[2]["heard_age"] > 3000, 6.0, "an older robot")
        assert robots_of(state)[2]["pose_age"] >= 3000


def test_messages_of_a_channel_come_when_they_are_asked_for(make_lab, make_view):
    lab = make_lab(2)
    view = make_view(lab.socket(1))
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


def test_log_lines_of_all_robots_come_and_are_told_later_too(make_lab, make_view, tmp_path):
    lab = make_lab(2, *beacons(tmp_path, "[reserved]\ndebug = true\n"))
    view = make_view(lab.socket(1))
    with page(view) as viewer:
        message_where(viewer, lambda m: m["t"] == "hello")
        assert lab.cli(2, "pub", "debug", "tired").returncode == 0
        line = message_where(viewer, lambda m: m["t"] == "log")
        assert (line["from"], line["text"]) == (2, "tired")
    with page(view) as viewer:
        assert message_where(viewer, lambda m: m["t"] == "log")["text"] == "tired"


def test_values_that_robots_offer_are_on_their_cards(make_lab, make_view, tmp_path):
    lab = make_lab(2, *beacons(tmp_path, "[reserved]\nharvest = true\n"))
    view = make_view(lab.socket(1))
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


def test_who_only_looks_cannot_send_and_an_operator_can(make_lab, make_view):
    lab = make_lab(1)
    request = json.dumps({"op": "publish", "channel": "go", "text": "now"})
    with page(make_view(lab.socket(1))) as viewer:
        assert not message_where(viewer, lambda m: m["t"] == "hello")["operate"]
        viewer.send(request)
        assert "--operate" in message_where(viewer, lambda m: m["t"] == "notice")["text"]
    with page(make_view(lab.socket(1), "--operate")) as viewer:
        viewer.send(request)
        assert message_where(viewer, lambda m: m["t"] == "notice")["text"] == "sent on channel go"


def test_a_page_from_elsewhere_reads_nothing_unless_it_is_allowed(make_lab, make_view):
    lab = make_lab(1)
    view = make_view(lab.socket(1))
    own = f"http://localhost:{view.port}"
    with page(view, origin=own) as viewer:
        message_where(viewer, lambda m: m["t"] == "state")
    for options in ({"origin": "http://evil.example"}, {"origin": "null"},
                    {"host": f"evil.example:{view.port}"},
                    {"host": f"evil.example:{view.port}",
                     "origin": f"http://evil.example:{view.port}"}):
        with pytest.raises(Refused) as refused:
            page(view, **options)
        assert refused.value.status == 403
    assert get(view.port, host=f"evil.example:{view.port}")[0] == 403
    assert "Access-Control-Allow-Origin" not in get(view.port)[1]
    allowing = make_view(lab.socket(1), "--allow-origin", "http://lab:8081")
    with page(allowing, origin="http://lab:8081") as viewer:
        message_where(viewer, lambda m: m["t"] == "state")


def test_it_listens_on_this_machine_alone_unless_told_otherwise(make_lab, make_view):
    lab = make_lab(1)
    view = make_view(lab.socket(1))
    listening = run("cat", "/proc/net/tcp", "/proc/net/tcp6").stdout
    ours = [line.split()[1] for line in listening.splitlines()
            if line.split()[1].endswith(f":{view.port:04X}") and line.split()[3] == "0A"]
    assert ours == [f"0100007F:{view.port:04X}"]
    everywhere = make_view(lab.socket(1), "--listen", "0.0.0.0")
    assert "/?token=" in everywhere.address


def test_another_subprotocol_is_refused_with_those_that_it_speaks(make_lab, make_view):
    view = make_view(make_lab(1).socket(1))
    with pytest.raises(Refused) as refused:
        WebSocket(view.port, protocol="mqtt")
    assert refused.value.status == 400 and PAGE in refused.value.text


def test_garbage_is_answered_and_harms_nobody(make_lab, make_view):
    view = make_view(make_lab(1).socket(1))
    for garbage in (b"\x00\xff" * 3000, b"GET / HTTP/9.9\r\n\r\n",
                    b"POST / HTTP/1.1\r\nHost: x\r\n\r\n",
                    b"GET / HTTP/1.1\r\n" + b"x: y\r\n" * 5000):
        with socket.create_connection(("127.0.0.1", view.port), timeout=10) as connection:
            with contextlib.suppress(OSError):
                connection.sendall(garbage)
                connection.shutdown(socket.SHUT_WR)
                assert not connection.recv(100).startswith(b"HTTP/1.1 200")
    with page(view) as other:
        with page(view) as viewer:
            for text in ("", "nonsense", "[]", "{}", '{"op":7}', '{"op":"card"}',
                         '{"op":"card","robot":-1}', '{"op":"card","robot":1e99}',
                         '{"op":"watch","channel":[]}', '{"op":"watch","channel":"99999999"}',
                         "[" * 20000, b"\x00\x01"):
                viewer.send(text)
            message_where(viewer, lambda m: m["t"] == "notice")
        with page(view) as viewer:
            with pytest.raises((EOFError, OSError)) as closed:
                for _ in range(40):
                    viewer.send("nonsense")
                while True:
                    viewer.receive()
            assert closed.type is not EOFError or "too many bad requests" in str(closed.value)
        with page(view) as viewer, contextlib.suppress(EOFError, OSError):
            viewer.send("x" * 200_000)
            while True:
                viewer.receive()
        message_where(other, lambda m: m["t"] == "state")
    assert view.end() == (128 + signal.SIGTERM, "")


def test_a_thousand_connections_leave_nothing_behind(make_lab, make_view):
    view = make_view(make_lab(1).socket(1))
    before = view.descriptors()
    with page(view) as viewer, contextlib.ExitStack() as stack:
        for _ in range(1000):
            stack.enter_context(socket.create_connection(("127.0.0.1", view.port), timeout=10))
        message_where(viewer, lambda m: m["t"] == "state")
        assert view.descriptors() < before + 200
    wait_for(lambda: view.descriptors() <= before, what="closed connections")
    with page(view) as viewer:
        message_where(viewer, lambda m: m["t"] == "state")
    code, errors = view.end()
    assert code == 128 + signal.SIGTERM
    assert all("close some pages" in line for line in errors.splitlines())
    assert 1 <= len(errors.splitlines()) <= 5


def test_a_browser_that_stops_reading_holds_up_nobody_and_is_told(make_lab, make_view):
    lab = make_lab(2)
    view = make_view(lab.socket(1))
    with page(view) as slow, page(view) as quick:
        for viewer in (slow, quick):
            viewer.send(json.dumps({"op": "watch", "channel": "much"}))
        message_where(quick, lambda m: m["t"] == "info" and
                      any(c["name"] == "much" for c in m["channels"]))
        flood = lab.start_cli(2, "pub", "much", "x" * 1300, "--repeat", "3000", "--rate", "400")
        heard = 0
        while heard < 1500:
            message_where(quick, lambda m: m["t"] == "msg")
            heard += 1
        flood.wait(timeout=30)
        told = message_where(slow, lambda m: m["t"] == "dropped", 20.0, "what was dropped")
        assert told["events"] > 0
        message_where(slow, lambda m: m["t"] == "state")


def test_a_port_in_use_is_told_in_one_line(make_lab, make_view):
    lab = make_lab(1)
    view = make_view(lab.socket(1))
    done = run(program("swarmtalk-view"), "--socket", lab.socket(1), "--port", view.port)
    assert done.returncode == 1
    one_line(done.stderr, str(view.port), "--port")


@pytest.mark.parametrize("options, code, word", [
    (["--socket", "/nonexistent/daemon.sock"], 3, "/nonexistent/daemon.sock"),
    (["--listen", "nowhere"], 2, "--listen"),
    (["--port", "99999"], 2, "port"),
    (["--no-such-option"], 2, "--help"),
])
def test_what_cannot_start_says_why_in_one_line(options, code, word):
    done = run(program("swarmtalk-view"), *options)
    assert done.returncode == code, done.stderr
    one_line(done.stderr, word)


def test_a_token_file_that_is_no_good_is_told_in_one_line(make_lab, tmp_path):
    lab = make_lab(1)
    short = tmp_path / "token"
    short.write_text("abc\n")
    for path in (short, tmp_path / "none"):
        done = run(program("swarmtalk-view"), "--socket", lab.socket(1), "--token-file", path)
        assert done.returncode == 1
        one_line(done.stderr, str(path))


def test_ctrl_c_ends_it_at_once(make_lab, make_view):
    view = make_view(make_lab(1).socket(1))
    with page(view):
        assert view.end(signal.SIGINT) == (128 + signal.SIGINT, "")


def test_a_daemon_that_goes_is_told_and_waited_for(make_lab, make_view):
    lab = make_lab(1)
    view = make_view(lab.socket(1))
    config = os.path.join(os.path.dirname(lab.socket(1)), "1.toml")
    with page(view) as viewer:
        message_where(viewer, lambda m: m["t"] == "state" and "no_daemon_age" not in m)
        lab.kill(1)
        message_where(viewer, lambda m: m["t"] == "state" and "no_daemon_age" in m)
    assert os.path.isdir(os.path.dirname(config))
    code, errors = view.end()
    assert code == 128 + signal.SIGTERM
    one_line(errors, "trying again")


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
        for process in (running, offering):
            stack.callback(process.wait)
            stack.callback(process.kill)
        viewer.send(json.dumps({"op": "card", "robot": 9}))
        state = state_with(viewer, *range(1, 10), timeout=40.0)
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
        card = message_where(viewer, lambda m: m["t"] == "card" and m.get("values"), 40.0,
                             "values that a program far away has set")
        assert card["values"] == {"battery": "3.91"}
        message_where(viewer, lambda m: m["t"] == "state" and all(
            robots_of(m)[number].get("name") == "scout" for number in (1, 9)), 30.0, "their names")


def test_where_robots_cannot_be_asked_the_page_says_why(make_lab, make_view):
    lab = make_lab(1)
    with page(make_view(lab.socket(1))) as viewer:
        info = message_where(viewer, lambda m: m["t"] == "info")
        assert "harvest = true under [reserved]" in info["questions"]


ELSEWHERE = """
import json
from conftest import View
from test_view import message_where, page
from websocket import Refused, WebSocket
view = View({socket!r}, "--listen", "10.231.78.1", "--token-file", {token!r})
address = {{"address": "10.231.78.1", "host": f"10.231.78.1:{{view.port}}"}}
for path in ("/", "/?token=", "/?token=wrong-one"):
    try:
        page(view, path=path, **address)
    except Refused as refused:
        print(path, refused.status)
with page(view, path="/?token=the-right-one", **address) as viewer:
    message_where(viewer, lambda m: m["t"] == "state")
    print("let in")
view.end()
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="a network namespace needs root")
def test_another_machine_needs_the_token(make_lab, tmp_path):
    """In a namespace of its own, with an address that is not this machine's loopback."""
    lab = make_lab(1)
    token = tmp_path / "token"
    token.write_text("the-right-one\n")
    code = ELSEWHERE.format(socket=lab.socket(1), token=str(token))
    done = run("unshare", "--net", "sh", "-c", "ip link set lo up && "
               "ip address add 10.231.78.1/24 dev lo && exec /usr/bin/python3 -c \"$0\"", code,
               cwd=os.path.dirname(os.path.abspath(__file__)))
    assert done.stdout.splitlines() == ["/ 403", "/?token= 403", "/?token=wrong-one 403",
                                        "let in"], done.stderr
