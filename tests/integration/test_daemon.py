"""The daemon as a process: privileges, sockets, signals, configuration, clients that die."""
import json
import os
import pathlib
import random
import signal
import socket
import subprocess
import tempfile

import pytest
from conftest import needs_root, one_line, program, run, udp_port, wait_for


def write_config(tmp_path, text="", link=""):
    path = tmp_path / "swarmtalkd.toml"
    link = link or f'[links.test]\ntype = "udp"\ninterface = "lo"\nport = {udp_port()}\n'
    path.write_text(f'[socket]\npath = "{tmp_path}/d.sock"\n{link}{text}')
    return path


STARTED = []


@pytest.fixture(autouse=True)
def end_what_was_started():
    yield
    for process in STARTED:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream:
                stream.close()
    STARTED.clear()


def start(config, wait=True):
    process = subprocess.Popen([program("swarmtalkd"), "--config", str(config)],
                               stderr=subprocess.PIPE, text=True)
    STARTED.append(process)
    path = config.parent / "d.sock"
    if wait:
        wait_for(lambda: process.poll() is not None or can_connect(path), what="the daemon")
    return process


def can_connect(path):
    with socket.socket(socket.AF_UNIX) as probe:
        try:
            probe.connect(str(path))
        except OSError:
            return False
    return True


def stop(process):
    process.terminate()
    _, errors = process.communicate(timeout=90)
    return process.returncode, errors


def no_capability_is_left_after_start(lab):
    status = pathlib.Path(f"/proc/{lab.pid(1)}/status").read_text()
    fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
    for field in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"):
        assert int(fields[field], 16) == 0, f"{field} is {fields[field]}"
    assert fields["NoNewPrivs"] == "1"
    assert fields["Threads"] == "1"


@pytest.mark.logic
@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_cleanly(tmp_path, by):
    process = start(write_config(tmp_path))
    assert (tmp_path / "d.sock").exists()
    process.send_signal(by)
    process.communicate(timeout=90)
    assert process.returncode == 0
    assert not (tmp_path / "d.sock").exists()


@pytest.mark.logic
def test_a_stale_socket_is_taken_over_and_a_live_one_is_not(tmp_path):
    config, path = write_config(tmp_path), str(tmp_path / "d.sock")
    with socket.socket(socket.AF_UNIX) as live:
        live.bind(path)
        live.listen()
        _, errors = start(config, wait=False).communicate(timeout=90)
        one_line(errors, "d.sock", "swarmtalkd")
        assert STARTED[-1].returncode == 1
        assert can_connect(path)
    assert (tmp_path / "d.sock").exists() and not can_connect(path)
    daemon = start(config)
    assert daemon.poll() is None and can_connect(path)
    assert stop(daemon)[0] == 0


WRONG = {
    "unknown key": ("[node]\nidd = 3\n", [r"swarmtalkd.toml:8", "idd", "id"]),
    "unknown section": ("[chanels]\na = 1\n", [r"swarmtalkd.toml:7", "chanels", "channels"]),
    "bad type": ('[node]\nid = true\n', [r"swarmtalkd.toml:8", "id"]),
    "out of range": ("[channels]\na = 70000\n", [r"swarmtalkd.toml:8", "70000", "65535"]),
    "one number twice": ("[channels]\na = 3\nb = 3\n", [r"swarmtalkd.toml:9", "a", "b", "3"]),
    "not TOML": ("[node\n", [r"swarmtalkd.toml:7"]),
}


@pytest.mark.logic
@pytest.mark.parametrize("text,patterns", WRONG.values(), ids=[k.replace(" ", "_") for k in WRONG])
def test_wrong_configuration_gets_one_line(tmp_path, text, patterns):
    config = write_config(tmp_path, text)
    for extra in ([], ["--check"]):
        done = run(program("swarmtalkd"), "--config", config, *extra)
        one_line(done.stderr, *patterns)
        assert done.returncode == 1


@pytest.mark.logic
def test_a_socket_of_the_command_line_is_no_other_paths_place(tmp_path):
    path = tmp_path / "pose.sock"
    config = write_config(tmp_path, f'[node]\npose_socket = "{path}"\n')
    for extra in ([], ["--check"]):
        done = run(program("swarmtalkd"), "--config", config, "--socket", path, *extra)
        one_line(done.stderr, r"swarmtalkd.toml:8: key 'node.pose_socket'", "path of --socket too")
        assert done.returncode == 1
    done = run(program("swarmtalkd"), "--config", config, "--check", "--socket", "")
    one_line(done.stderr, "--socket: is empty; give an absolute path")
    assert done.returncode == 1


@pytest.mark.logic
@pytest.mark.parametrize("limit", (5, 8, 11))
def test_a_limit_of_descriptors_that_is_too_low_is_named(tmp_path, limit):
    done = run("bash", "-c", 'ulimit -n "$1"; exec "$2" --config "$3"', "bash", str(limit),
               program("swarmtalkd"), write_config(tmp_path))
    one_line(done.stderr, f"^too many open files: the limit is {limit}; raise it with `ulimit -n "
             r"1024` \(systemd: LimitNOFILE=1024\)$")
    assert done.returncode == 1


@pytest.mark.logic
@needs_root
def test_a_missing_interface_is_named_with_those_there_are(tmp_path):
    config = write_config(tmp_path, link='[links.w]\ntype = "raw_l2"\ninterface = "wlan7"\n')
    done = run(program("swarmtalkd"), "--config", config)
    one_line(done.stderr, r"swarmtalkd.toml:5", "interface", "wlan7")
    assert done.returncode == 1


@pytest.mark.logic
@needs_root
def test_without_permission_it_says_what_is_missing(tmp_path):
    os.chmod(tmp_path, 0o777)
    for parent in tmp_path.parents:  # pytest's own folders are closed to others
        if parent == pathlib.Path(tempfile.gettempdir()):
            break
        os.chmod(parent, 0o755)
    device = [n for n in os.listdir("/sys/class/net") if n != "lo"]
    if not device:
        pytest.skip("this machine has no Ethernet interface")
    config = write_config(tmp_path,
                          link=f'[links.w]\ntype = "raw_l2"\ninterface = "{device[0]}"\n')
    done = run("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups",
               program("swarmtalkd"), "--config", config)
    one_line(done.stderr, "CAP_NET_RAW")
    assert done.returncode == 1


def garbage_on_the_socket_is_closed_and_counted(lab):
    path = lab.state()[0]["socket"]
    random.seed(20200513)
    for _ in range(200):
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(60)
            client.connect(path)
            try:
                client.sendall(random.randbytes(random.randrange(1, 3000)))
                client.shutdown(socket.SHUT_WR)
                while client.recv(4096):
                    pass
            except (BrokenPipeError, ConnectionResetError):
                pass
    status = lab.status(1)
    assert status["clients"] == 1  # the one that asks
    assert sum(n for name, n in status["counters"].items() if "malformed" in name) > 0


def a_client_killed_at_any_moment_leaves_the_daemon_going(lab):
    random.seed(20200511)
    pid = lab.pid(1)
    for _ in range(20):
        victims = [lab.start(1, program("swarmtalk-cli"), "sub", "c"),
                   lab.start(1, program("swarmtalk-cli"), "pub", "c", "x" * 5000,
                             "--repeat", "1000", "--rate", "1000")]
        try:
            victims[1].wait(timeout=random.uniform(0.005, 0.15))
        except subprocess.TimeoutExpired:
            pass
        for victim in victims:
            victim.kill()
            victim.communicate()
    wait_for(lambda: lab.status(1)["clients"] == 1, what="sessions to be gone")
    assert lab.pid(1) == pid
    assert lab.status(1)["channels"] == [] or all(
        c["subscribers"] == 0 for c in lab.status(1)["channels"])


@needs_root
def test_a_daemon_without_privileges_survives_its_clients_and_they_survive_it(bridge_lab, tmp_path):
    lab = bridge_lab(2)
    no_capability_is_left_after_start(lab)
    garbage_on_the_socket_is_closed_and_counted(lab)
    a_client_killed_at_any_moment_leaves_the_daemon_going(lab)
    a_client_reports_a_killed_daemon_and_comes_back(tmp_path)


def a_client_reports_a_killed_daemon_and_comes_back(tmp_path):
    config = write_config(tmp_path)
    daemon = start(config)
    client = subprocess.Popen([program("swarmtalk-cli"), "--socket", str(tmp_path / "d.sock"),
                               "sub", "c", "--json", "-C", "1", "-W", "60"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    STARTED.append(client)
    cli = [program("swarmtalk-cli"), "--socket", str(tmp_path / "d.sock")]

    def is_subscribed():
        done = run(*cli, "status", "--json")
        return done.returncode == 0 and any(
            channel["subscribers"] == 1 for channel in json.loads(done.stdout)["channels"])

    wait_for(is_subscribed, what="the subscription")
    daemon.kill()
    daemon.communicate()
    assert "swarmtalk-cli:" in client.stderr.readline()
    again = start(config)
    wait_for(is_subscribed, what="the client to be back")
    assert run(*cli, "pub", "c", "after").returncode == 0
    out, _ = client.communicate(timeout=90)
    assert "after" in out
    assert stop(again)[0] == 0
