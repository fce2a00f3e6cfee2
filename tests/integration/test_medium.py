"""swarmtalk-lab --medium radio: unmodified daemons on TAP devices, whose other ends a process holds
that runs a Wi-Fi channel in real time; and what can be done to that channel while it runs."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time

import pytest
from conftest import needs_root, next_line, one_line, program, run, wait_for
from test_lab import is_running, leftovers

CLI = program("swarmtalk-cli")
TOOL = program("swarmtalk-lab")


def heard(lab, sender, receivers, messages=1, rate=50, channel="hello"):
    """Robot `sender` publishes; returns how many messages each of `receivers` got."""
    subs = [lab.start_sub(each, channel, "--format", "%p") for each in receivers]
    done = lab.cli(sender, "pub", channel, "x", "--repeat", messages, "--rate", rate)
    assert done.returncode == 0, done.stderr
    wait_for(lambda: accounted(lab.medium()), what="what is on the air to arrive")
    counts = []
    for receiver, sub in zip(receivers, subs):
        end = f"end_{receiver}"  # from the same robot: the last that its program hears
        assert lab.cli(receiver, "pub", channel, end).returncode == 0
        texts = []
        while end not in texts:
            texts.append(next_line(sub))
        sub.send_signal(signal.SIGINT)
        sub.communicate(timeout=60)
        counts.append(texts.count("x"))
    return counts


def accounted(status):
    """Whether each frame sent has arrived at, or is lost for a named cause to, each other robot."""
    lost = {cause: count for cause, count in status["lost"].items()
            if cause not in ("queue_full", "interface")}
    return status["received"] + sum(lost.values()) == status["expected"]


def range_decides_who_hears_whom_and_tcpdump_sees_it(lab, tmp_path):
    """Three robots within 10 m, and the third by itself."""
    assert lab.tool("move", 3, 0, 12).returncode == 0
    dump = tmp_path / "robot-1.pcap"
    words = ["tcpdump", "-q", "-i", "wlan0", "-U", "-w", str(dump), "--immediate-mode"]
    watcher = lab.start(1, *words)
    before = lab.medium()
    try:
        wait_for(lambda: dump.exists() and dump.stat().st_size >= 24, what="tcpdump to listen")
        assert heard(lab, 2, [1, 3], messages=5) == [5, 0]
    finally:
        watcher.send_signal(signal.SIGTERM)
        watcher.communicate(timeout=60)
    seen = run("tcpdump", "-e", "-n", "-r", dump, "ether", "proto", "0x88b5").stdout
    assert seen.count("02:53:54:00:00:02 > ff:ff:ff:ff:ff:ff") >= 5, seen
    status = lab.medium()
    assert accounted(status)
    assert [robot["in_range"] for robot in status["robots"]] == [2, 2, 0, 2]
    assert status["robots"][2]["lost"]["range"] >= before["robots"][2]["lost"]["range"] + 5
    assert status["robots"][0]["received"] >= before["robots"][0]["received"] + 5
    assert status["late"]["events"] == status["sent"] > 0
    text = lab.tool("medium", "status").stdout
    assert "4 robots" in text and "too far away" in text and "late:" in text


def a_loss_of_30_percent_is_that_at_the_receiving_daemon_and_one_way(lab):
    done = lab.tool("link", 1, 2, "--loss", "0.3", "--one-way")
    assert done.stdout.splitlines() == ["robot 1 -> robot 2: in range by 30.0 dB, loss 30 %"]
    share = 1 - heard(lab, 1, [2], messages=600, rate=300)[0] / 600
    assert 0.25 <= share <= 0.35, share
    assert heard(lab, 2, [1], messages=50, rate=100) == [50]
    assert lab.medium()["lost"]["link"] >= 150
    assert lab.tool("link", 1, 2, "--reset").stdout.count("loss 0 %") == 2
    assert heard(lab, 1, [2], messages=50, rate=100) == [50]


def a_robot_that_moves_is_heard_where_it_is_and_its_daemon_knows_the_place(lab):
    assert lab.tool("move", 2, "30", "-2.5").returncode == 0
    assert heard(lab, 1, [2]) == [0]
    pose = json.loads(lab.cli(2, "pose", "get", "--json").stdout)
    assert (pose["x_m"], pose["y_m"]) == (30, -2.5)
    assert lab.state()[1]["x_m"] == 30
    started = time.monotonic()
    assert lab.tool("move", 2, "3", "-2.5", "--speed", "90").returncode == 0
    assert time.monotonic() - started >= 0.3, "27 m at 90 m/s"
    assert heard(lab, 1, [2]) == [1]
    assert json.loads(lab.cli(2, "pose", "get", "--json").stdout)["x_m"] == 3


def partitions_and_jammers_come_and_go(lab):
    assert heard(lab, 1, [2, 3, 4]) == [1, 1, 1]
    assert lab.tool("partition", "1,4").returncode == 0
    assert heard(lab, 1, [2, 3, 4]) == [0, 0, 1]
    assert "by themselves: 1,4" in lab.tool("medium", "status").stdout
    assert lab.tool("heal").returncode == 0
    assert lab.tool("partition", "--line", "0.5").returncode == 0
    assert heard(lab, 1, [2, 3, 4]) == [0, 1, 0]
    assert lab.tool("heal").returncode == 0
    assert lab.tool("jam", 1, 0, "0.5").returncode == 0
    assert heard(lab, 1, [2, 3, 4]) == [0, 1, 1]
    assert lab.tool("jam", "--off").returncode == 0
    assert heard(lab, 1, [2, 3, 4]) == [1, 1, 1]
    status = lab.medium()
    assert accounted(status)
    assert status["lost"]["partition"] >= 4 and status["lost"]["jam"] >= 1


def more_than_the_air_carries_waits_and_is_dropped_and_counted(lab):
    """Frames of 1400 bytes take 2 ms at 6 Mb/s; a queue has room for 64."""
    before = lab.medium()
    assert before["robots"][0]["lost"]["queue_full"] == 0
    done = lab.cli(1, "pub", "big", "x" * 1300, "--repeat", 400)
    assert done.returncode == 0, done.stderr
    wanted = before["offered"] + 300
    status = wait_for(lambda: (status := lab.medium())["offered"] > wanted and status,
                      what="the frames")
    assert status["robots"][0]["lost"]["queue_full"] > 50
    wait_for(lambda: (s := lab.medium())["sent"] + s["lost"]["queue_full"] == s["offered"],
             what="the queue to empty")


def mistakes_with_the_medium_get_one_line(lab):
    one_line(lab.tool("link", 1, 5, "--loss", 1).stderr, "no robot 5; robots are 1 to 4")
    one_line(lab.tool("link", 1, 1).stderr, "no link to itself")
    one_line(lab.tool("link", 1, 2, "--loss", 2).stderr, "--loss")
    one_line(lab.tool("move", 5, 0, 0).stderr, "'5' is not in this lab")
    one_line(lab.tool("jam", 1, 1).stderr, "X Y RADIUS in metres, or --off")
    one_line(lab.tool("partition").stderr, "name robots")
    one_line(lab.tool("medium").stderr, "subcommand")
    one_line(lab.tool("up", 2, "--medium", "radio", "--rate", 7).stderr, "--rate")


def test_a_channel_is_changed_while_robots_use_it(radio_lab, tmp_path):
    """Four robots in a square of 1 m."""
    base = tmp_path / "base.toml"
    base.write_text("[links.wifi]\njitter_us = 0\n")  # each frame as soon as it can
    lab = radio_lab(4, "--spacing", "1", "--range", "10", "--config", base)
    partitions_and_jammers_come_and_go(lab)
    a_loss_of_30_percent_is_that_at_the_receiving_daemon_and_one_way(lab)
    a_robot_that_moves_is_heard_where_it_is_and_its_daemon_knows_the_place(lab)
    range_decides_who_hears_whom_and_tcpdump_sees_it(lab, tmp_path)
    more_than_the_air_carries_waits_and_is_dropped_and_counted(lab)
    mistakes_with_the_medium_get_one_line(lab)
    killed_it_leaves_nothing_behind(lab, medium_pid)


def medium_pid(lab):
    return lab.medium()["pid"]


def keeper_pid(lab):
    return int(run("pgrep", "-o", "-f", f"swarmtalk-lab --name {lab.name} keep").stdout)


def killed_it_leaves_nothing_behind(lab, victim):
    """Neither where the medium is killed nor where what keeps the lab is."""
    daemons = [robot["pid"] for robot in lab.state()]
    parts = [medium_pid(lab), keeper_pid(lab)]
    os.kill(victim(lab), signal.SIGKILL)
    wait_for(lambda: not leftovers(lab.name), what="the lab to be taken down")
    wait_for(lambda: not any(map(is_running, daemons + parts)), what="its processes to end")
    assert not (pathlib.Path("/run/swarmtalk-lab") / lab.name).exists()
    one_line(lab.tool("status").stderr, "was taken down: the medium.* killed|ended by signal 9")


def a_run_that_is_killed_takes_its_medium_with_it():
    name = f"killed{os.getpid()}"
    process = subprocess.Popen([TOOL, "--name", name, "run", "2", "--medium", "radio", "--",
                                "/bin/sh", "-c", "echo ready; exec sleep 60"],
                               stdout=subprocess.PIPE, text=True)
    assert next_line(process) == "ready"
    process.kill()
    process.wait()
    process.stdout.close()
    wait_for(lambda: not leftovers(name), what="the lab to be taken down")
    one_line(run(TOOL, "--name", name, "down").stderr, "taken down: the run .* was killed")
    one_line(run(TOOL, "--name", name, "down").stderr, "no lab called")


def run_and_down_leave_nothing_behind(lab):
    name = f"run{os.getpid()}"
    done = run(TOOL, "--name", name, "run", "2", "--medium", "radio", "--", "/bin/sh", "-c",
               f"{TOOL} medium status --json; echo $SWARMTALK_MEDIUM")
    assert done.returncode == 0, done.stderr
    status, socket = done.stdout.splitlines()
    assert json.loads(status)["range_m"] == 50
    assert leftovers(name) == [] and not pathlib.Path(socket).exists()
    assert lab.down().returncode == 0
    assert leftovers(lab.name) == []


def without_namespaces_the_same_radio_is_on_udp_links(radio_udp_lab):
    """Three robots at (0, 0), (0.5, 0), (0, 0.5); two labs do not hear each other."""
    lab = radio_udp_lab(3, "--range", "0.6")
    other = radio_udp_lab(2)
    assert heard(lab, 2, [1, 3], messages=5) == [5, 0]
    assert lab.tool("link", 2, 1, "--loss", 1).returncode == 0
    assert lab.tool("move", 3, "0.5", "0.1").returncode == 0
    assert heard(lab, 2, [1, 3], messages=5) == [0, 5]
    status = lab.medium()
    assert accounted(status)
    # 44 bytes of headers, 8 of the air frame's and the message's, and no bytes of IP and UDP.
    assert status["air_us"] < 160 * status["sent"]
    assert other.medium()["offered"] == 0
    pids = [status["pid"], keeper_pid(lab), *(robot["pid"] for robot in lab.state())]
    os.kill(status["pid"], signal.SIGKILL)
    wait_for(lambda: not any(map(is_running, pids)), what="all to end")


@pytest.fixture
def folder_of_everybody():
    """One that other users may enter, which pytest's own are not."""
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="swarmtalk-test") as folder:
        yield pathlib.Path(folder)


def it_needs_no_privilege(folder_of_everybody):
    """With copies of our programs: the build folder may be closed to other users."""
    name = f"nobody{os.getpid()}"
    for each in (TOOL, CLI, program("swarmtalkd")):
        place = folder_of_everybody / pathlib.Path(each).parent.name
        place.mkdir()
        shutil.copy(each, place)
    run("chmod", "-R", "a+rX", folder_of_everybody)
    tool, cli = folder_of_everybody / "lab/swarmtalk-lab", folder_of_everybody / "cli/swarmtalk-cli"
    inner = f"{tool} medium status --json && {tool} exec 1 -- {cli} status --json"
    as_nobody = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "env",
                 "--unset=XDG_RUNTIME_DIR")
    done = run(*as_nobody, tool, "--name", name, "run", "2", "--medium", "radio", "--",
               "/bin/sh", "-c", inner)
    assert done.returncode == 0, done.stderr
    one_line(done.stderr, r"need root, so .* over the UDP link \(radio-udp\); with `sudo ")
    medium, daemon = map(json.loads, done.stdout.splitlines())
    assert len(medium["robots"]) == 2 and daemon["links"][0]["type"] == "udp"
    assert not run("pgrep", "-f", f"swarmtalk-lab-65534/{name}/").stdout
    done = run(*as_nobody, tool, "--name", name, "run", "1", "--", tool, "status")
    assert ", medium udp, 1 robot" in done.stdout
    one_line(done.stderr, r"need root, so .* over the UDP link \(udp\); with `sudo ")
    a_lab_is_found_below_another_runtime_folder_and_after_a_logout(
        folder_of_everybody, name, tool, as_nobody)


def a_lab_is_found_below_another_runtime_folder_and_after_a_logout(folder, name, tool, as_nobody):
    session = folder / "session"
    session.mkdir(mode=0o777)
    session.chmod(0o777)
    as_user = (*as_nobody[:-1], f"XDG_RUNTIME_DIR={session}")
    for medium in ("udp", "radio-udp"):
        done = run(*as_user, tool, "--name", name, "up", "2", "--medium", medium)
        assert done.returncode == 0, done.stderr
        done = run(*as_nobody, tool, "--name", name, "status")
        assert done.returncode == 0 and "robot" in done.stdout.lower(), done.stderr
        one_line(run(*as_nobody, tool, "--name", name, "up", "2", "--medium", medium).stderr,
                 "is up; take it down with")
        # At once: the daemons make a socket that is deleted anew.
        (session / "swarmtalk-lab").rename(session / "gone")
        shutil.rmtree(session / "gone")
        done = run(*as_nobody, tool, "--name", name, "up", "2", "--medium", medium)
        assert done.returncode == 1
        one_line(done.stderr, "still run")
        remedy = re.search("`swarmtalk-lab (.*)`", done.stderr)[1]
        done = run(*as_nobody, tool, *remedy.split())
        assert (done.returncode, done.stderr) == (0, "")
        assert not run("pgrep", "-f", f"swarmtalk-lab/{name}/").stdout
        one_line(run(*as_user, tool, "--name", name, "down").stderr, "no lab called")


@needs_root
def test_a_radio_without_namespaces_and_what_all_leave_behind(radio_lab, radio_udp_lab, udp_lab,
                                                              folder_of_everybody):
    without_namespaces_the_same_radio_is_on_udp_links(radio_udp_lab)
    it_needs_no_privilege(folder_of_everybody)
    one_line(udp_lab(1).tool("heal").stderr, "cannot be changed.*--medium radio")
    a_run_that_is_killed_takes_its_medium_with_it()
    run_and_down_leave_nothing_behind(radio_lab(2))
    killed_it_leaves_nothing_behind(radio_lab(2), keeper_pid)


@pytest.mark.field
def test_a_hundred_robots_on_the_air_and_the_medium_keeps_its_time(radio_lab, tmp_path):
    """Ten neighbours each, 8 messages a second, for a minute (SWARMTALK_RADIO_SECONDS).
    Prints what it took."""
    robots, seconds = 100, float(os.environ.get("SWARMTALK_RADIO_SECONDS", "60"))
    base = tmp_path / "base.toml"
    base.write_text("[log]\nlevel = \"warning\"\n")
    lab = radio_lab(robots, "--range", "1.01", "--config", base)
    before = [robot_cpu_s(robot["pid"]) for robot in lab.state()]
    # Each a little out of step with the others, as robots are.
    done = lab.tool("exec", "all", "--", "/bin/sh", "-c",
                    f"sleep 0.$((SWARMTALK_ROBOT * 10 % 97)); exec {CLI} pub pulse 0123456789abcdef"
                    f" --rate 8 --repeat {int(8 * seconds)}", timeout=seconds + 120)
    assert done.returncode == 0, done.stdout[-2000:]
    status = lab.medium()
    state = lab.state()
    daemons = sum(robot_cpu_s(robot["pid"]) for robot in state) - sum(before)
    print(lab.tool("medium", "status").stdout)
    heard_frames = sum(robot["links"][0]["frames_received"] for robot in state)
    print(f"frames that the daemons heard: {heard_frames}")
    print(f"daemons: {100 * daemons / seconds:.1f} % of a processor, all together")
    assert accounted(status)
    neighbours = sum(robot["in_range"] for robot in status["robots"]) / robots
    assert 9 <= neighbours <= 11, neighbours
    assert status["offered"] >= 8 * seconds * robots * 0.99
    assert heard_frames >= 0.999 * status["received"]
    assert status["lost"]["interface"] == status["lost"]["receiver"] == 0
    assert status["late"]["late"] < 0.01 * status["late"]["events"], status["late"]


def robot_cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
