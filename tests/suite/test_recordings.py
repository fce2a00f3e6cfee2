"""Recordings of runs: run --mcap and report --mcap make them; the same log gives the same bytes."""
import json
import re

import pytest

from test_runner import suite


def test_a_run_and_its_repetition_give_the_same_recording(tmp_path):
    words = ("run", "hop_count", "--robots", 9, "--seconds", 15, "--mcap")
    done = suite(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    path = tmp_path / json.loads(done.stdout)["recording"]
    first = path.read_bytes()
    assert first.startswith(b"\x89MCAP0\r\n") and first.endswith(b"\x89MCAP0\r\n")
    # Its index names what is in it, in the clear.
    for name in (b"/pose", b"/values", b"/heard", b"/channel/0", b"/swarm", b"/tf",
                 b"swarmtalk.recording.RobotPose", b"foxglove.SceneUpdate"):
        assert name in first, name
    path.unlink()
    assert suite(tmp_path, *words).returncode == 0
    assert path.read_bytes() == first


def test_without_the_option_there_is_none(tmp_path):
    done = suite(tmp_path, "run", "hop_count", "--robots", 4)
    assert "recording" not in json.loads(done.stdout)
    assert not list(tmp_path.rglob("*.mcap"))


def test_a_report_makes_what_is_missing_and_links_to_it(tmp_path):
    pytest.importorskip("matplotlib")
    suite(tmp_path, "run", "hop_count", "--robots", 4, "--runs", 2)
    done = suite(tmp_path, "report", "--mcap")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "suite-report.html").read_text()
    links = re.findall(r'href="([^"]+\.mcap)"', text)
    assert len(links) == 2
    for link in links:
        assert (tmp_path / link).read_bytes().startswith(b"\x89MCAP")
    made = (tmp_path / links[0]).stat().st_mtime_ns
    assert suite(tmp_path, "report", "--mcap").returncode == 0
    assert (tmp_path / links[0]).stat().st_mtime_ns == made


def test_a_log_that_is_damaged_leaves_no_recording(tmp_path):
    pytest.importorskip("matplotlib")
    suite(tmp_path, "run", "hop_count", "--robots", 4)
    log, = tmp_path.rglob("*.jsonl")
    lines = log.read_text().splitlines(keepends=True)
    lines[5] = lines[5].replace('"robot":', '"robot":77')
    log.write_text("".join(lines))
    done = suite(tmp_path, "report", "--mcap")
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1
    assert "in line 6" in done.stderr, done.stderr
    assert not list(tmp_path.rglob("*.mcap*"))
