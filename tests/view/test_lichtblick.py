"""Lichtblick shows the swarm in its 3D panel: 36 robots live, and a recording. SWARMTALK_LICHTBLICK
names a folder with a built Lichtblick for the browser (index.html is in it); else this is skipped.

The layout goes where Lichtblick's own container puts one: in place of a comment in index.html. The
source is named in the address: ?ds=foxglove-websocket&ds.url=ws://... or ?ds=remote-file&ds.url=...
"""
import base64
import http.server
import os
import pathlib
import re
import struct
import threading
import time
import urllib.parse
import zlib

import browser
import pytest
from browser import Browser
from conftest import ROOT, wait_for
from test_page import config

FOLDER = os.environ.get("SWARMTALK_LICHTBLICK")
PICTURES = os.environ.get("SWARMTALK_PICTURES")
PLACE_OF_LAYOUT = "/*LICHTBLICK_SUITE_DEFAULT_LAYOUT_PLACEHOLDER*/"
ROBOTS = 36
PIXELS = 150  # of one robot, at least
# True when robot {0} is in the panel of texts. Until then a recording is played again: it
# begins paused, and before all robots are known.
KNOWS = """(() => {{ const button = document.querySelector("[data-testid=play-button]");
  const knows = (document.body?.innerText ?? "").includes("id: {0}\\n");
  if (!knows && button?.title == "Play") button.click();
  return knows; }})()"""
pytestmark = [
    pytest.mark.field,
    pytest.mark.skipif(not FOLDER, reason="SWARMTALK_LICHTBLICK names no folder with Lichtblick"),
    pytest.mark.skipif(browser.find() is None, reason="no chromium: run tools/setup test")]


class Handler(http.server.SimpleHTTPRequestHandler):
    """Lichtblick's files, with our layout in its page, and the recording of the server."""

    def __init__(self, *arguments):
        super().__init__(*arguments, directory=FOLDER)

    def do_GET(self):  # noqa: N802  pylint: disable=invalid-name
        path = urllib.parse.urlsplit(self.path).path
        if path == "/run.mcap":
            self.answer_recording()
        elif path in ("/", "/index.html"):
            page = pathlib.Path(FOLDER, "index.html").read_text(encoding="utf-8")
            layout = (ROOT / "view/swarmtalk-layout.json").read_text(encoding="utf-8")
            self.answer("text/html; charset=utf-8", page.replace(PLACE_OF_LAYOUT, layout).encode())
        else:
            super().do_GET()

    def answer(self, kind, body, *headers):
        self.send_response(206 if headers else 200)
        for name, value in (("Content-Type", kind), ("Content-Length", str(len(body))), *headers):
            self.send_header(name, value)
        self.send_header("Accept-Ranges", "bytes")
        self.end_headers()
        self.wfile.write(body)

    def answer_recording(self):
        """Whole, or the range of bytes that is asked for: Lichtblick reads a file by its index."""
        data = self.server.recording.read_bytes()
        asked = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        if not asked:
            self.answer("application/octet-stream", data)
            return
        first, last = int(asked[1]), min(int(asked[2] or len(data)), len(data) - 1)
        self.answer("application/octet-stream", data[first:last + 1],
                    ("Content-Range", f"bytes {first}-{last}/{len(data)}"))

    def log_message(self, *_):
        pass


@pytest.fixture
def server():
    """Lichtblick at server.origin; server.recording is what it has at /run.mcap."""
    index = pathlib.Path(FOLDER, "index.html").read_text(encoding="utf-8")
    assert PLACE_OF_LAYOUT in index, "this Lichtblick takes no layout: another version is needed"
    made = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    made.origin = f"http://localhost:{made.server_port}"
    thread = threading.Thread(target=made.serve_forever, daemon=True)
    thread.start()
    yield made
    made.shutdown()
    thread.join()
    made.server_close()


def address(server, source, url):
    return f"{server.origin}/?{urllib.parse.urlencode({'ds': source, 'ds.url': url})}"


def pixels(png):
    """Rows of (red, green, blue) of a PNG with 8 bits a part, as browsers write it."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, width, height, parts = 8, b"", 0, 0, 3
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert depth == 8 and colour in (2, 6)
            parts = 3 if colour == 2 else 4
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    data, line = zlib.decompress(packed), width * parts
    before = bytearray(line)
    for y in range(height):
        kind = data[y * (line + 1)]
        row = bytearray(data[y * (line + 1) + 1:(y + 1) * (line + 1)])
        for x in range(line):
            left = row[x - parts] if x >= parts else 0
            corner = before[x - parts] if x >= parts else 0
            up = before[x]
            if kind == 4:
                guess = left + up - corner
                near = min((left, up, corner), key=lambda each, guess=guess: abs(guess - each))
            else:
                near = (0, left, up, (left + up) // 2)[kind]
            row[x] = row[x] + near & 255
        yield [tuple(row[x:x + 3]) for x in range(0, line, parts)]
        before = row


def is_robot(red, green, blue):
    """The colour that robots have, roughly: the light of the panel changes it."""
    return blue > 120 and blue > red + 50 and blue > green + 20


def is_parent_line(red, green, blue):
    """Lichtblick's own lines from the frame `map` to each robot, which our layout switches off."""
    return red > 200 and green > 200 and blue < 100


def count(page, *kinds):
    shot = base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"])
    colours = [each for row in pixels(shot) for each in row]
    return [sum(kind(*each) for each in colours) for kind in kinds]


def wait_for_robots(page, robots, name):
    page.wait_for("document.querySelectorAll('canvas').length > 0", 60)
    page.wait_for(KNOWS.format(robots), 60)
    wait_for(lambda: count(page, is_robot)[0] > robots * PIXELS, 60, "robots in the 3D panel")
    time.sleep(2)  # the first places are older than the first links and transforms
    if PICTURES:
        page.picture(pathlib.Path(PICTURES) / name)
    shown, lines = count(page, is_robot, is_parent_line)
    assert shown > robots * PIXELS and lines < 20, (shown, lines)


def test_its_3d_panel_draws_thirty_six_robots(make_lab, make_view, server, tmp_path):
    lab = make_lab(ROBOTS, *config(tmp_path))
    view = make_view(lab.socket(1), "--allow-origin", server.origin)
    source = address(server, "foxglove-websocket", f"ws://localhost:{view.port}")
    with Browser(source, 1440, 900) as page:
        wait_for_robots(page, ROBOTS, "lichtblick.png")


def test_it_opens_a_recording_that_the_command_line_wrote(make_lab, server, tmp_path):
    lab = make_lab(9, *config(tmp_path))
    server.recording = tmp_path / "run.mcap"
    recorder = lab.start_cli(1, "record", server.recording, "-W", "5")
    lab.cli(2, "pub", "alarm", "fire")
    assert recorder.wait(60) == 0
    with Browser(address(server, "remote-file", f"{server.origin}/run.mcap"), 1440, 900) as page:
        wait_for_robots(page, 9, "lichtblick_recording.png")
