"""The page with nothing but a browser: what it says of states that are written here.

A WebSocket that this file makes hands the page what swarmtalk-view would send. The browser runs
once: it asks the page everything, prints it and ends.
"""
import html
import json
import re
import subprocess

import browser
import pytest
from conftest import ROOT

pytestmark = [pytest.mark.logic, pytest.mark.skipif(browser.find() is None,
                                                    reason="no chromium: run tools/setup test")]

# Three others: near and heard; told of by others alone; gone. Robot 1 loses 25 % of what robot 2
# sends, and robot 2 half of what robot 1 sends; nobody reports robot 3's loss at robot 1.
STATE = {"t": "state", "self": 1, "robots": [
    {"id": 1, "self": True, "name": "base", "x": 0.0, "y": 0.0, "th": 0.0},
    {"id": 2, "x": 1.0, "y": 0.25, "th": 1.5708, "heard_age": 200, "told_age": 900},
    {"id": 3, "x": 0.0, "y": 1.0, "th": 0.0, "told_age": 12000},
    {"id": 4, "heard_age": 61000}],
    "links": [[1, 2, 0.5, 100], [2, 1, 0.25, 100], [1, 3, 0.75, 100]]}
LOST = {"air": 3, "kernel": 0, "daemon": 1, "client": 0}
NOTHING_LOST = dict.fromkeys(LOST, 0)
INFO = {"t": "info",
        "links": [{"name": "air", "up": True},
                  {"name": "eth", "up": False, "state": "cable is out"}],
        "left_out": {"song": "view reads 64 channels"},
        "channels": [
            {"n": 7, "name": "alarm", "publishers": 0, "subscribers": 1, "rate": 2.04, "age": 2500,
             "messages": 90, "senders": [[2, 90], [3, 1]], "lost": LOST},
            {"n": 9, "publishers": 1, "subscribers": 1, "rate": 0, "messages": 0, "senders": [],
             "lost": NOTHING_LOST},
            {"n": 11, "name": "far", "publishers": 0, "subscribers": 0, "rate": 0, "messages": 1,
             "age": 100, "publishing": 2, "senders": []}]}
CARD = {"t": "card", "id": 2, "known": True, "x": 1.0, "y": 0.25, "th": 1.5708, "pose_age": 4400,
        "heard_age": 1500, "told_age": 300, "distance": 1.031, "bearing": -0.7854, "frames": 120,
        "frames_lost": 40, "lost": LOST, "channels": [[7, True, True, 2], [9, False, True, 1]],
        "programs": []}
MESSAGES = [
    {"t": "msg", "n": 7, "from": 2, "d": 1.25, "hex": b"fire \xc3\xbc".hex()},
    {"t": "msg", "n": 7, "from": 3, "hops": 2, "hex": "0001ff", "lost": 4},
    {"t": "msg", "n": 9, "from": 3, "hex": b"on another channel".hex()},
    {"t": "msg", "n": 7, "from": 1, "local": True, "hex": b"mine".hex()}]

SOCKET = """<script>
window.WebSocket = class {
  constructor() { window.daemon = this; this.sent = []; }
  send(text) { this.sent.push(JSON.parse(text)); }
};
</script>"""
ASK = """<script>
window.WebSocket = undefined;  // nothing connects again
const from = message => daemon.onmessage({data: JSON.stringify(message)});
const cells = id => [...document.querySelectorAll("#" + id + " tbody tr")].map(
  row => [...row.querySelectorAll("td")].map(cell => cell.textContent));
const found = {};
daemon.onopen();
from({t: "hello", operate: false});
from(STATE_HERE);
from(INFO_HERE);
drawRobots();
found.robots = cells("robots");
found.gone = [1, 2, 3, 4].filter(id => swarmtalk.isGreyed(id));
found.placeless = document.getElementById("lost").textContent;
found.state = document.querySelector("#state span").textContent;
found.channels = cells("channel-list");
found.leftOut = [...document.querySelectorAll(".left-out")].map(each => each.textContent);
found.titles = [...document.querySelectorAll("#channel-list tbody tr")].map(each => each.title);
swarmtalk.select(2);
from(CARD_HERE);
found.card = Object.fromEntries([...document.querySelectorAll("#card dt")].map(
  name => [name.textContent, name.nextElementSibling.textContent]));
document.querySelector("#channel-list tbody tr").click();
MESSAGES_HERE.forEach(from);
found.messages = [...document.querySelectorAll("#messages > div")].map(each => each.textContent);
found.asked = daemon.sent;
found.places = [1, 2, 3, 4].map(id => swarmtalk.onMap(id));
found.seconds = [undefined, 999, 1000, 9999, 10000, 99999, 100000, 150000].map(seconds);
found.percent = [undefined, 0, 0.004, 0.0999, 0.1, 1].map(percent);
found.clock = [0, 99, 59999, 60000, 3599900, 3661000].map(clock);
document.getElementById("search").value = "4";
drawRobots();
found.searched = cells("robots").map(row => row[0]);
// A state a moment later, then ten seconds back, then live again.
from({...STATE_HERE, robots: STATE_HERE.robots.slice(0, 2)});
past[0].at -= 10000;
back = -5;
found.before = swarmtalk.shown().robots.length;
back = 0;
found.live = swarmtalk.shown().robots.length;
const told = document.createElement("pre");
told.id = "found";
told.textContent = JSON.stringify(found);
document.body.append(told);
</script>"""


@pytest.fixture(scope="module", name="found")
def ask_the_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    ask = ASK
    for name, value in (("STATE", STATE), ("INFO", INFO), ("CARD", CARD), ("MESSAGES", MESSAGES)):
        ask = ask.replace(name + "_HERE", json.dumps(value))
    page = (ROOT / "view/page/index.html").read_text("utf-8")
    assert page.count("<script>") == 1 and page.count("</body>") == 1
    page = page.replace("<script>", SOCKET + "<script>").replace("</body>", ask + "</body>")
    (folder / "page.html").write_text(page, "utf-8")
    done = subprocess.run(
        [browser.find(), "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run",
         "--disable-background-networking", "--disable-dev-shm-usage",
         f"--user-data-dir={folder / 'profile'}", "--dump-dom", f"file://{folder}/page.html"],
        capture_output=True, text=True, timeout=120, check=True, stdin=subprocess.DEVNULL)
    told = re.search('<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert told, f"the page did not come to its end:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return json.loads(html.unescape(told[1]))


def test_the_table_of_robots_has_what_this_robot_loses_of_each(found):
    assert found["robots"] == [["1 base  this one", "0.00, 0.00", "", ""],
                               ["2", "1.00, 0.25", "now", "25 %"],
                               ["3", "0.00, 1.00", "told 12 s", "unknown"],
                               ["4", "unknown", "61 s", "unknown"]]
    assert found["gone"] == [4]
    assert found["placeless"] == "place unknown: 4"
    assert found["searched"] == ["4"]


def test_the_head_line_counts_the_others_and_names_what_is_down(found):
    assert found["state"].startswith("robot 1 · 1 of 3 others heard, 1 told of")
    assert "eth: cable is out" in found["state"] and "air" not in found["state"]


def test_the_table_of_channels_tells_silence_from_what_is_not_listened_to(found):
    assert found["channels"] == [["alarm", "2.0", "2", "4", "2.5 s"],
                                 ["channel 9", "0", "0", "0", "never"],
                                 ["far", "?", "2", "?", "no listener"]]
    assert found["leftOut"] == ["Channel song is not heard: view reads 64 channels."]
    assert found["titles"][0] == ("number 7; 90 messages; lost on the air 3, in the kernel 0, "
                                  "in the daemon 1; from robots 2 3")
    assert "2 robots say to publish" in found["titles"][2]


def test_the_card_has_units_and_the_direction_of_each_figure(found):
    card = found["card"]
    assert card["place"] == "1.000, 0.250 m, heading 90°"
    assert card["age of the place"] == "4.4 s"
    assert (card["heard"], card["told of"]) == ("1.5 s ago", "now")
    assert (card["distance"], card["bearing"]) == ("1.03 m", "-45°")
    assert card["frames"] == "120 heard, 40 lost"
    assert card["lost"] == "3 on the air, 0 in the kernel, 1 in the daemon"
    assert card["channels"] == "alarm publishes, hears 2/s; channel 9 hears 1/s"
    assert (card["programs"], card["address"], card["values"]) == ("none", "unknown", "unknown")


def test_messages_of_the_channel_that_is_watched_are_shown_with_their_way(found):
    assert found["messages"] == ["2 1.25 m  fire ü", "3 +2  0001ff  (3 bytes)   4 lost before",
                                 "1 here  mine"]
    assert found["asked"] == [{"op": "card", "robot": 2}, {"op": "watch", "channel": 7}]


def test_on_the_map_x_goes_right_and_y_goes_up(found):
    one, two, three, four = found["places"]
    assert two[0] > one[0] and three[0] == one[0]
    assert three[1] < two[1] < one[1] and four is None


def test_numbers_are_as_a_person_reads_them(found):
    assert found["seconds"] == ["unknown", "now", "1.0 s", "10.0 s", "10 s", "100 s", "2 min",
                                "3 min"]
    assert found["percent"] == ["unknown", "0.0 %", "0.4 %", "10.0 %", "10 %", "100 %"]
    assert found["clock"] == ["0:00.0", "0:00.0", "0:59.9", "1:00.0", "59:59.9", "1:01:01.0"]


def test_what_was_a_while_ago_is_shown_as_it_was(found):
    assert (found["before"], found["live"]) == (4, 2)
