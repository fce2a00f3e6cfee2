"""The page with nothing but a browser: what it says of states that are written here.

A WebSocket that this file makes hands the page what swarmtalk-view would send. The browser runs
once: it asks the page everything, prints it and ends.
"""
import html
import json
import math
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
            {"n": 3, "name": "harvest", "publishers": 1, "subscribers": 1, "rate": 0, "messages": 0,
             "senders": [], "lost": NOTHING_LOST},
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
# For the map. Robot 2 has turned to the left and moved since; robot 3 is told of by others alone;
# robot 4 is gone, and so are its links.
MAP = {"t": "state", "self": 1, "robots": [
    {"id": 1, "self": True, "name": "base", "x": 0.0, "y": 0.0, "th": 0.0},
    {"id": 2, "x": 1.0, "y": 0.5, "th": math.pi / 2, "heard_age": 200},
    {"id": 3, "x": 0.0, "y": 1.0, "th": math.pi, "told_age": 12000},
    {"id": 4, "x": 1.0, "y": 1.0, "th": 0.0, "heard_age": 61000}],
    "links": [[1, 3, 0.75, 100], [1, 2, 0.5, 100], [2, 1, 0.25, 100], [3, 2, 0.0, 100],
              [2, 4, 0.1, 100], [4, 2, 0.1, 100]]}
MESSAGES = [
    {"t": "msg", "n": 7, "from": 2, "d": 1.25, "hex": b"fire \xc3\xbc".hex()},
    {"t": "msg", "n": 7, "from": 3, "hops": 2, "via": 5, "d": 0.59, "hex": "0001ff", "lost": 4},
    {"t": "msg", "n": 7, "from": 4, "hops": 1, "hex": b"far".hex()},
    {"t": "msg", "n": 9, "from": 3, "hex": b"on another channel".hex()},
    {"t": "msg", "n": 7, "from": 1, "local": True, "hex": b"mine".hex()}]

SOCKET = """<script>
window.WebSocket = class {
  constructor() { window.daemon = this; this.sent = []; }
  send(text) { this.sent.push(JSON.parse(text)); }
  close() { this.isClosed = true; }
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
found.asked = [...daemon.sent];
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
// What is drawn on the map: each line and body with its path, each text with its place.
const drawn = [];
let path = [];
const look = (name, note) => {
  const real = pen[name];
  pen[name] = (...values) => { note(...values); return real.apply(pen, values); };
};
const put = (kind, style, more) => drawn.push(
  {kind, style, path, dash: pen.getLineDash(), width: pen.lineWidth, alpha: pen.globalAlpha,
   ...more});
look("beginPath", () => { path = []; });
look("moveTo", (x, y) => path.push([x, y]));
look("lineTo", (x, y) => path.push([x, y]));
look("arc", (x, y, radius) => path.push([x, y, radius]));
look("stroke", () => put("line", pen.strokeStyle));
look("fill", () => put("body", pen.fillStyle));
look("fillText", (text, x, y) => put("text", pen.fillStyle, {text, x, y}));
const paint = () => { drawn.length = 0; draw(); return [...drawn]; };
document.getElementById("search").value = "";
past.length = 0;
const now = performance.now();
const earlier = {...MAP_HERE, robots: MAP_HERE.robots.map(r => r.id === 2 ? {...r, y: 0.25} : r)};
keep(now - TRAIL_MS - 100, {...earlier, robots: earlier.robots.map(r => ({...r, y: r.y - 1}))});
keep(now - 5000, earlier);
keep(now - 1000, MAP_HERE);
state = {...MAP_HERE, byId: new Map(MAP_HERE.robots.map(r => [r.id, r]))};
swarmtalk.select(0);
paint();  // the camera has found the robots
found.map = paint();
found.spots = [1, 2, 3, 4].map(id => swarmtalk.onMap(id));
found.scale = camera.scale;
found.colours = Object.fromEntries(["self", "accent", "gone", "paper", "line"].map(name => {
  pen.fillStyle = colour(name);
  return [name, pen.fillStyle];
}));
swarmtalk.select(3);
found.selected = paint();
swarmtalk.select(0);
document.getElementById("links").click();
document.getElementById("trails").click();
found.bare = paint();
const box = canvas.getBoundingClientRect();
const spot = [box.width / 3, box.height / 4];
const before = toWorld(box, ...spot);
zoom(1.5, ...spot);
found.zoomed = {kept: toWorld(box, ...spot).map((each, i) => each - before[i]),
                back: toScreen(box, ...toWorld(box, ...spot)).map((each, i) => each - spot[i]),
                scale: camera.scale / found.scale};
// The map stands still while robots move inside it, and follows one that leaves it.
$("fit").onclick();
const after = (x, y) => {
  state = {...MAP_HERE, robots: MAP_HERE.robots.map(r => r.id === 2 ? {...r, x, y} : r)};
  state.byId = new Map(state.robots.map(r => [r.id, r]));
  for (let i = 0; i < 100; ++i) paint();
  return [camera.x, camera.y, camera.scale];
};
found.moved = [[1, .5], [.6, .4], [.2, .9], [6, .5], [1, .5]].map(place => after(...place));
found.inside = [after(9, .5), toScreen(box, 9, .5), [box.width, box.height]];
// One scale: the legend has the colours of lines.
found.ramp = $("ramp").style.background.match(/rgba?\\([^)]*\\)/g);
found.scaleColours = [0, .125, .25, .375, .5].map(loss => {
  $("ramp").style.background = lossColour(loss);
  return $("ramp").style.backgroundColor;
});
// Lines that came while the log was hidden; then a reader who has scrolled up.
for (let k = 0; k < 300; ++k) from({t: "log", k, from: 2, text: "line " + k, age: 0});
document.querySelector("nav [data-pane=log]").click();
const lines = $("log-lines");
const fromEnd = () => lines.scrollHeight - lines.scrollTop - lines.clientHeight;
found.fromEnd = [fromEnd()];
lines.scrollTop = 40;
lines.onscroll();
from({t: "log", k: 300, from: 2, text: "one more", age: 0});
found.fromEnd.push(fromEnd() > 100, lines.scrollTop);
lines.scrollTop = lines.scrollHeight;
lines.onscroll();
from({t: "log", k: 301, from: 2, text: "the last", age: 0});
found.fromEnd.push(fromEnd());
// Signs are told when asked for, and a daemon that went away is told over the map.
const isSeen = id => $(id).getBoundingClientRect().height > 0;
found.signs = [isSeen("signs-told")];
$("signs").click();
found.signs.push(isSeen("signs-told"), isSeen("banner"));
state = {...MAP_HERE, no_daemon_age: 7000};
drawState();
found.banner = [isSeen("banner"), $("banner").textContent];
found.greyed = MAP_HERE.robots.map(isGone);
delete state.no_daemon_age;
const since = performance.now() + 5001;
performance.now = () => since;
listen();
found.silent = {isClosed: daemon.isClosed, says: document.querySelector("#state span").textContent};
const told = document.createElement("pre");
told.id = "found";
told.textContent = JSON.stringify(found);
document.body.append(told);
</script>"""


@pytest.fixture(scope="module", name="found")
def ask_the_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    ask = ASK
    for name, value in (("STATE", STATE), ("INFO", INFO), ("CARD", CARD), ("MESSAGES", MESSAGES),
                        ("MAP", MAP)):
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


def test_a_connection_on_which_nothing_comes_is_none(found):
    assert found["silent"]["isClosed"]
    assert re.match(r"no connection to swarmtalk-view for \d\.\d s; ", found["silent"]["says"])


def test_the_table_of_channels_tells_silence_from_what_is_not_listened_to(found):
    assert found["channels"] == [["alarm", "2.0", "2", "4", "2.5 s"],
                                 ["channel 9", "0", "0", "0", "never"],
                                 ["far", "?", "2", "?", "no listener"],
                                 ["harvest", "0", "0", "0", "never"]], "reserved ones are last"
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
    assert card["messages lost"] == "3 on the air, 0 in the kernel, 1 in the daemon"
    assert card["channels"] == "alarm publishes, hears 2/s; channel 9 hears 1/s"
    assert (card["programs"], card["address"], card["values"]) == ("none", "unknown", "unknown")


def test_messages_of_the_channel_that_is_watched_are_shown_with_their_way(found):
    assert found["messages"] == ["2 1.25 m  fire ü",
                                 "3 via 5 (0.59 m)  0001ff  (3 bytes)   4 lost before",
                                 "4 via 1 robot  far", "1 here  mine"]
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


def middle(one, other):
    return [(one[0] + other[0]) / 2, (one[1] + other[1]) / 2]


def strokes(found, begin, end, name="map"):
    """The straight lines that were drawn between two places, in their order."""
    wanted = pytest.approx([*begin, *end], abs=0.01)
    return [each for each in found[name] if each["kind"] == "line" and len(each["path"]) == 2
            and [*each["path"][0], *each["path"][1]] == wanted]


def colour(line):
    """Red, green, blue, each of 255, and opacity of 1, of "rgba(r, g, b, a)" or "#rrggbb"."""
    style = line["style"]
    if style[0] == "#":
        return [int(style[i:i + 2], 16) for i in (1, 3, 5)] + [1.0]
    return [float(each) for each in re.findall(r"[\d.]+", style)]


def redness(line):
    red, green, *_ = colour(line)
    return red - green


def test_each_half_of_a_link_is_what_the_robot_at_its_end_loses(found):
    one, two, three, four = found["spots"]
    at_two, at_one = strokes(found, two, middle(one, two)), strokes(found, one, middle(one, two))
    assert len(at_two) == len(at_one) == 1
    assert at_two[0]["dash"] == at_one[0]["dash"] == []
    assert at_two[0]["width"] == at_one[0]["width"]  # both lose much

    nothing_lost = strokes(found, two, middle(two, three))[0]
    most_lost = strokes(found, three, middle(one, three))[0]
    assert redness(nothing_lost) < 0 < redness(at_one[0]) < redness(at_two[0])
    assert redness(at_two[0]) == pytest.approx(redness(most_lost))  # half is all a user needs
    assert nothing_lost["width"] < at_one[0]["width"]
    places = [found["map"].index(each) for each in (nothing_lost, *at_one, *at_two, most_lost)]
    assert places == sorted(places), "what loses most lies on top"
    for robot in (one, two, three):  # its links went with robot 4
        assert not strokes(found, robot, middle(robot, four))
        assert not strokes(found, four, middle(robot, four))


def test_the_half_of_a_link_of_which_nothing_is_known_is_dashed(found):
    one, two, three, _ = found["spots"]
    for hearer, sender in ((three, one), (two, three)):
        known = strokes(found, hearer, middle(hearer, sender))
        unknown = strokes(found, middle(hearer, sender), sender)
        assert [each["dash"] for each in known] == [[]]
        assert len(unknown) == 1 and unknown[0]["dash"]
        assert unknown[0]["style"] == found["colours"]["line"]
    assert not strokes(found, middle(one, two), one) and not strokes(found, middle(one, two), two)


def bodies(found):
    """By robot: the shape that stands at its place."""
    shapes = [each for each in found["map"] if each["kind"] == "body"]
    return [next(each for each in shapes if each["path"][1][:2] == pytest.approx(spot, abs=0.01))
            for spot in found["spots"]]


def test_a_robot_points_where_it_looks(found):
    for (x, y), body, (dx, dy) in zip(found["spots"], bodies(found), [(1, 0), (0, -1), (-1, 0),
                                                                      (1, 0)]):
        tip, radius = body["path"][0], body["path"][1][2]
        assert tip[0] - x == pytest.approx(1.75 * radius * dx, abs=0.01)
        assert tip[1] - y == pytest.approx(1.75 * radius * dy, abs=0.01)  # downwards


def test_a_robot_is_coloured_by_whether_it_is_heard(found):
    colours = found["colours"]
    assert [body["style"] for body in bodies(found)] == [
        colours["self"], colours["accent"], colours["paper"], colours["gone"]]
    texts = {each["text"]: (each["x"], each["y"]) for each in found["map"]
             if each["kind"] == "text"}
    assert [text for text in texts if text[-2:] not in (" m", "cm")] == [
        "1 base", "2", "3  12 s", "4  61 s"]
    assert texts["2"][0] == pytest.approx(found["spots"][1][0], abs=0.01)
    assert texts["2"][1] > found["spots"][1][1]


def test_the_bar_is_as_long_as_its_text_says(found):
    text = next(each["text"] for each in found["map"] if each["kind"] == "text")
    number, unit = text.split()
    bar = next(each["path"] for each in found["map"] if each["kind"] == "line"
               and len(each["path"]) == 4 and each["path"][0][0] == each["path"][1][0])
    length_m = (bar[2][0] - bar[1][0]) / found["scale"]
    assert length_m == pytest.approx(float(number) / {"m": 1, "cm": 100}[unit])


def test_a_trail_leads_from_where_a_robot_was_to_where_it_is(found):
    two = found["spots"][1]
    assert len(strokes(found, [two[0], two[1] + 0.25 * found["scale"]], two)) == 1
    # Nobody else moved within the time of a trail.
    trails = [each for each in found["map"] if each["kind"] == "line" and each["alpha"] < 1]
    assert {tuple(map(tuple, each["path"])) for each in trails if each["path"][0] !=
            each["path"][1]} == {tuple(map(tuple, strokes(
                found, [two[0], two[1] + 0.25 * found["scale"]], two)[0]["path"]))}


def test_what_is_selected_has_a_ring_and_the_other_links_fade(found):
    def rings(name):
        return [each["path"][0][:2] for each in found[name] if each["kind"] == "line"
                and len(each["path"]) == 1]
    one, two, three, _ = found["spots"]
    assert rings("map") == [] and rings("selected") == [pytest.approx(three, abs=0.01)]
    assert strokes(found, three, middle(one, three), "selected")[0]["width"] > strokes(
        found, three, middle(one, three))[0]["width"]
    assert colour(strokes(found, one, middle(one, two), "selected")[0])[3] < colour(strokes(
        found, one, middle(one, two))[0])[3]


def test_links_and_trails_go_when_they_are_not_wanted(found):
    one, two, _, _ = found["spots"]
    assert not strokes(found, one, middle(one, two), "bare")
    assert not [each for each in found["bare"] if each["alpha"] < 1]
    assert len([each for each in found["bare"] if each["kind"] == "body"]) == 4


def test_the_map_stands_still_until_a_robot_leaves_it(found):
    first, second, third, far, again = found["moved"]
    assert first == second == third
    assert far[2] < first[2] / 2, "it shows the one that left"
    assert again == far, "and does not move back by itself"
    _, (x, y), (width, height) = found["inside"]
    assert 20 < x < width - 20 and 20 < y < height - 20


def test_the_legend_has_the_colours_of_the_lines(found):
    assert len(found["ramp"]) == 5 and found["ramp"] == found["scaleColours"]


def test_the_log_shows_the_newest_line_until_the_reader_scrolls_up(found):
    shown_at_once, is_left, top, again = found["fromEnd"]
    assert abs(shown_at_once) < 2 and abs(again) < 2
    assert is_left and top == 40


def test_signs_are_told_when_asked_for(found):
    assert found["signs"] == [False, True, False]


def test_without_a_daemon_a_banner_lies_over_the_map_and_who_was_told_of_is_grey_too(found):
    assert found["banner"] == [True, "the daemon went away 7.0 s ago; waiting for it"]
    assert found["greyed"] == [True, False, True, True], "only robot 2 was heard within 2.5 s"


def test_zooming_keeps_the_place_below_the_pointer(found):
    assert found["zoomed"]["kept"] == pytest.approx([0, 0], abs=1e-9)
    assert found["zoomed"]["back"] == pytest.approx([0, 0], abs=1e-9)
    assert found["zoomed"]["scale"] == pytest.approx(1.5)
