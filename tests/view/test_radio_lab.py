"""The first promise of the map on a medium that loses and moves: 36 robots, 12 of them moving, and
a link that loses 30 % of its messages. Needs a lab with `--medium radio`."""
import contextlib
import math
import os
import statistics
import time

import browser
import pytest
from browser import Browser
from conftest import program, run
from test_page import config, keep, shown

MOVING = range(2, 14)
LOSSY, RATE_HZ = 20, 40  # of 2400 messages in a minute 25 to 35 % is five standard deviations
LOOKS = 12


def has_radio():
    return "radio" in run(program("swarmtalk-lab"), "up", "--help").stdout


pytestmark = [
    pytest.mark.field,
    pytest.mark.skipif(browser.find() is None, reason="no chromium: run tools/setup test")]


@pytest.fixture(name="lab")
def fixture_lab(make_lab, tmp_path):
    if not has_radio():
        pytest.skip("swarmtalk-lab has no --medium radio here")
    if os.geteuid() != 0:
        pytest.skip("network namespaces need root")
    return make_lab(36, *config(tmp_path), medium="radio")


def test_positions_are_right_and_a_links_loss_is_shown(lab, make_view):
    with contextlib.ExitStack() as stack:
        for robot in range(2, 37):
            talking = lab.start_cli(robot, "pub", "state", "x" * 20, "--repeat", "0", "--rate",
                                    RATE_HZ if robot == LOSSY else 10)
            stack.callback(lambda process=talking: (process.kill(), process.wait()))
        done = lab.tool("link", LOSSY, 1, "--loss", "0.3", "--one-way")
        assert done.returncode == 0, done.stderr
        view = make_view(lab.socket(1), "--channel", "state")
        with Browser(f"http://localhost:{view.port}/", 1440, 900) as page:
            page.wait_for("window.swarmtalk !== undefined")
            start = time.monotonic()
            shown(page, 36, 60.0)
            print(f"36 robots shown after {time.monotonic() - start:.2f} s")
            for step in range(10):
                angle = step / 10 * 2 * math.pi
                places = {}
                for robot in MOVING:
                    x, y = lab.place(robot)
                    places[robot] = x + 0.2 * math.cos(angle), y + 0.2 * math.sin(angle)
                    done = lab.tool("move", robot, *(f"{value:.3f}" for value in places[robot]))
                    assert done.returncode == 0, done.stderr
                for robot, (x, y) in places.items():
                    page.wait_for(f"(() => {{ const r = swarmtalk.shown().byId.get({robot}); "
                                  f"return Math.hypot(r.x - {x:.3f}, r.y - {y:.3f}) < 0.002; "
                                  "})()")
            # What is shown is of the last 5 to 10 s: looks see each message once or twice.
            shares = []
            for _ in range(LOOKS):
                time.sleep(5)
                shares.append(page.ask("swarmtalk.shown().links.find("
                                       f"l => l[0] === {LOSSY} && l[1] === 1)[2]"))
            print("loss shown, %:", *(f"{share * 100:.1f}" for share in shares))
            assert 0.25 <= statistics.mean(shares) <= 0.35
            keep(page, "radio36.png")
