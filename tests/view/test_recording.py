"""swarmtalk-view of a recording: the page in a browser shows at each time what was recorded, and
Foxglove clients get the same with the recording's time."""
import json
import os
import pathlib
import struct
import subprocess
import time

import browser
import pytest
from browser import Browser
from conftest import BUILD, ROOT, View, one_line, program, run, wait_for
from websocket import WebSocket

PICTURES = os.environ.get("SWARMTALK_PICTURES")  # a folder: pictures of the page are kept there
needs_browser = pytest.mark.skipif(browser.find() is None,
                                   reason="no chromium: run tools/setup test")
TIME = 2  # opcodes of the Foxglove protocol
MESSAGE = 1


@pytest.fixture(scope="module")
def followers(tmp_path_factory):
    """A recording of two robots that circle four others, 60 virtual seconds, and its log."""
    folder = tmp_path_factory.mktemp("run")
    done = subprocess.run(
        [str(ROOT / "suite/swarmtalk-suite"), "run", "edge_following", "--platform", "sim-coachbot",
         "--robots", "6", "--seconds", "60", "--logs", str(folder), "--mcap"],
        env=os.environ | {"SWARMTALK_BUILD": str(BUILD)}, capture_output=True, text=True,
        timeout=120, check=False)
    result = json.loads(done.stdout)
    log = pathlib.Path(result["log"])
    lines = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    return pathlib.Path(result["recording"]), lines[0], lines[1:]


def places_at(scenario, events, at_s):
    """By robot from 1: where the log last says it is, in metres."""
    places = {i + 1: (r["x_mm"] / 1000, r["y_mm"] / 1000)
              for i, r in enumerate(scenario["robots"])}
    for event in events:
        if event["event"] == "pose" and event["t"] <= at_s * 1e6:
            places[event["robot"] + 1] = event["x_mm"] / 1000, event["y_mm"] / 1000
    return places


class Player(View):
    """A swarmtalk-view of a recording."""

    def __init__(self, file, *options):  # pylint: disable=super-init-not-called
        self.process = subprocess.Popen(
            [program("swarmtalk-view"), str(file), "--port", "0", *options],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline()
        assert self.address, self.process.stderr.read()
        self.port = int(self.address.split("localhost:")[1].split("/")[0])

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.end()


def state_where(viewer, condition):
    for _ in range(2000):
        message = json.loads(viewer.receive())
        if message["t"] == "state" and condition(message):
            return message
    raise AssertionError("no such state")


def see_the_places_of_each_time(view, scenario, events):
    with WebSocket(view.port, protocol="swarmtalk.view.v1") as viewer:
        viewer.send(json.dumps({"op": "pause"}))
        for at_s in (30, 59.5, 0, 12.25):
            viewer.send(json.dumps({"op": "seek", "at": at_s * 1000}))
            state = state_where(viewer, lambda m: m["play"]["at"] == at_s * 1000)
            shown = {r["id"]: (r["x"], r["y"]) for r in state["robots"]}
            expected = places_at(scenario, events, at_s)
            assert shown.keys() == expected.keys()
            for robot, place in expected.items():
                assert shown[robot] == pytest.approx(place, abs=0.0011), (at_s, robot)
        assert state["links"], "who hears whom is not shown"


def let_time_pass_as_fast_as_is_asked(view):
    with WebSocket(view.port, protocol="swarmtalk.view.v1") as viewer:
        viewer.send(json.dumps({"op": "seek", "at": 0}))
        viewer.send(json.dumps({"op": "play"}))
        state_where(viewer, lambda m: 100 < m["play"]["at"] < 10000)
        viewer.send(json.dumps({"op": "speed", "times": 50}))
        state_where(viewer, lambda m: m["play"]["at"] == 60000 and not m["play"]["playing"])
        viewer.send(json.dumps({"op": "speed", "times": 1}))
        viewer.send(json.dumps({"op": "play"}))  # from the beginning again
        state_where(viewer, lambda m: m["play"]["at"] < 50000 and m["play"]["playing"])


def let_time_stand_still_while_nobody_looks(view):
    with WebSocket(view.port, protocol="swarmtalk.view.v1") as viewer:
        viewer.send(json.dumps({"op": "speed", "times": 20}))
        state_where(viewer, lambda m: m["play"]["speed"] == 20)
        viewer.send(json.dumps({"op": "seek", "at": 0}))
        first = state_where(viewer, lambda m: m["play"]["at"] < 10000)["play"]["at"]
    start = time.monotonic()  # in which it would have come to the end
    wait_for(lambda: time.monotonic() - start > 3, what="three seconds")
    with WebSocket(view.port, protocol="swarmtalk.view.v1") as viewer:
        again = state_where(viewer, lambda m: True)["play"]["at"]
    assert first <= again < 60000


def get_its_time_as_a_foxglove_client(view):
    with WebSocket(view.port, protocol="foxglove.websocket.v1") as client:
        assert json.loads(client.receive())["capabilities"] == ["time"]
        channels = json.loads(client.receive())["channels"]
        tf, = [c["id"] for c in channels if c["topic"] == "/tf"]
        client.send(json.dumps({"op": "subscribe",
                                "subscriptions": [{"id": 5, "channelId": tf}]}))
        times, stamps = [], []
        while len(stamps) < 10:
            message = client.receive()
            if not isinstance(message, bytes):
                continue
            if message[0] == TIME:
                times.append(struct.unpack("<Q", message[1:9])[0])
            elif message[0] == MESSAGE:
                number, stamp = struct.unpack("<IQ", message[1:13])
                assert number == 5
                stamps.append(stamp)
    assert times == sorted(times) and stamps == sorted(stamps)
    assert 0 <= stamps[0] < stamps[-1] < 60e9  # of the run, which began at 0
    assert set(stamps) & set(times)


def be_told_that_a_file_is_cut(file, tmp_path):
    whole = file.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[:len(whole) * 2 // 3])
    with Player(cut) as view:
        with WebSocket(view.port, protocol="swarmtalk.view.v1") as viewer:
            hello = json.loads(viewer.receive())
            assert "cut off" in hello["recording"]["problem"]
            assert 10_000 < hello["recording"]["length"] < 59_000
            state_where(viewer, lambda m: len(m["robots"]) == 6)
        one_line(view.end()[1], "cut.mcap", "cut off", "whole chunks could be read")


def test_a_recording_is_played_as_it_is_asked(followers, tmp_path):
    file, scenario, events = followers
    with Player(file) as view:
        get_its_time_as_a_foxglove_client(view)
        see_the_places_of_each_time(view, scenario, events)
        let_time_pass_as_fast_as_is_asked(view)
        let_time_stand_still_while_nobody_looks(view)
    be_told_that_a_file_is_cut(file, tmp_path)


@pytest.mark.logic
def test_a_file_that_is_no_recording_is_told_in_one_line(followers, tmp_path):
    file, _, _ = followers
    broken = tmp_path / "broken.mcap"
    for bytes_, words in ((b"", ("too short",)), (b"x" * 100, ("not an MCAP file",)),
                          (file.read_bytes()[:200], ("no records",))):
        broken.write_bytes(bytes_)
        done = run(program("swarmtalk-view"), broken, "--port", "0")
        assert done.returncode == 1
        one_line(done.stderr, "broken.mcap", *words)
    done = run(program("swarmtalk-view"), file, "--socket", "/nowhere")
    assert done.returncode == 2
    one_line(done.stderr, "--socket", "leave one of them out")


def press_keys_fast(page):
    """States of before the first of them come between."""
    page.wait_for("window.swarmtalk && swarmtalk.shown() && swarmtalk.shown().robots.length")

    def press(name, times):
        page.ask("""((name, times) => { const old = state;
            for (let i = 0; i < times; ++i) {
                document.dispatchEvent(new KeyboardEvent('keydown', {key: name}));
                take(JSON.parse(JSON.stringify(old)));
            } })(%s, %d)""" % (json.dumps(name), times))

    press(" ", 3)
    page.wait_for("!swarmtalk.shown().play.playing")
    press("Home", 1)
    page.wait_for("swarmtalk.shown().play.at === 0")
    press("ArrowRight", 5)
    page.wait_for("swarmtalk.shown().play.at === 25000")
    press("ArrowLeft", 2)
    page.wait_for("swarmtalk.shown().play.at === 15000")
    press(">", 3)
    page.wait_for("swarmtalk.shown().play.speed === 10")
    press("ArrowRight", 15)
    page.wait_for("swarmtalk.shown().play.at === 60000")


def look_at_messages_after_a_jump(page):
    page.wait_for("window.swarmtalk && swarmtalk.shown() && info")
    page.ask("document.querySelector('[data-pane=channels]').click()")
    page.ask("ask({op: 'pause'}); ask({op: 'seek', at: 30000})")
    page.wait_for("swarmtalk.shown().play.at === 30000 && info.channels.length")
    page.ask("document.querySelector('#channel-list tbody tr').click()")
    page.wait_for("document.querySelectorAll('#messages div').length > 0")
    page.ask("seek(recording.length)")
    page.wait_for("swarmtalk.shown().play.at === 60000")
    page.wait_for("document.querySelectorAll('#messages div').length > 1")
    page.ask("seek(0)")
    page.wait_for("swarmtalk.shown().play.at === 0")
    page.wait_for("document.querySelectorAll('#messages div').length < 2")
    told = page.ask("(info = {...info, channels: []}, drawChannels(), "
                    "document.getElementById('channel-list').textContent)")
    assert told == "No channel was heard up to this time."


def not_take_for_silence_what_a_jump_has_not_read(page):
    page.wait_for("window.swarmtalk && swarmtalk.shown() && info")
    page.ask("ask({op: 'pause'})")
    page.wait_for("!state.play.playing")
    assert page.ask("state.play.since") == 0
    page.ask("socket.onmessage = null")
    for since, told in ((0, " up to this time."),
                        (180000, " from 3:00.0 to this time. What was before is not read after "
                         "a jump: go there to see it.")):
        page.ask(f"state.play.since = {since}; take({{t: 'jump', at: 0, trail: []}});"
                 "take({t: 'msgs', list: []}); info = {...info, channels: []}; drawChannels()")
        for box, what in (("messages", "Nothing was heard on it"),
                          ("log-lines", "There is no line"),
                          ("channel-list", "No channel was heard")):
            assert page.ask(f"document.getElementById('{box}').textContent") == what + told
    page.ask("watched = 7; take({t: 'msg', n: 7, from: 1, hops: 0, hex: '61'});"
             "take({t: 'log', from: 1, text: 'a line', age: 0})")
    for box in ("messages", "log-lines"):
        text = page.ask(f"document.getElementById('{box}').textContent")
        assert "a" in text and "is not read" not in text


def play_pause_and_jump(page, scenario, events):
    def key(name, **more):
        page.ask(f"document.dispatchEvent(new KeyboardEvent('keydown', "
                 f"{json.dumps({'key': name, 'bubbles': True} | more)}))")

    def at():
        return page.ask("swarmtalk.shown().play.at")

    page.wait_for("window.swarmtalk && swarmtalk.shown() && swarmtalk.shown().robots.length"
                  " === 6 && swarmtalk.shown().play.at > 300")
    key(" ")
    page.wait_for("!swarmtalk.shown().play.playing")
    # A click at the middle of the timeline.
    box = page.ask("(() => { const b = document.getElementById('back').getBoundingClientRect();"
                   " return [b.left, b.top, b.width, b.height]; })()")
    for kind in ("mousePressed", "mouseReleased"):
        page.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1,
                  x=box[0] + box[2] / 2, y=box[1] + box[3] / 2)
    page.wait_for("Math.abs(swarmtalk.shown().play.at - 30000) < 1500")
    key("Home")
    page.wait_for("swarmtalk.shown().play.at === 0")
    key("ArrowRight")
    page.wait_for("swarmtalk.shown().play.at === 5000")
    key("ArrowRight", shiftKey=True)
    page.wait_for("swarmtalk.shown().play.at === 6000")
    assert page.ask("document.getElementById('when').textContent") == "0:06.0 / 1:00.0"
    expected = places_at(scenario, events, at() / 1000)
    shown = page.ask("swarmtalk.shown().robots.map(r => [r.id, r.x, r.y])")
    for robot, x, y in shown:
        assert (x, y) == pytest.approx(expected[robot], abs=0.0011)
    key(">")
    page.wait_for("swarmtalk.shown().play.speed === 2")
    key("ArrowRight")
    key("ArrowRight")
    page.ask("swarmtalk.select(5)")
    page.ask("document.querySelector('[data-pane=channels]').click()")
    key(" ")
    page.wait_for("swarmtalk.shown().play.at > 17000")
    page.wait_for("document.getElementById('channel-list').textContent.includes('channel')")
    key(" ")
    if PICTURES:
        page.picture(pathlib.Path(PICTURES) / "recording.png")
    key("End")
    page.wait_for("swarmtalk.shown().play.at === 60000")


@needs_browser
def test_a_browser_plays_a_recording(followers):
    file, scenario, events = followers
    with Player(file) as view, Browser(f"http://localhost:{view.port}/", 1280, 760) as page:
        play_pause_and_jump(page, scenario, events)
        for step in (press_keys_fast, look_at_messages_after_a_jump,
                     not_take_for_silence_what_a_jump_has_not_read):
            with Player(file) as another:
                page.go(f"http://localhost:{another.port}/")
                step(page)
