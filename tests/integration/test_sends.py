"""Several sends in a row by a program in C: they arrive, or it is told why not. (In C++:
tests/unit/client_lib/client_sending_test.cpp; in Python: tests/python/behaviour/.)"""
import os
import re
import signal
import subprocess

import pytest

from conftest import ROOT, one_line, program, run

NO_ROOM = """import swarmtalk
robot = swarmtalk.Client("p")
robot.advertise("short", queue=7).send("shorter is taken")
try:
    robot.advertise("long").send("16 wait unless the program says otherwise")
    robot.run(1)
except swarmtalk.Error as error:
    print(error)
"""


def test_two_sends_in_a_row_both_arrive(udp_lab):
    lab = udp_lab(2)
    sub = lab.start_sub(2, "two", "-C", "2", "-W", "20")
    done = lab.execute(1, program("two_sends"), "2", "wait")
    assert (done.returncode, done.stdout, done.stderr) == (0, "0 refused\n", "")
    out, errors = sub.communicate(timeout=30)
    assert sub.returncode == 0, out + errors
    assert re.findall(r'robot 1  "(.)"', out) == ["0", "1"], out


IN_PYTHON = """import os, sys, swarmtalk
publisher = swarmtalk.Client("leaving").advertise("two")
if sys.argv[1:] == ["wait"]:
    print("ready", flush=True)
    sys.stdin.readline()
for number in range(9):
    assert publisher.send(str(number)) or sys.argv[1:] == ["wait"]
if sys.argv[1:] == ["killed"]:
    os.kill(os.getpid(), 9)
"""


@pytest.mark.parametrize("words", [
    pytest.param([program("leaving"), "9"], id="C++"),
    pytest.param([program("two_sends"), "9", "leave"], id="C"),
    pytest.param(["/usr/bin/python3", "-c", IN_PYTHON], id="Python"),
    pytest.param(["/usr/bin/python3", "-c", IN_PYTHON, "killed"], id="killed"),
])
def test_what_a_program_sent_before_it_ended_arrives(udp_lab, words):
    lab = udp_lab(2)
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")}
    for _ in range(4):
        sub = lab.start_sub(2, "two", "-C", "9", "-W", "20")
        done = lab.execute(1, *words, env=environment)
        assert done.stderr == ""
        assert done.returncode == (-9 if "killed" in words else 0)
        out, errors = sub.communicate(timeout=30)
        assert sub.returncode == 0, out + errors
        assert re.findall(r'robot 1  "(.)"', out) == list("012345678"), out


@pytest.mark.parametrize("words", [
    pytest.param([program("leaving"), "2"], id="C++"),
    pytest.param([program("two_sends"), "2", "close"], id="C"),
    pytest.param(["/usr/bin/python3", "-c", IN_PYTHON], id="Python"),
])
def test_what_was_refused_at_the_end_is_told(udp_lab, tmp_path, words):
    (tmp_path / "base.toml").write_text("[limits]\npublish_rate_hz = 1\npublish_burst = 1\n")
    lab = udp_lab(1, "--config", tmp_path / "base.toml")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")}
    done = lab.execute(1, *words, env=environment)
    assert done.returncode == 0
    one_line(done.stderr, "publishes more than 1 message per second.*publish more slowly")


@pytest.mark.parametrize("how", ["killed", "stopped"])
@pytest.mark.parametrize("words", [
    pytest.param([program("leaving"), "2", "wait"], id="C++"),
    pytest.param([program("two_sends"), "2", "close", "wait"], id="C"),
    pytest.param(["/usr/bin/python3", "-c", IN_PYTHON, "wait"], id="Python"),
])
def test_a_daemon_that_has_gone_meanwhile_is_told(udp_lab, words, how):
    lab = udp_lab(1)
    daemon = lab.pid(1)
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")}
    process = lab.start(1, *words, env=environment, stdin=subprocess.PIPE)
    assert process.stdout.readline() == "ready\n"
    os.kill(daemon, signal.SIGKILL if how == "killed" else signal.SIGSTOP)
    try:
        _, errors = process.communicate("\n", timeout=30)
    finally:
        if how == "stopped":
            os.kill(daemon, signal.SIGCONT)
    one_line(errors, "was gone when" if how == "killed" else "did not answer when",
             "this program ended: whether its last messages left is not known")


def test_more_than_can_wait_are_told_and_counted(udp_lab):
    done = udp_lab(1).execute(1, program("two_sends"), "1000", "wait")
    refused = int(done.stdout.split()[0])
    assert refused > 100
    lines = done.stderr.splitlines()
    assert 1 <= len(lines) <= 2, done.stderr  # at once, and how many more at the end
    told = [int(line.split()[3]) for line in lines[1:]]
    assert all(0 < count < 1000 for count in told), done.stderr
    assert "channel two: a message was not sent: " in lines[0]
    assert "messages are not confirmed yet: call run() or process() between sends" in lines[0]


KEPT = """import swarmtalk
publisher = swarmtalk.Client("keeping").advertise("two")
kept = []
for number in range(200):
    answer = publisher.send("x" * 1000)
    {keep}
print(publisher._publish_number)
"""


@pytest.mark.parametrize("keep", ["pass", "kept.append(answer)"], ids=["the_last", "all"])
def test_answers_that_python_keeps_to_its_end_are_counted_as_well(udp_lab, tmp_path, keep):
    (tmp_path / "base.toml").write_text("[links.wifi]\nrate_hz = 5\n")
    done = udp_lab(1, "--config", tmp_path / "base.toml").execute(
        1, "/usr/bin/python3", "-c", KEPT.format(keep=keep),
        env={**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")})
    lines = done.stderr.splitlines()
    assert len(lines) >= 2, done.stderr  # at once, and how many more at the end
    told = [re.search(r"(?:channel two:|since then) (a|[0-9]+) ", line)[1] for line in lines]
    refused = 200 - int(done.stdout)
    assert sum(1 if each == "a" else int(each) for each in told) == refused, done.stderr


def test_who_wants_no_queue_expects_to_be_refused(udp_lab):
    done = udp_lab(1).execute(1, program("two_sends"), "1000", "no-queue")
    assert int(done.stdout.split()[0]) > 100
    assert done.stderr == ""


def test_a_daemon_with_short_queues_says_so_to_who_asks_for_none_of_its_own(udp_lab, tmp_path):
    (tmp_path / "base.toml").write_text("[limits]\npublish_queue_max = 7\n")
    lab = udp_lab(1, "--config", tmp_path / "base.toml")
    done = lab.execute(1, "/usr/bin/python3", "-c", NO_ROOM,
                       env={**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")})
    assert done.returncode == 0, done.stderr
    assert ("a publisher's queue of 16 messages is longer than publish_queue_max under [limits] of "
            "the daemon's configuration, 7; ask for a shorter one, or for none") in done.stdout


@pytest.mark.logic
def test_a_thrown_away_answer_of_send_is_a_warning(tmp_path):
    include = ROOT / "client_lib/include"
    (tmp_path / "c.c").write_text("#include <swarmtalk/swarmtalk.h>\n"
                                  "void f(swarmtalk_publisher* p) { swarmtalk_send(p, 0, 0); }\n")
    done = run("gcc", "-std=c99", "-c", "-o", tmp_path / "c.o", "-I", include, tmp_path / "c.c")
    assert done.returncode == 0 and "c.c:2:" in done.stderr, done.stderr
    (tmp_path / "cpp.cpp").write_text("""#include <span>
#include <swarmtalk/client.hpp>
void f(swarmtalk::Publisher& p) {
  p.send("text");
  p.send(std::string("text"));
  p.send(7);
  (void)p.send(std::span<const std::uint8_t>());
}
""")
    done = run("g++", "-std=c++20", "-fsyntax-only", "-I", include, tmp_path / "cpp.cpp")
    assert done.returncode == 0, done.stderr
    for line in (4, 5, 6):
        assert f"cpp.cpp:{line}:" in done.stderr, done.stderr
    assert "cpp.cpp:7:" not in done.stderr
