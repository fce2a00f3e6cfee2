"""swarmtalk-view as a server: whom it lets in, and how it bears what goes wrong."""
import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import time

import pytest
from conftest import one_line, program, run, serving, wait_for
from viewers import PAGE, beacons, channels_of, message_where, page, watch
from websocket import Refused, WebSocket, get

MOST_PLACES = 128
TOO_LONG = 1009, "a message may have 65536 bytes at most"  # RFC 6455, 7.4.1: too big to process


def let_in_pages_of_its_own_or_that_are_allowed(lab, view):
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
    with serving(lab, "--allow-origin", "http://lab:8081") as allowing, \
            page(allowing, origin="http://lab:8081") as viewer:
        message_where(viewer, lambda m: m["t"] == "state")


def listen_on_this_machine_alone(lab, view):
    listening = run("cat", "/proc/net/tcp", "/proc/net/tcp6").stdout
    ours = [line.split()[1] for line in listening.splitlines()
            if line.split()[1].endswith(f":{view.port:04X}") and line.split()[3] == "0A"]
    assert ours == [f"0100007F:{view.port:04X}"]
    with serving(lab, "--listen", "0.0.0.0") as everywhere:
        assert "/?token=" in everywhere.address


def refuse_another_subprotocol(view):
    with pytest.raises(Refused) as refused:
        WebSocket(view.port, protocol="mqtt")
    assert refused.value.status == 400 and PAGE in refused.value.text


def answer_garbage(lab):
    with serving(lab) as view:
        for garbage in (b"\x00\xff" * 3000, b"GET / HTTP/9.9\r\n\r\n",
                        b"POST / HTTP/1.1\r\nHost: x\r\n\r\n",
                        b"GET / HTTP/1.1\r\n" + b"x: y\r\n" * 5000):
            with socket.create_connection(("127.0.0.1", view.port), timeout=60) as connection:
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
            message_where(other, lambda m: m["t"] == "state")
        assert view.end() == (128 + signal.SIGTERM, "")


def bear_a_thousand_connections(lab):
    with serving(lab) as view:
        before = view.descriptors()
        with page(view) as viewer, contextlib.ExitStack() as stack:
            for _ in range(1000):
                stack.enter_context(socket.create_connection(("127.0.0.1", view.port), timeout=60))
            message_where(viewer, lambda m: m["t"] == "state")
            assert view.descriptors() < before + 200
        wait_for(lambda: view.descriptors() <= before, what="closed connections")
        with page(view) as viewer:
            message_where(viewer, lambda m: m["t"] == "state")
        code, errors = view.end()
        assert code == 128 + signal.SIGTERM
        assert all("close some pages" in line for line in errors.splitlines())
        assert 1 <= len(errors.splitlines()) <= 5
        assert "1 was turned away so far" in errors.splitlines()[0]


def take_messages(viewer, number, lives):
    """Reads messages of a channel. The page `lives` sends meanwhile: who says nothing for 30 s is
    taken for gone."""
    deadline = time.monotonic() + 120
    said = 0.0
    while number > 0:
        assert time.monotonic() < deadline, f"timed out waiting for {number} messages"
        if time.monotonic() > said + 2:
            said = time.monotonic()
            lives.send(json.dumps({"op": "card", "robot": 0}))
        number -= json.loads(viewer.receive())["t"] == "msg"


@pytest.mark.field
def test_a_browser_that_stops_reading_holds_up_nobody_and_is_told(make_lab, make_view):
    lab = make_lab(2)
    view = make_view(lab.socket(1))
    with page(view) as slow, page(view) as quick:
        for viewer in (slow, quick):
            viewer.send(json.dumps({"op": "watch", "channel": "much"}))
        message_where(quick, lambda m: m["t"] == "info" and
                      any(c["name"] == "much" for c in m["channels"]))
        flood = lab.start_cli(2, "pub", "much", "x" * 1300, "--repeat", "0", "--rate", "400")
        try:
            take_messages(quick, 3000, lives=slow)  # more than is kept for a page
        finally:
            flood.kill()
            flood.wait()
        told = message_where(slow, lambda m: m["t"] == "dropped", 60.0, "what was dropped")
        assert told["events"] > 0
        message_where(slow, lambda m: m["t"] == "state")


def tell_that_its_port_is_in_use(lab, view):
    done = run(program("swarmtalk-view"), "--socket", lab.socket(1), "--port", view.port)
    assert done.returncode == 1
    one_line(done.stderr, str(view.port), "--port")


@pytest.mark.logic
@pytest.mark.parametrize("options, code, word", [
    (["--socket", "/nonexistent/daemon.sock"], 3, "/nonexistent/daemon.sock"),
    (["--listen", "nowhere"], 2, "--listen"),
    (["--port", "99999"], 2, "port"),
    (["--port", "-1"], 2, "0 to 65535"),
    (["--channel", "70000"], 2, "70000"),
    (["--channel", ""], 2, "channel"),
    ([""], 2, "FILE: must not be empty"),
    (["--socket", ""], 2, "--socket: must not be empty"),
    (["--token-file", ""], 2, "--token-file: must not be empty"),
    (["--listen", ""], 2, "--listen: must not be empty"),
    (["--allow-origin", "nonsense"], 2, "nonsense"),
    (["--allow-origin", "http://lab:8081/"], 2, "without a path"),
    (["--allow-origin", "*"], 2, "http://lab:8081"),
    (["--no-such-option"], 2, "; see swarmtalk-view --help"),
    (["--sokcet", "x"], 2, "no option '--sokcet'; did you mean '--socket'? See swarmtalk-view"),
])
def test_what_cannot_start_says_why_in_one_line(options, code, word):
    done = run(program("swarmtalk-view"), *options)
    assert done.returncode == code, done.stderr
    one_line(done.stderr, word)


def tell_that_its_token_file_is_no_good(lab, tmp_path):
    short = tmp_path / "token"
    short.write_text("abc\n")
    for path in (short, tmp_path / "none"):
        done = run(program("swarmtalk-view"), "--socket", lab.socket(1), "--token-file", path)
        assert done.returncode == 1
        one_line(done.stderr, str(path))


def end_at_once_with_ctrl_c(lab):
    with serving(lab) as view:
        with page(view):
            assert view.end(signal.SIGINT) == (128 + signal.SIGINT, "")


def tell_an_address_that_cannot_be_written(lab):
    with open("/dev/full", "w", encoding="utf-8") as full:
        process = subprocess.Popen(
            [program("swarmtalk-view"), "--socket", lab.socket(1), "--port", "0"],
            stdin=subprocess.DEVNULL, stdout=full, stderr=subprocess.PIPE, text=True)
    try:
        line = process.stderr.readline()
        assert "http://localhost:" in line and "No space left on device" in line, line
    finally:
        process.terminate()
        process.communicate(timeout=60)


ELSEWHERE = """
import json
from conftest import View
from viewers import message_where, page
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


def need_the_token_from_another_machine(lab, tmp_path):
    """In a namespace of its own, with an address that is not this machine's loopback."""
    token = tmp_path / "token"
    token.write_text("the-right-one\n")
    code = ELSEWHERE.format(socket=lab.socket(1), token=str(token))
    done = run("unshare", "--net", "sh", "-c", "ip link set lo up && "
               "ip address add 10.231.78.1/24 dev lo && exec /usr/bin/python3 -c \"$0\"", code,
               cwd=os.path.dirname(os.path.abspath(__file__)))
    assert done.stdout.splitlines() == ["/ 403", "/?token= 403", "/?token=wrong-one 403",
                                        "let in"], done.stderr


def ask_for_names_with_control_characters(lab):
    with serving(lab) as view:
        with contextlib.ExitStack() as stack:
            for number in range(6):
                viewer = stack.enter_context(page(view))
                watch(viewer, f"\x1b[31mred{number}\nFAKE " + 300 * "x")
            message_where(viewer, lambda m: m["t"] == "notice")
        errors = view.end()[1]
        assert "FAKE" in errors and "\x1b" not in errors, errors
        assert all(line.startswith("swarmtalk-view: ") and len(line) < 400
                   for line in errors.splitlines()), errors


def be_told_of_channels_beyond_the_limit(lab):
    names = ["one", "two", "three"]
    subs = [lab.start_cli(1, "sub", name) for name in names]
    try:
        wait_for(lambda: set(names) <= channels_of(lab, 1), what="programs")
        with serving(lab) as view, page(view) as viewer, \
                WebSocket(view.port, protocol="foxglove.sdk.v1") as other:
            info = message_where(viewer, lambda m: m["t"] == "info" and m.get("left_out"))
            (name, why), = info["left_out"].items()
            assert name in names and "channels_per_client" in why, info["left_out"]
            status = message_where(other, lambda m: m["op"] == "status")
            assert name in status["message"] and "channels_per_client" in status["message"]
            watch(viewer, name)  # who looks comes first
            info = message_where(viewer, lambda m: m["t"] == "info" and
                                 m.get("left_out") and name not in m["left_out"])
            assert set(info["left_out"]) <= set(names)
            code, errors = view.end()
        assert code == 128 + signal.SIGTERM
        assert len(errors.splitlines()) == 2, errors
        one_line(errors.splitlines()[0], name, "left out", "channels_per_client")
    finally:
        for sub in subs:
            sub.kill()
            sub.wait()


def be_told_why_robots_cannot_be_asked(lab):
    with serving(lab) as view, page(view) as viewer:
        info = message_where(viewer, lambda m: m["t"] == "info")
        assert "harvest = true under [reserved]" in info["questions"]


def find_a_place_among_requests_that_never_end(view):
    held = []
    try:
        for number in range(2 * MOST_PLACES):
            held.append(socket.create_connection(("127.0.0.1", view.port), timeout=60))
            if number % 2:
                held[-1].sendall(b"GET / HTTP/1.1\r\nHost: loc")
        with page(view) as viewer:
            message_where(viewer, lambda m: m["t"] == "state")
            for _ in range(2 * MOST_PLACES):  # and keeps it
                held.append(socket.create_connection(("127.0.0.1", view.port), timeout=60))
            message_where(viewer, lambda m: m["t"] == "state")
    finally:
        for each in held:
            each.close()


def be_told_that_there_is_no_place(lab):
    sentence = f"{MOST_PLACES} viewers look already, the most there may be: close some pages"
    with serving(lab) as view:
        before = view.descriptors()
        with contextlib.ExitStack() as stack:
            viewers = [stack.enter_context(page(view)) for _ in range(MOST_PLACES)]
            for viewer in viewers:
                message_where(viewer, lambda m: m["t"] == "hello")
            for _ in range(20):  # more than may wait
                status, head, body = get(view.port)
                assert status == 503 and body.decode() == sentence + "\n"
                with page(view) as one_more:
                    assert close_of(one_more) == (1013, sentence)
            message_where(viewers[0], lambda m: m["t"] == "state")
            viewers.pop().connection.close()
            wait_for(lambda: get(view.port)[0] == 200, what="a place")
            with page(view) as one_more:
                message_where(one_more, lambda m: m["t"] == "state")
        wait_for(lambda: view.descriptors() <= before, what="closed connections")
        errors = view.end()[1]
        sentence = "128 viewers look, the most there may be; 1 was turned away"
        assert sentence in errors.splitlines()[0]


def close_of(viewer):
    """Code and reason with which a viewer is closed."""
    kind, body = viewer.frame()
    while kind != 8:
        kind, body = viewer.frame()
    return struct.unpack(">H", body[:2])[0], body[2:].decode()


def be_told_of_a_message_that_is_too_long(lab):
    for size in (65_537, 70_000, 5_000_000):
        with serving(lab) as view:
            with page(view) as viewer:
                viewer.send(" " * 65_536)  # the longest, and no request
                message_where(viewer, lambda m: m["t"] == "notice")
                viewer.send("x" * size)
                assert close_of(viewer) == TOO_LONG, size
            _, errors = view.end()
        one_line(errors, "swarmtalk-view:", "more than 65536 bytes", "1 so far")
    with serving(lab) as view:
        for size in (65_537, 2**31, 2**62):  # what is announced is not waited for
            with page(view) as viewer:
                viewer.connection.sendall(struct.pack(">BBQ4s", 0x81, 0xFF, size, b"mask")
                                          + b"x" * 9)
                assert close_of(viewer) == TOO_LONG, size


def test_a_server_lets_in_whom_it_should_and_bears_what_goes_wrong(make_lab, make_view, tmp_path):
    lab = make_lab(1, *beacons(tmp_path, "[limits]\nchannels_per_client = 4\n"))
    view = make_view(lab.socket(1))
    let_in_pages_of_its_own_or_that_are_allowed(lab, view)
    listen_on_this_machine_alone(lab, view)
    refuse_another_subprotocol(view)
    tell_that_its_port_is_in_use(lab, view)
    view.end()
    answer_garbage(lab)
    bear_a_thousand_connections(lab)
    be_told_that_there_is_no_place(lab)
    with serving(lab) as another:
        find_a_place_among_requests_that_never_end(another)
    be_told_of_a_message_that_is_too_long(lab)
    tell_that_its_token_file_is_no_good(lab, tmp_path)
    end_at_once_with_ctrl_c(lab)
    tell_an_address_that_cannot_be_written(lab)
    ask_for_names_with_control_characters(lab)
    be_told_of_channels_beyond_the_limit(lab)
    be_told_why_robots_cannot_be_asked(lab)
    if os.geteuid() != 0:
        pytest.skip("passed but for its last step: a network namespace needs root")
    need_the_token_from_another_machine(lab, tmp_path)
