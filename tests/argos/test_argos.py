"""Platforms argos-kilobot and argos-footbot, in ARGoS itself."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/suite"), str(ROOT / "suite/runner")]
from test_runner import BUILD, ENVIRONMENT, SUITE, results, suite  # noqa: E402
import argos  # noqa: E402

FOUND = json.loads((BUILD / "argos/argos.json").read_text())
ROBOTS = (["kilobot"] if FOUND["kilobot"] else []) + ["footbot"]


def argos3(experiment: pathlib.Path, seconds=60):
    """Runs an experiment file as a user does."""
    return subprocess.run([FOUND["program"], "-n", "-c", experiment], capture_output=True,
                          text=True, timeout=seconds, cwd=experiment.parent,
                          env=os.environ | {"LD_LIBRARY_PATH": FOUND["libraries"]})


def changed(folder: pathlib.Path, robot: str, *replacements) -> pathlib.Path:
    """The experiment that CMake made of hop count, 2 s long and with replacements."""
    text = (BUILD / f"argos/hop_count_{robot}.argos").read_text()
    for old, new in (('length="120"', 'length="2"'), *replacements):
        text, times = re.subn(old, new, text)
        assert times > 0, old
    path = folder / "changed.argos"
    path.write_text(text)
    return path


def check_runs(folder, program, robot, runs):
    """As many runs succeed by the suite's criteria as there are."""
    done = suite(folder, "run", program, "--platform", f"argos-{robot}", "--runs", runs,
                 "--seed", 3001)
    assert done.returncode == 0, done.stderr
    assert [r["success"] for r in results(done)] == [True] * runs


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("program", ["hop_count", "hop_count_two_seeds", "edge_following"])
def test_a_run_succeeds(tmp_path, robot, program):
    check_runs(tmp_path, program, robot, 1)


@pytest.mark.field
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("program", ["hop_count", "hop_count_two_seeds", "edge_following"])
def test_ten_of_ten_runs_succeed(tmp_path, robot, program):
    check_runs(tmp_path, program, robot, 10)


@pytest.mark.field
@pytest.mark.parametrize("robot", ROBOTS)
def test_fireflies_synchronise(tmp_path, robot):
    check_runs(tmp_path, "firefly", robot, 10)


@pytest.fixture
def screen():
    """DISPLAY of a screen that nobody sees."""
    if shutil.which("Xvfb") is None:
        pytest.skip("no Xvfb (apt-get install xvfb)")
    if not list(pathlib.Path(FOUND["libraries"]).glob("libargos3plugin_simulator_qtopengl.*")):
        pytest.skip("ARGoS was built without its window")
    reader, writer = os.pipe()
    with subprocess.Popen(["Xvfb", "-displayfd", str(writer), "-screen", "0", "800x600x24"],
                          pass_fds=[writer], stderr=subprocess.DEVNULL) as server:
        os.close(writer)
        with os.fdopen(reader) as told:
            number = told.readline().strip()  # ends when it is ready, or has ended
        assert number, "Xvfb did not start"
        try:
            yield f":{number}"
        finally:
            server.terminate()


def start_window(folder, screen, *arguments):
    return subprocess.Popen([SUITE, "run", "hop_count", "--platform", f"argos-{ROBOTS[0]}",
                             "--view", *arguments], cwd=folder, env=ENVIRONMENT | {
                                 "DISPLAY": screen, "XDG_RUNTIME_DIR": str(folder)},
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_line(folder, runner, contains: str):
    """Until the log that is being written has a line with this."""
    deadline = time.monotonic() + 60
    while not any(contains in path.read_text() for path in folder.glob("suite-logs/.*")
                  if path.suffix not in (".argos", ".scenario")):
        assert time.monotonic() < deadline and runner.poll() is None
        time.sleep(0.05)


def test_the_window_shows_the_run_that_is_logged_without_it(tmp_path, screen):
    """It stays open when the run is over; Ctrl-C then ends it, with a whole log."""
    with start_window(tmp_path, screen, "--seconds", "2") as runner:
        wait_for_line(tmp_path, runner, '"event":"air"')
        runner.send_signal(signal.SIGINT)
        output, errors = runner.communicate(timeout=60)
    seen, = [json.loads(line) for line in output.splitlines()]
    assert "interrupted" not in seen, errors
    shown = (tmp_path / seen["log"]).read_bytes()
    suite(tmp_path, "run", "hop_count", "--platform", f"argos-{ROBOTS[0]}", "--seconds", 2)
    assert (tmp_path / seen["log"]).read_bytes() == shown


def test_ctrl_c_closes_a_window_that_is_running(tmp_path, screen):
    with start_window(tmp_path, screen, "--seconds", "1000") as runner:
        wait_for_line(tmp_path, runner, '"event":"received"')
        runner.send_signal(signal.SIGINT)
        output, errors = runner.communicate(timeout=60)
    assert runner.returncode == 130 and json.loads(output)["interrupted"], errors


@pytest.mark.parametrize("platform, says", [
    ("sim-kilobot", "sim-kilobot has no window of its own"),
    (f"argos-{ROBOTS[0]}", "DISPLAY is not set")])
def test_where_there_is_no_window_one_line_says_so(tmp_path, monkeypatch, platform, says):
    if platform != "sim-kilobot" and not list(
            pathlib.Path(FOUND["libraries"]).glob("libargos3plugin_simulator_qtopengl.*")):
        says = "was built without its window"
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.setitem(ENVIRONMENT, name, "")
    done = suite(tmp_path, "run", "hop_count", "--platform", platform, "--view")
    assert done.returncode == 1 and says in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_same_seed_gives_the_same_bytes_also_with_threads(tmp_path, robot, monkeypatch):
    log = tmp_path / f"suite-logs/hop_count-argos-{robot}-36-5.jsonl"
    assert suite(tmp_path, "run", "hop_count", "--platform", f"argos-{robot}", "--seed",
                 5).returncode == 0
    assert suite(tmp_path, "replay", log).stdout == "same bytes\n"
    header = tmp_path / "scenario"
    header.write_text(log.read_text().split("\n", 1)[0] + "\n")
    experiment = tmp_path / "threads.argos"
    experiment.write_text(argos.experiment(
        argos.read_template(robot), json.loads(header.read_text()), robot, BUILD / "argos",
        tmp_path / "threads.jsonl", header, threads=2))
    done = argos3(experiment)
    assert done.returncode == 0 and "Using 2 parallel threads" in done.stdout, done.stderr
    assert (tmp_path / "threads.jsonl").read_bytes() == log.read_bytes()


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_experiments_that_cmake_makes_run(tmp_path, robot):
    done = argos3(changed(tmp_path, robot))
    assert done.returncode == 0 and done.stderr == ""
    assert "swarmtalk: 36 robots, 2 s simulated" in done.stdout


def children(parent: int) -> list[int]:
    """Processes that a process has started, with a sleep between two looks only."""
    path = pathlib.Path(f"/proc/{parent}/task/{parent}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


@pytest.mark.parametrize("killed", ["simulator", "runner"])
def test_whoever_is_killed_nothing_is_left_behind(tmp_path, killed):
    """Neither a process nor shared memory, which the plugin's own controllers leave: there is none
    while it runs."""
    with subprocess.Popen([SUITE, "run", "hop_count", "--platform", f"argos-{ROBOTS[0]}",
                           "--seconds", "100000"], cwd=tmp_path, env=ENVIRONMENT,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as runner:
        deadline = time.monotonic() + 60
        while not any(p.stat().st_size > 1000 for p in tmp_path.glob("suite-logs/.*jsonl*")
                      if p.suffix not in (".argos", ".scenario")):
            assert time.monotonic() < deadline and runner.poll() is None
            time.sleep(0.01)
        simulator, = children(runner.pid)
        assert children(simulator) == [], "a process per robot"
        mapped = pathlib.Path(f"/proc/{simulator}/maps").read_text()
        assert "/dev/shm/" not in mapped, "shared memory"
        os.kill(simulator if killed == "simulator" else runner.pid, signal.SIGKILL)
        errors = runner.communicate(timeout=60)[1]
        if killed == "simulator":
            assert runner.returncode == 1 and "argos3 ended with -9" in errors
        while pathlib.Path(f"/proc/{simulator}/stat").exists():
            assert time.monotonic() < deadline + 60, "the simulator goes on"
            time.sleep(0.01)
    # The plugin's are called so; others' on this machine are not ours to judge.
    assert not [name for name in os.listdir("/dev/shm") if name.startswith(f"{simulator}_")]


BAD = {
    "ticks": ('ticks_per_second="31"', 'ticks_per_second="10"', 'write ticks_per_second="31"'),
    "small": ('arena size="[0-9,]*"', 'arena size="0.5,0.5,1"', "arena is 0.5 m wide"),
    "outside": ('position="[^"]*"', 'position="50,0,0"', "outside the arena"),
    "range": ('(communication|rab)_range="[^"]*"', r'\1_range="750"', "counts in metres"),
    "params": ('role="1"', 'rôle="1"', "has no attribute"),
    "text": ('role="1"', 'role="seed"', 'role="seed": it is a whole number'),
    "spread": ('spread_us="[0-9]*"', 'spread_us="-5"', 'power_on_spread_us="-5"'),
    "indices": ('index="7"', 'index="8"', 'no robot with index="7"'),
    "program": ('library="([^"]*)hop_count', r'library="\1hip_count', "hip_count"),
    "label": ("<hop_count_", "<hip_count_", "hip_count"),
}


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("name", BAD)
def test_a_bad_experiment_file_ends_with_one_clear_line(tmp_path, robot, name):
    old, new, says = BAD[name]
    replacements = [(old, new)]
    if name == "label":
        replacements.append(("</hop_count_", "</hip_count_"))
    done = argos3(changed(tmp_path, robot, *replacements))
    assert done.returncode == 1 and says in argos.last_words(done.stderr), done.stderr


@pytest.mark.parametrize("line, says", [
    ("radio.period_us = 1000", "[radio] has no key 'period_us'"),
    ("body.diameter_mm = 5", "[body] has no key"), ("[[fault]]\nkind = 'death'", "no faults"),
    ("seed = 0", "must be a whole number from 1 to"), ("radio.loss = 2", "[radio] loss is 2")])
def test_what_argos_cannot_do_is_refused_in_one_line(tmp_path, line, says):
    (tmp_path / "s.toml").write_text(f"program = 'hop_count'\n{line}\n")
    done = suite(tmp_path, "run", "--scenario", "s.toml", "--platform", f"argos-{ROBOTS[0]}")
    assert done.returncode == 1 and says in done.stderr and done.stderr.count("\n") == 1


def test_loss_reaches_the_robots(tmp_path):
    (tmp_path / "s.toml").write_text("program = 'hop_count'\nradio.loss = 0.9\nseconds = 12\n")
    for robot in ROBOTS:
        done = suite(tmp_path, "run", "--scenario", "s.toml", "--platform", f"argos-{robot}")
        assert 0.05 < results(done)[0]["delivery"] < 0.15


PROGRAM = """
#pragma once
#include "platforms/robot.hpp"
namespace mine {
template <class Robot>
class Blink {
 public:
  explicit Blink(Robot& robot) : robot_(robot) {}
  void setup() { robot_.log("hello", 1); }
  void loop() { robot_.led(robot_.clock() % 62 < 31 ? swarmtalk::platforms::kRed
                                                    : swarmtalk::platforms::kOff); }
 private:
  Robot& robot_;
};
}  // namespace mine
"""


def test_a_program_outside_this_tree_becomes_both_modules_by_one_line(tmp_path):
    (tmp_path / "blink.hpp").write_text(PROGRAM)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(mine CXX)\n"
        f"include({ROOT}/platforms/argos/SwarmtalkArgos.cmake)\n"
        "swarmtalk_argos_program(blink HEADER blink.hpp CLASS mine::Blink)\n")
    prefix = pathlib.Path(FOUND["libraries"]).parents[1]
    for command in (["-S", ".", "-B", "build", "-G", "Ninja",
                     f"-DSWARMTALK_ARGOS_PREFIX={prefix}"], ["--build", "build"]):
        done = subprocess.run(["cmake", *command], cwd=tmp_path, capture_output=True, text=True,
                              timeout=280)
        assert done.returncode == 0, done.stdout + done.stderr
    for robot in ROBOTS:
        path = tmp_path / f"build/argos/blink_{robot}.argos"
        path.write_text(path.read_text().replace('length="120"', 'length="2"'))
        done = argos3(path)
        assert done.returncode == 0 and "36 robots, 2 s simulated" in done.stdout, done.stderr
