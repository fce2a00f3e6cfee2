"""Lichtblick shows the swarm: a picture of its 3D panel with 36 robots. SWARMTALK_LICHTBLICK names
a folder with a built Lichtblick for the browser (index.html is in it); else this is skipped.

The layout goes where Lichtblick's own container puts one: in place of a comment in index.html. The
source is named in the address: ?ds=foxglove-websocket&ds.url=ws://...
"""
import base64
import http.server
import os
import pathlib
import struct
import threading
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
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not FOLDER, reason="SWARMTALK_LICHTBLICK names no folder with Lichtblick"),
    pytest.mark.skipif(browser.find() is None, reason="no chromium: run tools/setup test")]


class Handler(http.server.SimpleHTTPRequestHandler):
    """Lichtblick's files, with our layout in its page."""

    def __init__(self, *arguments):
        super().__init__(*arguments, directory=FOLDER)

    def do_GET(self):  # noqa: N802  pylint: disable=invalid-name
        if urllib.parse.urlsplit(self.path).path not in ("/", "/index.html"):
            super().do_GET()
            return
        page = pathlib.Path(FOLDER, "index.html").read_text(encoding="utf-8")
        layout = (ROOT / "view/swarmtalk-layout.json").read_text(encoding="utf-8")
        body = page.replace(PLACE_OF_LAYOUT, layout).encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


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


def blue_pixels(page):
    """Those in the colour that robots have, roughly: the light of the panel changes it."""
    shot = base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"])
    return sum(b > 120 and b > r + 50 and b > g + 20 for row in pixels(shot) for r, g, b in row)


def test_its_3d_panel_draws_thirty_six_robots(make_lab, make_view, tmp_path):
    index = pathlib.Path(FOLDER, "index.html").read_text(encoding="utf-8")
    assert PLACE_OF_LAYOUT in index, "this Lichtblick takes no layout: another version is needed"
    lab = make_lab(ROBOTS, *config(tmp_path))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        origin = f"http://localhost:{server.server_port}"
        view = make_view(lab.socket(1), "--allow-origin", origin)
        query = urllib.parse.urlencode({"ds": "foxglove-websocket",
                                        "ds.url": f"ws://localhost:{view.port}"})
        with Browser(f"{origin}/?{query}", 1440, 900) as page:
            page.wait_for("document.querySelectorAll('canvas').length > 0", 60)
            wait_for(lambda: blue_pixels(page) > ROBOTS * 20, 60, "robots in the 3D panel")
            if PICTURES:
                page.picture(pathlib.Path(PICTURES) / "lichtblick.png")
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
