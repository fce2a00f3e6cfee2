"""Several sends in a row by a program in C: they arrive, or it is told why not. (In C++:
tests/unit/client_lib/client_sending_test.cpp; in Python: tests/python/behaviour/.)"""
import json
import os
import re
import signal
import subprocess

import pytest

from conftest import ROOT, next_line, one_line, program, run

NO_ROOM = """import swarmtalk
robot = swarmtalk.Client("p")
robot.advertise("short", queue=7).send("shorter is taken")
try:
    robot.advertise("long").send("16 wait unless the program says otherwise")
    robot.run(1)
except swarmtalk.Error as error:
    print(error)
"""


ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "client_lib/python")}


def two_sends_in_a_row_both_arrive(lab):
    sub = lab.start_sub(2, "two", "-C", "2", "-W", "60")
    done = lab.execute(1, program("two_sends"), "2", "wait")
    assert (done.returncode, done.stdout, done.stderr) == (0, "0 refused\n", "")
    out, errors = sub.communicate(timeout=90)
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


def what_a_program_sent_before_it_ended_arrives(lab, *words):
    for _ in range(4):
        sub = lab.start_sub(2, "two", "-C", "9", "-W", "60")
        done = lab.execute(1, *words, env=ENVIRONMENT)
        assert done.stderr == ""
        assert done.returncode == (-9 if "killed" in words else 0)
        out, errors = sub.communicate(timeout=90)
        assert sub.returncode == 0, out + errors
        assert re.findall(r'robot 1  "(.)"', out) == list("012345678"), (words[0], out)


def what_a_program_had_not_written_when_it_ended_arrives(lab):
    """More than the socket holds, of a Client that nobody destroys."""
    count = 40
    sub = lab.start_sub(2, "two", "-C", count, "-W", "60", "--json")
    done = lab.execute(1, *IN_C_PLUS_PLUS, count, "long", env=ENVIRONMENT)
    assert (done.returncode, done.stderr) == (0, "")
    out, errors = sub.communicate(timeout=90)
    assert sub.returncode == 0, errors
    heard = [int(json.loads(line)["text"].split()[0]) for line in out.splitlines()]
    assert heard == list(range(count))


def a_handler_that_ends_a_program_does_not_wait_for_what_it_cut_short(lab):
    """Its send() holds the lock that the end would want."""
    for after_ms in range(1, 31):
        done = lab.execute(1, *IN_C_PLUS_PLUS, after_ms, "handler", env=ENVIRONMENT, timeout=60)
        assert done.returncode == 0, (after_ms, done.stderr)


def what_was_refused_at_the_end_is_told(lab, *words):
    done = lab.execute(1, *words, env=ENVIRONMENT)
    assert done.returncode == 0
    one_line(done.stderr, "publishes more than 1 message per second.*publish more slowly")


def a_daemon_that_has_gone_meanwhile_is_told(lab, how, *programs):
    daemon = lab.pid(1)
    started = [lab.start(1, *words, env=ENVIRONMENT, stdin=subprocess.PIPE) for words in programs]
    for process in started:
        assert next_line(process) == "ready"
    os.kill(daemon, signal.SIGKILL if how == "killed" else signal.SIGSTOP)
    try:
        told = [process.communicate("\n", timeout=60)[1] for process in started]
    finally:
        if how == "stopped":
            os.kill(daemon, signal.SIGCONT)
    for errors in told:
        one_line(errors, "was gone when" if how == "killed" else "did not answer when",
                 "this program ended: whether its last messages left is not known")


def more_than_can_wait_are_told_and_counted(lab):
    done = lab.execute(1, program("two_sends"), "1000", "wait")
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


def answers_that_python_keeps_to_its_end_are_counted_as_well(lab, keep):
    done = lab.execute(1, "/usr/bin/python3", "-c", KEPT.format(keep=keep), env=ENVIRONMENT)
    lines = done.stderr.splitlines()
    assert len(lines) >= 2, done.stderr  # at once, and how many more at the end
    told = [re.search(r"(?:channel two:|since then) (a|[0-9]+) ", line)[1] for line in lines]
    refused = 200 - int(done.stdout)
    assert sum(1 if each == "a" else int(each) for each in told) == refused, done.stderr


def who_wants_no_queue_expects_to_be_refused(lab):
    done = lab.execute(1, program("two_sends"), "1000", "no-queue")
    assert int(done.stdout.split()[0]) > 100
    assert done.stderr == ""


def a_daemon_with_short_queues_says_so_to_who_asks_for_none_of_its_own(lab):
    done = lab.execute(1, "/usr/bin/python3", "-c", NO_ROOM, env=ENVIRONMENT)
    assert done.returncode == 0, done.stderr
    assert ("a publisher's queue of 16 messages is longer than publish_queue_max under [limits] of "
            "the daemon's configuration, 7; ask for a shorter one, or for none") in done.stdout


IN_C_PLUS_PLUS, IN_C, BY_PYTHON = [program("leaving")], [program("two_sends")], [
    "/usr/bin/python3", "-c", IN_PYTHON]


def test_what_a_program_sends_before_it_ends_arrives_or_it_is_told(udp_lab):
    lab = udp_lab(2)
    two_sends_in_a_row_both_arrive(lab)
    for words in ((*IN_C_PLUS_PLUS, "9"), (*IN_C_PLUS_PLUS, "9", "callback"),
                  (*IN_C, "9", "leave"), BY_PYTHON, (*BY_PYTHON, "killed")):
        what_a_program_sent_before_it_ended_arrives(lab, *words)
    what_a_program_had_not_written_when_it_ended_arrives(lab)
    a_handler_that_ends_a_program_does_not_wait_for_what_it_cut_short(lab)
    for how in ("stopped", "killed"):
        a_daemon_that_has_gone_meanwhile_is_told(lab, how, (*IN_C_PLUS_PLUS, "2", "wait"),
                                                 (*IN_C, "2", "close", "wait"),
                                                 (*BY_PYTHON, "wait"))


def test_what_a_daemons_limits_refuse_is_told(udp_lab, tmp_path):
    def lab(text):
        (tmp_path / "base.toml").write_text(text)
        return udp_lab(1, "--config", tmp_path / "base.toml")

    slow = lab("[limits]\npublish_rate_hz = 1\npublish_burst = 1\n")
    for words in ((*IN_C_PLUS_PLUS, "2"), (*IN_C, "2", "close"), (*IN_C, "2", "leave"),
                  BY_PYTHON):
        what_was_refused_at_the_end_is_told(slow, *words)
    paced = lab("[links.wifi]\nrate_hz = 5\n")
    more_than_can_wait_are_told_and_counted(paced)
    who_wants_no_queue_expects_to_be_refused(paced)
    for keep in ("pass", "kept.append(answer)"):  # the last answer, all of them
        answers_that_python_keeps_to_its_end_are_counted_as_well(paced, keep)
    a_daemon_with_short_queues_says_so_to_who_asks_for_none_of_its_own(
        lab("[limits]\npublish_queue_max = 7\n"))


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
