"""The page in a real browser: robots at the right places, and what a person does with it."""
import contextlib
import os
import pathlib
import re
import time

import browser
import pytest
from browser import Browser
from conftest import wait_for

needs_browser = pytest.mark.skipif(browser.find() is None,
                                   reason="no chromium: run tools/setup test")
pytestmark = needs_browser
PICTURES = os.environ.get("SWARMTALK_PICTURES")  # a folder: pictures of the page are kept there

SHOWN = """(() => { const s = window.swarmtalk && swarmtalk.shown();
  return s && s.robots.filter(r => r.x !== undefined).map(r => [r.id, r.x, r.y]); })()"""


NAMES = "constructor", "__proto__", "toString"


def config(tmp_path, text=""):
    path = tmp_path / "base.toml"
    path.write_text("[links.wifi]\nbeacon_ms = 100\n[reserved]\ndebug = true\n" + text)
    return "--config", path


def keep(page, name):
    if PICTURES:
        page.picture(pathlib.Path(PICTURES) / name)


def shown(page, count, timeout=60.0):
    """Robots by id, once so many have a place."""
    deadline = time.monotonic() + timeout
    while True:
        robots = page.ask(SHOWN) or []
        if len(robots) >= count:
            return {number: (x, y) for number, x, y in robots}
        assert time.monotonic() < deadline, f"{len(robots)} of {count} robots are shown"
        time.sleep(0.02)


def show_robots_cards_channels_and_what_was_before(page, lab):
    robots = shown(page, 9)
    for number, place in robots.items():
        assert place == pytest.approx(lab.place(number), abs=0.001)
    # On the map: right of each other where x is larger, higher where y is larger.
    page.wait_for("Math.abs(swarmtalk.onMap(2)[0] - swarmtalk.onMap(1)[0]) > 50")
    # At one time: the map still moves while it makes room for all.
    one, two, four = page.ask("[1, 2, 4].map(number => swarmtalk.onMap(number))")
    assert two[0] > one[0] and four[1] < one[1]
    page.ask("document.querySelector('[data-pane=channels]').click()")
    page.wait_for("""[...document.querySelectorAll('#channel-list tbody tr')]
        .find(row => row.textContent.includes('alarm'))?.click() ?? true""")
    page.wait_for("document.getElementById('messages').textContent.includes('fire')")
    page.ask("swarmtalk.select(2)")
    page.wait_for("document.getElementById('card').textContent.includes('0.500, 0.000 m')")
    # What is not known is called unknown.
    assert "unknown" in page.ask("document.getElementById('card').textContent")
    keep(page, "channels.png")
    page.wait_for("performance.now() > 3000")  # else there is nothing 4 s back
    lab.kill(3)
    page.wait_for("swarmtalk.isGreyed(3)")
    assert not page.ask("swarmtalk.isGreyed(2)")
    # Back to when robot 3 was there.
    page.ask("""(() => { const back = document.getElementById('back');
        back.value = -4; back.oninput(); })()""")
    assert not page.ask("swarmtalk.isGreyed(3)")
    assert "4.0 s ago" in page.ask("document.getElementById('when').textContent")
    page.ask("swarmtalk.setPaused(false)")
    assert page.ask("document.getElementById('when').textContent") == "live"
    assert page.ask("swarmtalk.isGreyed(3)")


def show_card_and_messages_on_a_small_screen(page, width, height):
    page.wait_for("window.swarmtalk && swarmtalk.shown() && info && info.channels.length")
    page.ask("swarmtalk.select(1)")
    page.wait_for("document.getElementById('card').textContent.includes('programs')")
    top, bottom = page.ask("""(() => { const b = document.querySelector('#card dl dt')
        .getBoundingClientRect(); return [b.top, b.bottom]; })()""")
    assert 0 < top < bottom < height
    tab = page.ask("document.querySelector('nav').getBoundingClientRect().bottom")
    assert tab < height + 1  # the way to the lists is never hidden
    page.ask("document.querySelector('[data-pane=channels]').click()")
    page.ask("document.querySelector('#channel-list tbody tr').click()")
    top, bottom = page.ask("""(() => { const b = document.getElementById('messages')
        .getBoundingClientRect(); return [b.top, b.bottom]; })()""")
    assert top + 50 < bottom < height + 1  # parts of a pixel are rounded
    assert page.ask("document.documentElement.scrollWidth") == width


def show_the_whole_state_on_a_small_screen(page, width, height):
    page.wait_for("window.swarmtalk && swarmtalk.shown() && info")
    page.ask("""(() => { info.questions = 'no'; info.links = [{name: 'air', up: false,
        state: 'wlan0 is down'}]; socket.onmessage = null; drawState(); })()""")
    text, room, needed, bottom = page.ask("""(() => {
        const s = document.querySelector('#state span');
        return [s.textContent, [s.clientWidth, s.clientHeight], [s.scrollWidth, s.scrollHeight],
            document.querySelector('header').getBoundingClientRect().bottom]; })()""")
    keep(page, f"state-{width}.png")
    assert "only robots that are heard directly" in text
    assert needed[0] <= room[0] and needed[1] <= room[1], "it is cut off"
    assert bottom < height / 3, "it leaves too little for the map"
    assert page.ask("document.documentElement.scrollWidth") == width


def decode_messages_as_struct_does(page):
    page.wait_for("window.swarmtalk !== undefined")
    for form, data, expected in (
            ("<ffi", "0000803f000000bf07000000", "1  -0.5  7"),
            (">Hb", "0102ff", "258  -1"),
            ("bh", "01000200", "1  2"),  # native: with padding
            ("<bh", "010200", "1  2"),
            ("<3s?", "616263ff", '"abc"  true'),
            ("<q", "ffffffffffffffff", "-1"),
            ("<e", "003c", "1"),
            ("<f", "00", "1 byte, the format takes 4"),
            ("<z", "00", "there is no 'z' in a format"),
            ("f f", "0000803f0000803f", "1  1")):
        assert page.ask(f"swarmtalk.unpack({form!r}, swarmtalk.fromHex({data!r}))") == expected


# Three robots in a row: the link from 1 to 3 loses nothing and lies over the one from 1 to 2, which
# loses 40 %. The colour between 1 and 2, drawn and read in one turn of the page.
ROW = """(() => {
  const robots = [1, 2, 3].map(id => ({id, x: id / 2, y: 0, heard_age: 0, pose_age: 0}));
  const now = {robots, byId: new Map(robots.map(each => [each.id, each])),
               links: [[1, 2, .4, 0], [2, 1, .4, 0], [1, 3, 0, 0], [3, 1, 0, 0]]};
  const box = size();
  Object.assign(camera, {x: 1, y: 0, scale: 200});
  pen.fillStyle = "white"; pen.fillRect(0, 0, box.width, box.height);
  drawLinks(box, now);
  const [x, y] = toScreen(box, .65, 0);
  return [...pen.getImageData(Math.round(x), Math.round(y), 1, 1).data]; })()"""


def not_hide_a_lossy_link_under_a_good_one(page):
    page.wait_for("window.swarmtalk !== undefined")
    red, green, blue, _ = page.ask(ROW)
    assert red > blue + 60, (red, green, blue)


def grow_old_without_the_viewer(page, view):
    shown(page, 2)
    page.wait_for("!swarmtalk.isGreyed(2)")
    view.process.kill()
    page.wait_for("swarmtalk.isGreyed(2) && swarmtalk.isGreyed(1)")
    text = page.ask("document.getElementById('state').textContent")
    assert re.search(r"no connection to swarmtalk-view for \d.* s; trying again", text), text
    assert page.ask("document.getElementById('when').textContent") == "not live"


def take_what_robots_say_for_text(page, lab):
    evil = "<img src=x onerror=\"document.title='broken'\">"
    shown(page, 1)
    assert lab.cli(2, "pub", "debug", evil).returncode == 0
    page.wait_for("document.getElementById('log-lines').textContent.includes('onerror')")
    assert page.ask("document.querySelectorAll('#log-lines img').length") == 0
    assert page.ask("document.title") == "SwarmTalk"


def name_channels_as_objects_of_the_browser_are(page, lab):
    with contextlib.ExitStack() as stack:
        for name in NAMES:
            talker = lab.start_cli(2, "pub", name, "x", "--repeat", "0", "--rate", "10")
            stack.callback(lambda each=talker: (each.kill(), each.wait()))
        page.wait_for("info && info.channels.filter(c => c.rate).length >= 3")
        text = page.ask("document.getElementById('channel-list').textContent")
        assert all(name in text for name in NAMES) and "not heard" not in text


def read_nothing_as_a_foreign_page(page, view, other):
    page.call("Page.setBypassCSP", enabled=True)  # a foreign page has no policy of ours
    page.go(f"http://localhost:{other.port}/?again")
    heard = page.ask(f"""new Promise(done => {{
        const socket = new WebSocket('ws://localhost:{view.port}/', 'swarmtalk.view.v1');
        socket.onmessage = () => done('a message');
        socket.onerror = () => done('an error');
    }})""")
    assert heard == "an error"
    read = page.ask(f"""fetch('http://localhost:{view.port}/').then(
        answer => answer.text(), () => 'an error')""")
    assert read == "an error"
    page.call("Page.setBypassCSP", enabled=False)


def test_a_browser_shows_what_a_lab_does(make_lab, make_view, tmp_path):
    lab = make_lab(9, *config(tmp_path))
    flood = lab.start_cli(2, "pub", "alarm", "fire", "--repeat", "0", "--rate", "10")
    view, another = (make_view(lab.socket(1), "--channel", "alarm") for _ in range(2))
    with Browser(f"http://localhost:{another.port}/") as page, contextlib.ExitStack() as stack:
        stack.callback(lambda: (flood.kill(), flood.wait()))
        shown(page, 2)
        grow_old_without_the_viewer(page, another)
        page.go(f"http://localhost:{view.port}/")
        show_robots_cards_channels_and_what_was_before(page, lab)
        lab.kill(1)
        page.wait_for("document.getElementById('state').textContent.includes('went away')")


SMALL = ((390, 780), (320, 568))


def test_a_page_bears_any_screen_text_and_neighbour(make_lab, make_view, tmp_path):
    lab = make_lab(2, *config(tmp_path))
    words = (word for name in ("alarm", *NAMES) for word in ("--channel", name))
    view, other = make_view(lab.socket(1), *words), make_view(lab.socket(1))
    address = f"http://localhost:{view.port}/"
    with Browser(address) as page:
        shown(page, 2)
        take_what_robots_say_for_text(page, lab)
        name_channels_as_objects_of_the_browser_are(page, lab)
        decode_messages_as_struct_does(page)
        not_hide_a_lossy_link_under_a_good_one(page)
        read_nothing_as_a_foreign_page(page, view, other)
        for width, height in SMALL:
            page.resize(width, height)
            for step in (show_card_and_messages_on_a_small_screen,
                         show_the_whole_state_on_a_small_screen):
                page.go(address)
                step(page, width, height)


@pytest.mark.field
def test_thirty_six_robots_are_there_and_one_that_is_off_is_grey(make_lab, make_view, tmp_path):
    lab = make_lab(36, *config(tmp_path))
    talking = [lab.start_cli(number, "pub", "state", "x" * 20, "--repeat", "0", "--rate", "10")
               for number in range(2, 37)]
    try:
        view = make_view(lab.socket(1), "--channel", "state")
        with Browser(f"http://localhost:{view.port}/", 1440, 900) as page:
            page.wait_for("window.swarmtalk !== undefined")
            start = time.monotonic()
            robots = shown(page, 36, 60.0)
            took = time.monotonic() - start
            print(f"36 robots shown after {took:.2f} s")
            for number, place in robots.items():
                assert place == pytest.approx(lab.place(number), abs=0.001)
            start, cpu_s = time.monotonic(), view.cpu_seconds()
            wait_for(lambda: time.monotonic() - start > 5, what="five seconds")
            used = (view.cpu_seconds() - cpu_s) / (time.monotonic() - start)
            print(f"36 robots at 10 Hz with one viewer: {used * 100:.1f} % of a core")
            assert used < 0.5
            lab.kill(20)
            start = time.monotonic()
            page.wait_for("swarmtalk.isGreyed(20)", 60.0)
            print(f"robot 20 is grey {time.monotonic() - start:.2f} s after it was killed")
            # Loss on one wire that drops nothing.
            wait_for(lambda: page.ask("swarmtalk.shown().links.length") >= 34, what="links")
            keep(page, "map36.png")
    finally:
        for process in talking:
            process.kill()
            process.wait()
