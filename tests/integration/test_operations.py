"""What an operator does to a running daemon: reload, log levels, node id, metrics, capture."""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import time

import pytest
from conftest import BUILD, one_line, program, run, udp_port, wait_for

LINK = '[links.w]\ntype = "udp"\ninterface = "lo"\nport = {port}\n'


class Daemon:
    def __init__(self, folder, extra="", options=(), name="d", port=None, **spawn):
        self.path = folder / f"{name}.sock"
        self.config = folder / f"{name}.toml"
        self.log = folder / f"{name}.log"
        self.port = port or udp_port()
        self.write(extra)
        with open(self.log, "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                [program("swarmtalkd"), "--config", self.config, "--socket", self.path, *options],
                stderr=log, **spawn)
        wait_for(lambda: "serves" in self.text() or self.process.poll() is not None, what="start")

    def write(self, extra):
        self.config.write_text(LINK.format(port=self.port) + extra)

    def text(self):
        return self.log.read_text(encoding="utf-8")

    def cli(self, *words):
        return run(program("swarmtalk-cli"), "--socket", self.path, *words)

    def status(self):
        return json.loads(self.cli("status", "--json").stdout)


@pytest.fixture
def daemon(tmp_path):
    """Makes daemons: daemon(extra configuration, options=...)."""
    started = []

    def make(extra="", **options):
        folder = tmp_path / str(len(started))
        folder.mkdir()
        started.append(Daemon(folder, extra, **options))
        return started[-1]

    yield make
    for each in started:
        each.process.send_signal(signal.SIGCONT)
        each.process.terminate()
        each.process.wait(60)


def reload_applies_what_it_can_and_names_the_rest(daemon):
    one = daemon("[node]\nid = 5\n")
    one.write('rate_hz = 20\njitter_us = 100\nreceive_buffer_bytes = 8192\n[node]\nid = 6\n'
              '[channels]\nspecial = 9\n[limits]\nclients = 3\n[log]\nlevel = "debug"\n')
    done = one.cli("reload")
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.splitlines()) == {
        "applied: channels.special", "applied: limits.clients", "applied: links.w.jitter_us",
        "applied: links.w.rate_hz", "applied: log.level", "applied: node.id",
        "needs a restart: links.w.receive_buffer_bytes"}
    assert one.status()["node_id"] == 6
    sub = subprocess.Popen([program("swarmtalk-cli"), "--socket", one.path, "sub", "special"],
                           stdout=subprocess.DEVNULL)
    wait_for(lambda: one.status()["channels"], what="subscription")
    assert one.status()["channels"][0]["number"] == 9
    sub.terminate()
    sub.wait(60)
    assert "debug: [client] client connected (pid " in one.text()
    # What needs a restart is told again; nothing else is.
    assert one.cli("reload").stdout == "needs a restart: links.w.receive_buffer_bytes\n"


@pytest.mark.logic
def test_command_lines_that_cannot_be_meant_are_told_in_one_line():
    for words, pattern in ((["neighburs"], "no subcommand 'neighburs'; did you mean 'neighbours'"),
                           (["help", "foo"], "no subcommand 'foo'; see swarmtalk-cli --help"),
                           ([], "A subcommand is required"),
                           (["pose", "set", "1", "2", "90"], "degrees are 90deg")):
        done = run(program("swarmtalk-cli"), *words)
        assert done.returncode == 2
        one_line(done.stderr, pattern)


def degrees_of_a_command_line_are_radians_of_the_pose(daemon):
    one = daemon()
    assert one.cli("pose", "set", "1", "2", "90deg").returncode == 0
    assert one.status()["pose"]["theta_rad"] == pytest.approx(1.5708, abs=0.001)


def a_pose_that_leaves_the_configuration_is_gone_after_a_reload(daemon):
    one = daemon("[node]\nid = 5\npose = [1.0, 2.0, 0.0]\n")
    assert one.status()["pose"]["x_m"] == 1.0
    one.write("[node]\nid = 5\n")
    assert one.cli("reload").stdout == "applied: node.pose\n"
    assert one.status()["pose"] is None


def reload_of_a_wrong_file_changes_nothing_and_says_where_it_is_wrong(daemon):
    one = daemon("[node]\nid = 5\n")
    one.write("[node]\nid = 6\n[limits]\nclients = 0\n")
    done = one.cli("reload")
    assert done.returncode == 1
    one_line(done.stderr, "nothing is changed", r"d.toml:8: key 'limits.clients'")
    assert one.status()["node_id"] == 5


def sighup_reloads_too(daemon):
    one = daemon("[node]\nid = 5\n")
    one.write("[node]\nid = 6\n")
    one.process.send_signal(signal.SIGHUP)
    wait_for(lambda: "SIGHUP: configuration reloaded; now applies: node.id" in one.text(),
             what="reload")
    assert one.status()["node_id"] == 6


def a_node_id_of_the_command_line_survives_a_reload(daemon):
    one = daemon("[node]\nid = 5\n", options=["--node-id", "77"])
    assert one.status()["node_id"] == 77
    one.write("[node]\nid = 6\n")
    assert one.cli("reload").stdout == "nothing has changed\n"
    assert one.status()["node_id"] == 77


def the_node_id_can_be_set_at_run_time(daemon):
    one = daemon()
    assert one.cli("node-id", "1234").returncode == 0
    assert (one.status()["node_id"], one.status()["node_id_fixed"]) == (1234, True)
    assert one.cli("node-id", "auto").returncode == 0
    assert one.status()["node_id_fixed"] is False
    assert one.cli("node-id", "65535").returncode == 2
    assert "client 'swarmtalk-cli' (pid " in one.text()


@pytest.mark.logic
def test_a_host_without_a_number_is_told_so(tmp_path):
    config = tmp_path / "d.toml"
    config.write_text('[node]\nid = "hostname"\n' + LINK.format(port=udp_port()))
    command = [program("swarmtalkd"), "--config", str(config), "--socket", str(tmp_path / "s")]

    def named(name, *more):
        done = run("unshare", "--uts", "sh", "-c", 'hostname "$0" && exec "$@"', name, *command,
                   *more)
        if "unshare" in done.stderr:
            pytest.skip("a host name of its own needs root")
        return done

    done = named("robot")
    assert done.returncode == 1
    one_line(done.stderr, r"d.toml:2: key 'node.id'", "has no number in it")
    done = named("robot", "--check")  # the file is right, for another host
    assert done.returncode == 0
    assert done.stdout.startswith(f"{config}: ok\nthis machine cannot run with it: {config}:2: key")
    done = named("robot-07.lab2", "--check")
    assert done.stdout == (f"{config}: ok\n"
                           "this machine is node 7 (from the host's name 'robot-07.lab2')\n")


def log_levels_change_at_run_time(daemon):
    one = daemon()
    assert one.cli("log-level").stdout == "daemon info\nclient info\nhub info\nlink info\n"
    assert "client connected" not in one.text()
    done = one.cli("log-level", "debug", "client")
    assert done.stdout == "daemon info\nclient debug\nhub info\nlink info\n"
    one.status()
    wait_for(lambda: "debug: [client] client connected (pid " in one.text(), what="debug line")
    assert one.cli("log-level", "error").returncode == 0
    before = one.text()
    one.status()
    assert one.text() == before
    done = one.cli("log-level", "loud")
    assert done.returncode == 1
    one_line(done.stderr, "daemon, client, hub, link", "trace, debug, info, warning, error")


def test_an_operator_changes_what_a_daemon_does(daemon):
    for change in (reload_applies_what_it_can_and_names_the_rest,
                   degrees_of_a_command_line_are_radians_of_the_pose,
                   a_pose_that_leaves_the_configuration_is_gone_after_a_reload,
                   reload_of_a_wrong_file_changes_nothing_and_says_where_it_is_wrong,
                   sighup_reloads_too, a_node_id_of_the_command_line_survives_a_reload,
                   the_node_id_can_be_set_at_run_time, log_levels_change_at_run_time):
        change(daemon)


def parse_metrics(text):
    samples = {}
    for line in text.splitlines():
        assert line.startswith(("# HELP swarmtalk_", "# TYPE swarmtalk_", "swarmtalk_")), line
        if not line.startswith("#"):
            name, value = line.rsplit(" ", 1)
            assert name not in samples
            samples[name] = float(value)
    return samples


def metrics_come_over_the_socket_and_as_a_file(daemon, folder):
    file = folder / "swarmtalk.prom"
    one = daemon(f'[metrics]\nfile = "{file}"\ninterval_s = 1\n')
    assert one.cli("pub", "c", "x").returncode == 0
    samples = parse_metrics(one.cli("metrics").stdout)
    assert samples["swarmtalk_messages_sent_total"] == 1
    assert samples['swarmtalk_link_frames_sent_total{link="w"}'] == 1
    wait_for(lambda: parse_metrics(file.read_text()).get("swarmtalk_messages_sent_total") == 1,
             what="the file to follow")
    assert file.stat().st_mode & 0o777 == 0o644
    one.process.terminate()
    one.process.wait(60)
    assert not file.exists(), "a daemon that has ended has no metrics"


def a_deleted_socket_file_is_made_again(daemon, _):
    one = daemon()
    connected = socket.socket(socket.AF_UNIX)
    connected.connect(str(one.path))
    for _ in range(3):
        one.path.unlink()
        wait_for(one.path.exists, what="socket to be back")
        wait_for(lambda: one.cli("status").returncode == 0, what="daemon to answer")
    assert one.text().count("was deleted and has been made again") == 3
    moved = one.path.with_name("elsewhere")
    one.path.rename(moved)
    wait_for(lambda: one.path.exists() and one.cli("status").returncode == 0, what="after a move")
    assert one.status()["clients"] == 2  # connected before it all, and the one that asks
    connected.close()


def a_capture_tells_what_was_dropped_and_why(daemon, folder):
    one = daemon("[node]\nid = 5\n")
    other = daemon("[node]\nid = 6\n", name="e", port=one.port)
    file = folder / "c.pcap"
    capture = subprocess.Popen([program("swarmtalk-cli"), "--socket", one.path, "capture", file,
                                "-C", "3", "-W", "60"], stdout=subprocess.PIPE, text=True)
    wait_for(lambda: "captures all frames" in one.text(), what="capture")
    assert other.cli("pub", "c", "nobody listens").returncode == 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF,
                            socket.inet_aton("127.0.0.1"))
        stranger.sendto(b"hello?", ("239.255.83.84", one.port))
    wait_for(lambda: one.status()["links"][0]["counters"]["frames_not_ours"] == 1, what="stranger")
    assert one.cli("pub", "c", "own").returncode == 0
    out, _ = capture.communicate(timeout=90)
    assert capture.returncode == 0 and "3 frames" in out
    lines = [line.split("\t") for line in
             pathlib.Path(f"{file}.dropped").read_text().splitlines()]
    assert lines[0] == ["frame", "time", "link", "cause", "count"]
    assert [(line[0], line[2], line[3], line[4]) for line in lines[1:]] == [
        ("1", "w", "node_unknown_channels", "1"), ("2", "w", "frames_not_ours", "1")]
    piped = subprocess.run([program("swarmtalk-cli"), "--socket", one.path, "capture", "-",
                            "-W", "0.1"], cwd=folder, capture_output=True, timeout=60, check=True)
    assert (len(piped.stdout), piped.stdout[:4]) == (24, b"\x4d\x3c\xb2\xa1")  # no frame came
    assert piped.stderr.decode().endswith("0 frames; 0 drops, not listed\n")
    assert not list(folder.glob("-*"))
    # The daemon's own reader understands the capture.
    replay = folder / "r.toml"
    replay.write_text(f'[links.r]\ntype = "replay"\nfile = "{file}"\npace = "fastest"\n')
    log = open(folder / "r.log", "w", encoding="utf-8")
    reader = subprocess.Popen([program("swarmtalkd"), "--config", replay, "--socket",
                               folder / "r.sock"], stderr=log)
    try:
        wait_for(lambda: "finished, 2 frames received" in (folder / "r.log").read_text(),
                 what="replay of the two good frames")
    finally:
        reader.terminate()
        reader.wait(60)


def test_an_operator_sees_what_a_daemon_does(daemon, tmp_path):
    for look in (metrics_come_over_the_socket_and_as_a_file, a_deleted_socket_file_is_made_again,
                 a_capture_tells_what_was_dropped_and_why):
        look(daemon, tmp_path)


def switches(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(text.split("\nvoluntary_ctxt_switches:")[1].split()[0])


OWN_KIB = 1280


def own_kib(pid):
    """Not the pages of programs and libraries: of those the kernel maps what it happens to have in
    memory near the ones that were asked for, and has them once for all processes."""
    text = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    return int(re.search(r"^Anonymous: +(\d+) kB$", text, re.M)[1])


def an_idle_daemon_is_small_and_sleeps(daemon, notify, tmp_path):
    """What systemd is told is not read: it wakes nobody."""
    one = daemon(f'[metrics]\nfile = "{tmp_path / "m.prom"}"\n',
                 env={**os.environ, "NOTIFY_SOCKET": notify.getsockname()})
    client = subprocess.Popen([program("swarmtalk-cli"), "--socket", one.path, "sub", "c"],
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert "nothing" in client.stderr.readline()  # it has asked why, and asks nothing more
    time.sleep(0.5)
    before = switches(one.process.pid)
    seconds = 8
    time.sleep(seconds)
    wakeups = (switches(one.process.pid) - before) / seconds
    kib = own_kib(one.process.pid)
    client.terminate()
    client.wait(60)
    print(f"idle: {wakeups:.2f} wake-ups/s, {kib} KiB of its own")
    assert wakeups <= 1.0
    if "CMAKE_BUILD_TYPE:STRING=RelWithDebInfo" in (BUILD / "CMakeCache.txt").read_text():
        assert kib <= OWN_KIB


def systemd_is_told_ready_status_watchdog_and_stopping(daemon, notify):
    environment = {**os.environ, "NOTIFY_SOCKET": notify.getsockname(),
                   "WATCHDOG_USEC": "400000"}
    environment.pop("WATCHDOG_PID", None)
    one = daemon("[node]\nid = 5\n", env=environment)
    assert notify.recv(4096).decode() == "READY=1\nSTATUS=node 5, link w up, 0 clients"
    for _ in range(3):
        assert notify.recv(4096).decode() == "WATCHDOG=1"
    assert one.cli("node-id", "9").returncode == 0
    wait_for(lambda: "STATUS=node 9," in notify.recv(4096).decode(), what="new status")
    one.process.terminate()
    wait_for(lambda: notify.recv(4096).decode() == "STOPPING=1", what="STOPPING")


def test_a_service_tells_systemd_of_itself_and_is_small_and_sleeps(daemon, tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notify:
        notify.bind(str(tmp_path / "notify"))
        notify.settimeout(60)
        systemd_is_told_ready_status_watchdog_and_stopping(daemon, notify)
        an_idle_daemon_is_small_and_sleeps(daemon, notify, tmp_path)
