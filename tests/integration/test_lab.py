"""swarmtalk-lab: comes up, runs commands as robots, and leaves nothing behind."""
import contextlib
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import urllib.request

import pytest
from conftest import ROOT, needs_root, next_line, one_line, program, run, wait_for


def is_running(pid):
    """False for a zombie too: reaping is the business of whoever adopted it."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def namespaces_of(name):
    return [n.name for n in pathlib.Path("/run/netns").glob(f"swarmtalk-{name}-*")]


def daemons_of(name):
    return run("pgrep", "-f", f"swarmtalkd --config .*/{name}/").stdout.split()


def leftovers(name):
    """Namespaces and processes of a lab."""
    processes = run("pgrep", "-af", f"swarmtalk-lab/{name}/").stdout.splitlines()
    return namespaces_of(name) + processes


def test_up_status_exec_down(bridge_lab):
    lab = bridge_lab(3)
    a_lab_of_another_user_is_told_apart_from_none(lab)
    exec_all_prefixes_each_line_and_returns_the_first_failure(lab)
    state = lab.state()
    assert [robot["robot"] for robot in state] == [1, 2, 3]
    assert all(robot["answers"] for robot in state)
    assert [(r["x_m"], r["y_m"]) for r in state] == [(0, 0), (0.5, 0), (0, 0.5)]
    done = lab.execute(2, "/bin/sh", "-c", "echo $SWARMTALK_ROBOT; exit 7")
    assert (done.stdout, done.returncode) == ("2\n", 7)
    done = lab.execute(1, "/bin/sh", "-c", "sleep 300 >/dev/null 2>&1 & echo $!")
    left_in_the_background = int(done.stdout)
    assert is_running(left_in_the_background)
    assert lab.down().returncode == 0
    assert leftovers(lab.name) == []
    assert not is_running(left_in_the_background)


def exec_all_prefixes_each_line_and_returns_the_first_failure(lab):
    done = lab.execute("all", "/bin/sh", "-c", "echo a; printf b; exit $((SWARMTALK_ROBOT - 1))")
    assert sorted(done.stdout.splitlines()) == [
        f"robot {robot} | {line}" for robot in (1, 2, 3) for line in "ab"]
    assert done.returncode == 1


def run_leaves_nothing_behind(medium):
    name = f"run{os.getpid()}{medium}"
    done = run(program("swarmtalk-lab"), "--name", name, "run", "2", "--medium", medium, "--",
               program("swarmtalk-lab"), "status", "--json")
    assert done.returncode == 0, done.stderr
    assert len([json.loads(line) for line in done.stdout.splitlines()]) == 2
    assert leftovers(name) == []


def an_interrupted_run_leaves_nothing_behind(by):
    name = f"int{os.getpid()}"
    process = subprocess.Popen([program("swarmtalk-lab"), "--name", name, "run", "2", "--",
                                "/bin/sh", "-c", "echo ready; exec sleep 60"],
                               stdout=subprocess.PIPE, text=True)
    assert next_line(process) == "ready"
    process.send_signal(by)
    assert process.wait(timeout=60) == 128 + by
    process.stdout.close()
    assert leftovers(name) == []


def an_interrupted_start_leaves_nothing_behind():
    name = f"start{os.getpid()}"
    process = subprocess.Popen([program("swarmtalk-lab"), "--name", name, "up", "12"],
                               stderr=subprocess.PIPE, text=True)
    wait_for(lambda: leftovers(name), what="the first namespace")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    one_line(errors, "interrupted")
    assert process.returncode == 1
    assert leftovers(name) == []


def start_until(name, medium, robots, moment):
    """`up` that has come as far as `moment`, and does not become ready."""
    process = subprocess.Popen(
        [program("swarmtalk-lab"), "--name", name, "up", str(robots), "--medium", medium,
         "--daemon", ROOT / "tests/support/silent/swarmtalkd"], stdout=subprocess.DEVNULL)
    try:
        wait_for(moment, what="the lab to begin")
    except BaseException:
        process.wait(timeout=60)
        run(program("swarmtalk-lab"), "--name", name, "down")
        raise
    return process


def kill(process):
    process.kill()
    process.wait()


def nothing_is_left(name):
    wait_for(lambda: not leftovers(name) and not lab_folder(name).exists(),
             what="the lab to be taken down")
    assert not run("pgrep", "-f", f"swarmtalk-lab --name {name} ").stdout


def lab_folder(name):
    return pathlib.Path("/run/swarmtalk-lab") / name


def a_start_that_is_killed_leaves_nothing_behind(medium, until):
    """@param until  when it is killed"""
    name = f"cut{os.getpid()}"
    kill(start_until(name, medium, 12, lambda: until(name)))
    nothing_is_left(name)
    one_line(run(program("swarmtalk-lab"), "--name", name, "down").stderr,
             "was taken down: its start was ended|no lab called")


def after_a_start_that_is_killed_the_next_may_begin_at_once():
    name = f"again{os.getpid()}"
    kill(start_until(name, "udp", 12, lambda: daemons_of(name)))
    done = run(program("swarmtalk-lab"), "--name", name, "run", "1", "--medium", "udp", "--",
               "echo", "ready")
    assert (done.stdout, done.returncode) == ("ready\n", 0), done.stderr
    nothing_is_left(name)


def half_a_lab_is_named_and_taken_down(by):
    """Where what should have taken it down was killed as well."""
    name, tool = f"half{os.getpid()}", program("swarmtalk-lab")
    process = start_until(name, "bridge", 12, lambda: daemons_of(name))
    process.send_signal(signal.SIGSTOP)
    keeper = int(run("pgrep", "-o", "-P", process.pid).stdout)
    os.kill(keeper, signal.SIGKILL)
    kill(process)
    one_line(run(tool, "--name", name, "status").stderr, f"half a lab.*--name {name} down")
    one_line(run(tool, "--name", "nowhere", "status").stderr, f"{name} \\(left behind\\)")
    done = run(tool, "--name", name, *by)
    assert done.returncode == 0, done.stderr
    nothing_is_left(name)


def a_killed_run_is_cleaned_up_by_the_next():
    name = f"kill{os.getpid()}"
    process = subprocess.Popen([program("swarmtalk-lab"), "--name", name, "run", "1", "--",
                                "/bin/sh", "-c", "echo ready; sleep 1"],
                               stdout=subprocess.PIPE, text=True)
    assert next_line(process) == "ready"
    process.kill()
    process.wait()
    process.stdout.close()
    wait_for(lambda: not run("pgrep", "-f", f"swarmtalk-lab/{name}/robot").stdout,
             what="the daemon to follow the run")
    done = run(program("swarmtalk-lab"), "--name", name, "run", "1", "--", "true")
    assert done.returncode == 0, done.stderr
    assert leftovers(name) == []


@pytest.mark.logic
def test_mistakes_without_a_lab_get_one_line(tmp_path):
    tool = program("swarmtalk-lab")
    name = f"err{os.getpid()}"
    one_line(run(tool, "--name", name, "exec", "1", "--", "true").stderr, "swarmtalk-lab up")
    one_line(run(tool, "--name", name, "up", "1", "--medium", "udp", "--daemon",
                 "/nonexistent").stderr, "/nonexistent", "--daemon")
    assert run(tool, "up", "0").returncode == 2
    assert run(tool, "--name", "../x", "up", "1").returncode == 2
    assert run(tool, "--name", name, "exec", "1").returncode == 2
    bad = tmp_path / "bad.toml"
    for text, patterns in (("[channels]\nhello = \n", ["bad.toml:2"]),
                           ("[channels]\n\u00a0a = 1\n",
                            ["bad.toml:2: not TOML: column 1", "plain blank"]),
                           ("[node]\nnonsense = 1\n", ["robot 1", "nonsense"])):
        bad.write_text(text)
        done = run(tool, "--name", name, "up", "1", "--medium", "udp", "--config", bad)
        assert done.returncode == 1
        one_line(done.stderr, *patterns)
    done = run(tool, "--medium", "udp", "down")
    assert done.returncode == 2
    one_line(done.stderr, "--medium is for up and run")
    assert not leftovers(name)


def mistakes_with_a_lab_get_one_line(lab):
    one_line(lab.execute(3, "true").stderr, "'3' is not in this lab", "1 to 2")
    one_line(lab.execute("one", "true").stderr, "'one' names no robot")
    one_line(lab.execute(1, "/nonexistent").stderr, "/nonexistent: No such file")
    one_line(lab.tool("up", 2, "--medium", "udp").stderr, "is up", "down")


def the_name_may_stand_behind_the_verb():
    tool, name = program("swarmtalk-lab"), f"behind{os.getpid()}"
    done = run(tool, "run", "--name", name, "2", "--medium", "udp", "--",
               tool, "status", "--name", name, "--json")
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 2
    one_line(run(tool, "down", "--name", name).stderr, f"no lab called '{name}' is up")


def options_of_a_start_may_stand_before_the_verb():
    tool, name = program("swarmtalk-lab"), f"before{os.getpid()}"
    done = run(tool, "--medium", "udp", "--spacing", "2", "--name", name, "run", "2", "--",
               tool, "status", "--name", name, "--json")
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["x_m"] for line in done.stdout.splitlines()] == [0, 2]


@needs_root
def test_runs_leave_nothing_behind_however_they_end():
    for medium in ("bridge", "udp"):
        run_leaves_nothing_behind(medium)
    for by in (signal.SIGINT, signal.SIGTERM):
        an_interrupted_run_leaves_nothing_behind(by)
    an_interrupted_start_leaves_nothing_behind()
    for until in (lambda name: lab_folder(name).exists(), namespaces_of,
                  lambda name: len(namespaces_of(name)) > 6, daemons_of):
        a_start_that_is_killed_leaves_nothing_behind("bridge", until)
    a_start_that_is_killed_leaves_nothing_behind("udp", daemons_of)
    a_start_that_is_killed_leaves_nothing_behind(
        "radio", lambda name: (lab_folder(name) / "medium.log").exists())
    after_a_start_that_is_killed_the_next_may_begin_at_once()
    for by in (["down"], ["run", "1", "--medium", "udp", "--", "true"]):
        half_a_lab_is_named_and_taken_down(by)
    a_killed_run_is_cleaned_up_by_the_next()
    what_is_left_of_a_lab_whose_folder_is_gone_goes_with_the_command_that_is_named()
    the_name_may_stand_behind_the_verb()
    options_of_a_start_may_stand_before_the_verb()


def what_is_left_of_a_lab_whose_folder_is_gone_goes_with_the_command_that_is_named():
    name = f"gone-{os.getpid()}"
    lab = [program("swarmtalk-lab"), "--name", name]
    for moment in ("while its daemons run", "after they have ended"):
        assert run(*lab, "up", "2").returncode == 0
        if moment == "after they have ended":
            for pid in map(int, daemons_of(name)):
                os.kill(pid, signal.SIGKILL)
            wait_for(lambda: not daemons_of(name), what="the daemons to be gone")
        # As at a logout. Deleted where it is it might never be empty: daemons make sockets anew.
        gone = lab_folder(name).rename(lab_folder(f"{name}.gone"))
        shutil.rmtree(gone)
        told = run(*lab, "up", "2").stderr
        words = re.search("`swarmtalk-lab (.*)`", told).group(1).split()
        assert run(program("swarmtalk-lab"), *words).returncode == 0
        assert leftovers(name) == []


def a_lab_of_another_user_is_told_apart_from_none(lab):
    nobody = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups",
              program("swarmtalk-lab"), "--name", lab.name]
    for verb in ("status", "down"):
        one_line(run(*nobody, verb).stderr, f"the lab '{lab.name}' belongs to root",
                 "`sudo .*swarmtalk-lab", "start one of your own: swarmtalk-lab up 9 --medium udp")
    # It gets as far as to its daemon, which it cannot start: there is none of this name.
    done = run(*nobody, "run", "1", "--medium", "udp", "--daemon", "/none", "--", "true")
    one_line(done.stderr, "/none")


def the_labs_that_there_are_are_listed(*labs):
    done = run(program("swarmtalk-lab"), "--name", "nowhere", "status")
    one_line(done.stderr, r" \(there are: .*; choose with --name\)$", *(lab.name for lab in labs))


def a_pose_socket_of_the_configuration_is_one_for_each_robot(lab):
    for robot, place in ((1, (3.0, 1.0)), (2, (4.0, 2.0))):
        path = str(lab.state()[robot - 1]["socket"]).replace(".sock", ".pose")
        wait_for(lambda: f"x {place[0]:.3f} m  y {place[1]:.3f} m" in (
            text := told_pose(lab, robot, place, path)) and "told by the pose socket" in text,
            what="the pose of its own socket")


def told_pose(lab, robot, place, path):
    """What `pose get` says after the robot was told its place: a pose expires after two seconds."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.sendto(f"{place[0]} {place[1]} 0".encode(), path)
    return lab.cli(robot, "pose", "get").stdout


@pytest.mark.logic
def test_a_command_without_dashes_before_it_is_told_where_they_go():
    tool = program("swarmtalk-lab")
    for command in (["swarmtalk-cli", "sub", "hello"], ["swarmtalk-cli", "status", "--json"]):
        done = run(tool, "exec", "1", *command)
        assert done.returncode == 2
        one_line(done.stderr, "put -- before the command: swarmtalk-lab exec 1 -- COMMAND")
    one_line(run(tool, "run", "2", "--medium", "udp", "true").stderr, "swarmtalk-lab run 2 -- ")
    done = run(tool, "run", "3", "swarmtalk-lab", "exec", "all", "--", "./a.out")
    one_line(done.stderr, "put -- before the command: swarmtalk-lab run 3 -- COMMAND")
    done = run(tool, "exec", "2,3", "swarmtalk-lab", "status", "--", "x")
    one_line(done.stderr, "put -- before the command: swarmtalk-lab exec 2,3 -- COMMAND")
    done = run(tool, "run", "3", "--medum", "udp", "--", "./a.out")
    one_line(done.stderr, "no option '--medum'; did you mean '--medium'")
    one_line(run(tool, "status", "surplus").stderr, "surplus")


@pytest.mark.logic
@pytest.mark.parametrize("words, wanted", [
    (["up", "3", "--medium", "udp", "--loss", "1"], "--loss is for --medium radio, not udp; see"),
    (["--range", "0.1", "up", "3", "--medium", "wifi"], "--range is for --medium radio, not wifi"),
    (["run", "3", "--rate", "54", "--", "true"], "--rate is for --medium radio, not bridge"),
    (["up", "3", "--medium", "radio-udp", "--wifi-mode", "mesh"],
     "--wifi-mode is for --medium wifi, not radio-udp")])
def test_an_option_of_another_medium_is_refused(words, wanted):
    name = f"other{os.getpid()}"
    done = run(program("swarmtalk-lab"), "--name", name, *words)
    assert done.returncode == 2, done.stdout
    one_line(done.stderr, wanted)
    assert not leftovers(name)


@pytest.mark.logic
@pytest.mark.parametrize("words, wanted", [
    (["upp", "3"], r"no subcommand 'upp'; did you mean 'up'\? See swarmtalk-lab --help$"),
    (["--name", "x", "stauts"], "no subcommand 'stauts'; did you mean 'status'"),
    (["up", "--robtos", "3"], "no option '--robtos'; that is given without a name: "
                              "swarmtalk-lab up ROBOTS"),
    (["up", "3", "--medum=udp"], "no option '--medum'; did you mean '--medium'"),
    (["status", "--jsn"], "no option '--jsn'; did you mean '--json'"),
    (["medium", "stauts"], "did you mean 'status'"),
    (["help", "upp"], "no subcommand 'upp'; did you mean 'up'"),
    (["help", "medium", "stauts"], "no subcommand 'stauts'; did you mean 'status'"),
    (["up", "3", "--", "true"], "nothing may stand after --"),
    (["exec"], "exec needs I .robot: a number, 1,4-6 or all"),
    (["up", "three"], "ROBOTS: must be a whole number, 1 to 250, not three")])
def test_what_is_misspelt_is_told_with_the_nearest(words, wanted):
    done = run(program("swarmtalk-lab"), *words)
    assert done.returncode == 2
    one_line(done.stderr, wanted)


@pytest.mark.logic
@needs_root
def test_its_version_is_told_without_proc():
    done = run("unshare", "--mount", "sh", "-c",
               "umount --lazy /proc && exec \"$0\" -V", program("swarmtalk-lab"))
    assert done.returncode == 0, done.stderr
    assert re.match(r"\d+\.\d+", done.stdout)


def lines_on_a_terminal(columns, *words):
    pid, terminal = pty.fork()
    if pid == 0:
        os.execve(program("swarmtalk-lab"), ["swarmtalk-lab", *words],
                  {**os.environ, "COLUMNS": str(columns)})
    shown = b""
    with contextlib.suppress(OSError):  # its end
        while data := os.read(terminal, 4096):
            shown += data
    os.waitpid(pid, 0)
    os.close(terminal)
    return shown.decode().splitlines()


def status_fits_a_narrow_terminal(lab):
    for columns in (40, 80):
        lines = lines_on_a_terminal(columns, "--name", lab.name, "status")
        assert "frames sent" in " ".join(lines)
        assert all(len(line) <= columns for line in lines), lines


@pytest.mark.logic
@pytest.mark.parametrize("verb", ["up", "run", "exec"])
def test_a_help_page_fits_a_narrow_terminal(verb):
    lines = lines_on_a_terminal(40, verb, "--help")
    assert any(line.startswith("Usage: swarmtalk-lab " + verb) for line in lines)
    assert all(len(line) <= 40 for line in lines), lines


@pytest.mark.logic
@needs_root
def test_without_root_it_says_so_in_one_line():
    done = run("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups",
               program("swarmtalk-lab"), "up", "2", "--medium", "bridge")
    one_line(done.stderr, "root", "--medium udp")
    assert done.returncode == 1


def test_a_lab_is_alive_before_any_program_runs(radio_lab, tmp_path):
    """Sixteen robots on the air, up to three hops apart."""
    lab = radio_lab(16, "--range", "0.8", as_installed=True)
    cli = program("swarmtalk-cli")
    wait_for(lambda: neighbours(lab, 1) == {2, 5, 6}, what="beacons")
    wait_for(lambda: neighbours(lab, 11) == {6, 7, 8, 10, 12, 14, 15, 16}, what="beacons")
    for robot in (2, 4, 16):
        wait_for(lambda: lab.cli(1, "ping", robot, "-c", 1).returncode == 0, what="an answer")
    heard = tmp_path / "heard"
    lab.start(1, "sh", "-c", 'exec "$0" log >"$1"', cli, heard)

    def all_are_heard():  # the air may lose a line
        assert lab.execute("all", cli, "log", "here").returncode == 0
        robots = set(re.findall(r"robot (\d+) ", heard.read_text()))
        return robots == {str(robot) for robot in range(1, 17)}
    wait_for(all_are_heard, what="a line of each")
    with tempfile.TemporaryDirectory() as folder:
        its_map_is_seen_from_outside(lab, pathlib.Path(folder))


def its_map_is_seen_from_outside(lab, folder):
    """By the browser of the user who typed sudo."""
    folder.chmod(0o755)
    opened, browser = folder / "opened", folder / "xdg-open"
    opened.touch()
    browser.write_text(f'#!/bin/sh\necho "$(id -u) $1" >{opened}\n')
    browser.chmod(0o755)
    opened.chmod(0o666)
    variables = {"DISPLAY": ":9", "SUDO_USER": "nobody", "PATH": f"{folder}:{os.environ['PATH']}"}
    command = [program("swarmtalk-lab"), "--name", lab.name, "view", "6", "--", "--port", "0"]
    with subprocess.Popen(command, env={**os.environ, **variables}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, text=True) as process:
        address = next_line(process).split()[-1]
        with urllib.request.urlopen(address, timeout=60) as page:
            assert b"swarmtalk-view" in page.read()
        wait_for(lambda: opened.read_text() == f"65534 {address}\n", what="the browser")
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=60) == 128 + signal.SIGTERM


def neighbours(lab, robot):
    done = lab.cli(robot, "neighbours", "--json")
    return {each["node_id"] for each in json.loads(done.stdout)["neighbours"]}


def a_file_made_for_one_robot_serves_for_all(lab):
    assert [lab.status(robot)["node_id"] for robot in (1, 2)] == [1, 2]
    assert json.loads(lab.cli(1, "pose", "get", "--json").stdout)["x_m"] == 0


def robots_on_the_air_do_not_send_on_in_the_same_instant(lab, expected):
    config = (lab.folder() / "robot-1.toml").read_text()
    found = re.search(r"^jitter_us = (\d+)", config, re.MULTILINE)
    assert (int(found.group(1)) if found else None) == expected, config


def status_tells_why_a_daemon_ended(lab):
    os.kill(lab.pid(2), signal.SIGTERM)
    wait_for(lambda: not is_running(lab.pid(2)), what="the daemon to end")
    done = lab.tool("status")
    assert done.returncode == 1
    assert "swarmtalkd has ended" in done.stdout
    assert "systemctl" not in done.stdout


@needs_root
def test_a_lab_without_namespaces_as_its_file_says(udp_lab, radio_udp_lab, tmp_path):
    base, usual, still = (tmp_path / f"{name}.toml" for name in ("base", "usual", "still"))
    base.write_text('[node]\nid = 3\npose = [9.0, 9.0, 0.0]\n'
                    'pose_socket = "/run/swarmtalk/pose.sock"\n[channels]\nfood = 7\n'
                    '[links.wifi]\n')
    lab = udp_lab(2, "--config", base)
    still.write_text("[links.wifi]\njitter_us = 0\n")
    usual.write_text("[links.wifi]\n\n")
    on_the_air, in_step = (radio_udp_lab(1, "--config", each) for each in (usual, still))
    for each, expected in ((lab, None), (on_the_air, 5000), (in_step, 0)):
        robots_on_the_air_do_not_send_on_in_the_same_instant(each, expected)
    a_file_made_for_one_robot_serves_for_all(lab)
    a_pose_socket_of_the_configuration_is_one_for_each_robot(lab)
    the_labs_that_there_are_are_listed(lab, on_the_air)
    mistakes_with_a_lab_get_one_line(lab)
    status_fits_a_narrow_terminal(lab)
    status_tells_why_a_daemon_ended(lab)
