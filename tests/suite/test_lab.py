"""Platform coachbot-lab: the programs on the client library, through daemons as they are."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

from test_runner import BUILD, ENVIRONMENT, ROOT, SUITE, results, suite

sys.path.insert(0, str(ROOT / "tests/support"))

from commands import wait_for  # noqa: E402

pytestmark = pytest.mark.clock

for part in ("lab/swarmtalk-lab", "daemon/swarmtalkd", "suite/swarmtalk-suite-robot",
             "suite/swarmtalk-suite-bodies"):
    if "SWARMTALK_COLLECTING" not in os.environ and not (BUILD / part).exists():
        pytest.skip(f"no {BUILD / part}", allow_module_level=True)

LAB = ("--platform", "coachbot-lab")


RADIO = ("--platform", "coachbot-radio")
LOSSES = ("lost_kernel", "lost_daemon", "lost_client")


def test_nine_robots_count_hops_through_their_daemons_and_leave_when_interrupted(tmp_path):
    """All hear all in the lab's air: right counts need the virtual range."""
    done = suite(tmp_path, "run", "hop_count", *LAB, "--robots", 9, "--seconds", 12)
    assert done.returncode == 0, done.stderr
    result = results(done)[0]
    print(f"delivery {result['delivery']}")  # in real time: what a busy machine leaves of it
    assert result["success"]
    assert [result[key] for key in LOSSES] == [0, 0, 0]
    replay = suite(tmp_path, "replay", result["log"])
    assert replay.returncode == 1 and "real time" in replay.stderr
    interrupt_takes_the_lab_down_and_keeps_what_there_is(tmp_path)


@pytest.mark.field
@pytest.mark.parametrize("program", ["hop_count", "hop_count_two_seeds", "firefly"])
def test_thirty_six_robots_do_on_the_radio_what_they_do_in_the_lab(tmp_path, program):
    """By the suite's own criteria, for as long as the suite runs it."""
    done = suite(tmp_path, "run", program, *RADIO, timeout=480)
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout)


def test_bodies_are_known_to_the_radio_and_to_their_daemons(tmp_path):
    the_radio_is_told_where_the_bodies_are(tmp_path)
    followers_move_and_stand_still_while_they_get_no_processor(tmp_path)


def the_radio_is_told_where_the_bodies_are(tmp_path):
    """No virtual range: who hears whom is the medium's business. Robots of a lab stand on a grid of
    0.5 m until they are told otherwise, and would not hear each other at a range of 0.3 m."""
    radio = "program = 'hop_count'\nspacing_mm = 200\n[radio]\nrange_mm = 300\n"
    log = tmp_path / "suite-logs/hop_count-coachbot-radio-4-s-1.jsonl"
    for loss, seconds, hears in (("", 12, True), ("loss = 1.0\n", 3, False)):
        (tmp_path / "s.toml").write_text(radio + loss)
        done = suite(tmp_path, "run", "--scenario", "s.toml", *RADIO, "--robots", 4, "--seconds",
                     seconds)
        events = [json.loads(line)["event"] for line in log.read_text().splitlines()[1:]]
        assert "sent" in events and ("received" in events) == hears, done.stderr
        result = results(done)[0]
        assert result["success"] == hears and result["platform"] == "coachbot-radio"
        assert [result[key] for key in LOSSES] == [0, 0, 0]
        assert "real time" in suite(tmp_path, "replay", result["log"]).stderr


def find_program(name, mark):
    """Process id of a program with this variable in its environment."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            program = (process / "cmdline").read_bytes().split(b"\0")[0]
            if program.endswith(name) and mark in (process / "environ").read_bytes():
                return int(process.name)
        except OSError:
            continue  # it has ended
    return None


def followers_move_and_stand_still_while_they_get_no_processor(tmp_path):
    """A few steps of edge following: the distances that steer it come from the daemons' poses. And
    bodies do not jump to where a robot would be that nobody could stop."""
    process = subprocess.Popen([SUITE, "run", "edge_following", *LAB, "--seconds", "10"],
                               cwd=tmp_path, env={**ENVIRONMENT, "TEST_MARK": str(tmp_path)},
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: find_program(b"swarmtalk-suite-robot", bytes(tmp_path)), timeout=60,
             what="robots, whose bodies move by then")
    bodies = find_program(b"swarmtalk-suite-bodies", bytes(tmp_path))
    os.kill(bodies, signal.SIGSTOP)
    time.sleep(2)
    os.kill(bodies, signal.SIGCONT)
    output, errors = process.communicate(timeout=60)
    result = json.loads(output.splitlines()[0])
    log = (tmp_path / "suite-logs/edge_following-coachbot-lab-6-1.jsonl").read_text()
    events = [json.loads(line) for line in log.splitlines()[1:]]
    assert {e["robot"] for e in events if e["event"] == "pose"} == {4, 5}, errors
    assert result["revolutions"] > 0.02 and result["contacts"] == 0
    assert 1.5 <= result["stood_still_s"] < 10, errors
    assert result["distance_error"] < 10, "Kilobot mm"
    heard = {e["mm"] for e in events if e["event"] == "received" and e["robot"] == 4}
    assert len(heard) > 5 and min(heard) > 110, heard


def interrupt_takes_the_lab_down_and_keeps_what_there_is(tmp_path):
    process = subprocess.Popen([SUITE, "run", "hop_count", *LAB, "--robots", "4"], cwd=tmp_path,
                               env={**ENVIRONMENT, "TEST_MARK": str(tmp_path)},
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    state = pathlib.Path("/run/swarmtalk-lab") / f"suite{process.pid}"
    if os.geteuid() == 0:  # into the run; or earlier, which has to work as well
        mark = f"TEST_MARK={tmp_path}".encode()
        wait_for(lambda: find_program(b"swarmtalk-suite-robot", mark), timeout=60, what="the run")
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert not state.exists(), "the lab is still there"
    assert all(r["interrupted"] for r in map(json.loads, output.splitlines()))


@pytest.mark.field
def test_a_sweep_that_is_killed_in_a_real_time_run_never_does_it_again(tmp_path):
    """One run finished, one in the middle when all of it is killed, one to come: the first stays
    as it is, the second is told as cut off, the third is done, and its lab is gone at the end."""
    (tmp_path / "s.toml").write_text(
        "program = 'hop_count'\nrobots = 4\nseconds = 3\nruns = 3\nreport = ['delivery']\n"
        "[vary]\nplatform = ['sim-coachbot', 'coachbot-lab']\n")
    check = suite(tmp_path, "sweep", "s.toml", "--check")
    assert "2 cells, 1 of them in real time" in check.stdout
    runs = tmp_path / "sweep-s/runs/00001"
    mark = f"TEST_MARK={tmp_path}".encode()
    process = subprocess.Popen([SUITE, "sweep", "s.toml"], cwd=tmp_path, stderr=subprocess.DEVNULL,
                               env={**ENVIRONMENT, "TEST_MARK": str(tmp_path)})
    wait_for(lambda: (runs / "0.json").exists(), timeout=60,
             what="the end of the first run")
    wait_for(lambda: find_program(b"swarmtalk-suite-robot", mark) is None, timeout=60,
             what="its end")
    wait_for(lambda: find_program(b"swarmtalk-suite-robot", mark), timeout=60,
             what="the second run")
    assert (runs / "1.begun").exists()
    process.kill()
    process.wait()
    for name in (b"swarmtalk-suite-robot", b"swarmtalkd", b"swarmtalk-lab"):
        wait_for(lambda: find_program(name, mark) is None, timeout=60, what=f"the end of {name}")
    first = (runs / "0.json").stat()
    assert (tmp_path / "sweep-s/runs/00000/2.json").exists(), "real time comes last"
    done = suite(tmp_path, "sweep", "s.toml")
    assert done.returncode == 0 and "4 finished runs (and 1 in real time" in done.stderr, done
    rows = [row.split(",") for row in (tmp_path / "sweep-s/table.csv").read_text().splitlines()]
    at = {name: i for i, name in enumerate(rows[0])}
    assert [(r[at["real_time"]], r[at["cut_off"]]) for r in rows[1:]] == [
        ("0", "0")] * 3 + [("1", "0"), ("1", "1"), ("1", "0")]
    times = {path.name: path.stat().st_mtime_ns for path in runs.iterdir()}
    assert (runs / "0.json").stat().st_ino == first.st_ino
    again = suite(tmp_path, "sweep", "s.toml")
    assert again.returncode == 0
    assert {path.name: path.stat().st_mtime_ns for path in runs.iterdir()} == times
    refused = suite(tmp_path, "sweep", "s.toml", "--repeat", "1")
    assert refused.returncode == 1 and "never run twice" in refused.stderr


@pytest.mark.logic
@pytest.mark.parametrize("platform, line, says", [
    (LAB, "radio.loss = 0.1", "[radio] has no key 'loss'"),
    (LAB, "[[fault]]\nkind = 'death'", "no faults"),
    (RADIO, "radio.air_us = 300", "[radio] has no key 'air_us'")])
def test_what_the_lab_cannot_do_is_refused_in_one_line(tmp_path, platform, line, says):
    (tmp_path / "s.toml").write_text("program = 'hop_count'\n" + line + "\n")
    done = suite(tmp_path, "run", "--scenario", "s.toml", *platform, "--robots", 4)
    assert done.returncode == 1 and says in done.stderr and done.stderr.count("\n") == 1
