"""swarmtalk-lab --medium wifi: a lab in a guest, by the verbs of every lab."""
import json
import os
import pathlib
import signal
import subprocess
import time

import guest
import pytest

pytestmark = pytest.mark.field
UP_S = 240


@pytest.fixture(scope="module")
def name():
    guest.needs_guest()
    if not os.path.exists(guest.program("swarmtalk-lab")):
        pytest.skip("swarmtalk-lab is not built")
    return f"wifi{os.getpid()}"


def lab(name, *words, timeout=60):
    command = [guest.program("swarmtalk-lab"), "--name", name, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout,
                          stdin=subprocess.DEVNULL)


def processes_of(name):
    """Processes that name this lab's folder."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes()
        except OSError:
            continue
        if f"/{name}/wifi".encode() in words:
            found[int(process.name)] = words.replace(b"\0", b" ").decode()[:200]
    return found


def wait_until_gone(name):
    deadline = time.monotonic() + 60
    while processes_of(name):
        assert time.monotonic() < deadline, processes_of(name)
        time.sleep(0.2)


@pytest.fixture(scope="module")
def up(name):
    done = lab(name, "up", 2, "--medium", "wifi", "--wifi-mode", "ibss", timeout=UP_S)
    assert done.returncode == 0, done.stderr
    yield name
    done = lab(name, "down")
    assert done.returncode == 0 and not done.stderr, done.stderr
    wait_until_gone(name)
    assert lab(name, "status").returncode == 1


def test_status_shows_daemons_that_are_in_the_guest(up):
    done = lab(up, "status", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    robots = [json.loads(line) for line in done.stdout.splitlines()]
    assert [robot["node_id"] for robot in robots] == [1, 2]
    assert all(robot["answers"] and robot["links"][0]["up"] for robot in robots), robots


def test_a_command_runs_as_a_robot_on_its_radio(up):
    done = lab(up, "exec", 2, "--", "sh", "-c",
               "iw dev wlan0 info | grep type; echo $SWARMTALK_ROBOT; echo fault >&2; exit 7")
    assert done.returncode == 7, done
    assert done.stdout.split() == ["type", "IBSS", "2"] and done.stderr == "fault\n", done


def test_robots_hear_each_other_and_the_air_can_be_worsened(up):
    cli = guest.program("swarmtalk-cli")
    command = [guest.program("swarmtalk-lab"), "--name", up, "exec", "2", "--", cli]
    listener = subprocess.Popen([*command, "sub", "hello", "-C", "5", "-W", "60"], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        done = lab(up, "exec", 1, "--", cli, "pub", "hello", "hi", "--repeat", 60, "--rate", 3)
        assert done.returncode == 0, done.stderr
        out, errors = listener.communicate(timeout=90)
    finally:
        listener.kill()
    assert len(out.splitlines()) == 5 and "distance 0.50 m" in out, (out, errors)
    # Our own medium takes commands from a pipe in the guest.
    done = lab(up, "exec", 1, "--", "sh", "-c", "[ ! -p /run/air ] || { echo 'loss r1 r2 1' > "
               "/run/air; sleep 1; tail -n 1 /run/air.log; }")
    assert done.stdout in ("", '{"ok":true}\n'), done


def test_what_runs_in_a_lab_ends_with_it_when_that_is_killed(name):
    own = name + "k"
    command = [guest.program("swarmtalk-lab"), "--name", own, "run", "1", "--medium", "wifi",
               "--", "sleep", "1000"]
    running = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    deadline = time.monotonic() + UP_S
    while "swarmtalkd" not in str(processes_of(own)):  # its daemon starts
        assert running.poll() is None and time.monotonic() < deadline
        time.sleep(0.2)
    running.send_signal(signal.SIGKILL)
    running.wait()
    wait_until_gone(own)
    lab(own, "down")
    assert own not in os.listdir(pathlib.Path(folder_of_labs()))


def test_a_start_that_is_killed_while_the_guest_boots_leaves_nothing_behind(name):
    own = name + "s"
    command = [guest.program("swarmtalk-lab"), "--name", own, "up", "1", "--medium", "wifi"]
    for moment in ("guest_keeper", "qemu-system"):
        starting = subprocess.Popen(command, stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + UP_S
        while moment not in str(processes_of(own)):
            assert starting.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        starting.kill()
        starting.wait()
        wait_until_gone(own)
        deadline = time.monotonic() + 30
        while own in os.listdir(folder_of_labs()):
            assert time.monotonic() < deadline
            time.sleep(0.1)
        assert "its start was ended" in lab(own, "down").stderr  # which forgets that word


def folder_of_labs():
    if os.geteuid() == 0:
        return "/run/swarmtalk-lab"
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"{runtime}/swarmtalk-lab" if runtime else f"/tmp/swarmtalk-lab-{os.geteuid()}"
