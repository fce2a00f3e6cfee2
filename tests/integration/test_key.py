"""A swarm key on real links: who has it understands, all others are refused, counted by cause."""
import json
import socket
import struct
import subprocess

import pytest
from conftest import one_line, program, run, udp_port, wait_for

GROUP = "239.255.83.84"
WITH_A_PACKET_BYTES = 80  # more than a frame of two robots without one has


class Robot:
    def __init__(self, folder, name, port, key=None):
        self.path = folder / f"{name}.sock"
        config = folder / f"{name}.toml"
        config.write_text('[links.w]\ntype = "udp"\ninterface = "lo"\n' + f"port = {port}\n"
                          + (f'key_file = "{key}"\n' if key else ""))
        self.daemon = subprocess.Popen([program("swarmtalkd"), "--config", config, "--socket",
                                        self.path], stderr=subprocess.PIPE, text=True)
        wait_for(lambda: self.path.exists() or self.daemon.poll() is not None, what="socket")
        assert self.daemon.poll() is None, self.daemon.stderr.read()

    def cli(self, *words):
        return run(program("swarmtalk-cli"), "--socket", self.path, *words)

    def counter(self, name):
        return json.loads(self.cli("status", "--json").stdout)["links"][0]["counters"][name]

    def expect(self, name, count):
        wait_for(lambda: self.counter(name) >= count, what=f"{name} to be {count}")
        assert self.counter(name) == count

    def believes(self, *others):
        """Waits until each has taken a frame of the other: robots show first that they live."""
        for robot in (self, *others):
            wait_for(lambda: robot.counter("frames_received") > 0, what="robots that are heard")

    def subscribe(self, *words):
        process = subprocess.Popen([program("swarmtalk-cli"), "--socket", self.path, "sub", *words],
                                   stdout=subprocess.PIPE, text=True)
        wait_for(lambda: json.loads(self.cli("status", "--json").stdout)["channels"],
                 what="subscription")
        return process

    def end(self):
        """Ends the daemon. Returns what it has logged since it was asked last."""
        self.daemon.terminate()
        self.daemon.wait(timeout=60)
        return self.daemon.stderr.read()


@pytest.fixture
def swarm(tmp_path):
    """Makes robots that share a UDP port of their own: swarm(name, key file or None)."""
    port = udp_port()
    robots = []

    def make(name, key=None):
        robots.append(Robot(tmp_path, name, port, key))
        return robots[-1]

    make.port = port
    yield make
    for robot in robots:
        robot.end()


def keygen(path):
    done = run(program("swarmtalk-cli"), "keygen", path)
    assert done.returncode == 0, done.stderr
    return path


class Ether:
    """Hears every frame of the group, and sends frames of its own."""

    def __init__(self, port):
        self.port = port
        self.ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.ear.bind((GROUP, port))
        self.ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                            socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
        self.ear.settimeout(60)
        self.mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.mouth.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF,
                              socket.inet_aton("127.0.0.1"))

    def hear(self):
        return self.ear.recv(4096)

    def send(self, frame):
        self.mouth.sendto(frame, (GROUP, self.port))


def test_a_key_keeps_others_out(swarm, tmp_path):
    who_has_the_key_understands_and_others_count_why_not(swarm, tmp_path)
    replayed_altered_cut_and_foreign_frames_are_counted_by_cause(swarm, tmp_path / "swarm.key")


def who_has_the_key_understands_and_others_count_why_not(swarm, tmp_path):
    key = keygen(tmp_path / "swarm.key")
    with_key, friend = swarm("a", key), swarm("b", key)
    stranger, other = swarm("c"), swarm("d", keygen(tmp_path / "other.key"))
    heard = friend.subscribe("c", "-C", "1", "-W", "60", "--json")
    with_key.believes(friend)
    assert with_key.cli("pub", "c", "a secret").returncode == 0
    assert json.loads(heard.communicate(timeout=90)[0])["text"] == "a secret"
    wait_for(lambda: stranger.counter("frames_sealed") > 0, what="frames_sealed")
    wait_for(lambda: other.counter("frames_other_key") > 0, what="frames_other_key")
    before = with_key.counter("packets_received")
    assert stranger.cli("pub", "c", "in the clear").returncode == 0
    with_key.expect("frames_without_key", 1)
    assert with_key.counter("packets_received") == before
    assert "sealed with a swarm key, and this link has none" in stranger.end()
    assert "sealed with another swarm key" in other.end()
    assert with_key.end().count("1 frame was not sealed, and this link has a key") == 1
    friend.end()


def replayed_altered_cut_and_foreign_frames_are_counted_by_cause(swarm, key):
    sender, receiver = swarm("e", key), swarm("f", key)
    ether = Ether(swarm.port)
    heard = receiver.subscribe("c", "-C", "2", "-W", "60", "--json")
    sender.believes(receiver)
    assert sender.cli("pub", "c", "once only").returncode == 0
    frame = ether.hear()
    while len(frame) < WITH_A_PACKET_BYTES:
        frame = ether.hear()
    assert b"once only" not in frame
    receiver.expect("packets_received", 1)
    for _ in range(3):
        ether.send(frame)
    receiver.expect("frames_replayed", 3)
    fresh = bytearray(frame)
    struct.pack_into(">I", fresh, 14, 1000)  # as if it were a new frame
    ether.send(fresh)
    receiver.expect("frames_not_authentic", 1)
    for at in (20, 30, len(frame) - 1):  # session, ciphertext, tag
        flipped = bytearray(fresh)
        flipped[at] ^= 1
        ether.send(flipped)
    receiver.expect("frames_not_authentic", 4)
    ether.send(frame[:-1])
    receiver.expect("frames_truncated", 1)
    ether.send(frame[:2] + bytes([frame[2] + 1]) + frame[3:])
    receiver.expect("frames_other_version", 1)
    assert receiver.counter("packets_received") == 1
    assert sender.cli("pub", "c", "the end").returncode == 0
    out, _ = heard.communicate(timeout=90)
    assert [json.loads(line)["text"] for line in out.splitlines()] == ["once only", "the end"]


@pytest.mark.logic
@pytest.mark.parametrize("mode,patterns", [(0o644, ["mode 0644", "chmod 0400"]),
                                           (None, ["No such file", "swarmtalk-cli keygen"])])
def test_a_key_file_that_is_not_safe_is_refused_in_one_line(tmp_path, mode, patterns):
    key = tmp_path / "swarm.key"
    if mode is not None:
        keygen(key).chmod(mode)
    config = tmp_path / "d.toml"
    config.write_text(f'[links.w]\ntype = "udp"\ninterface = "lo"\nkey_file = "{key}"\n')
    done = run(program("swarmtalkd"), "--config", config, "--socket", tmp_path / "s")
    assert done.returncode == 1
    one_line(done.stderr, "d.toml:4: key 'links.w.key_file'", *patterns)


@pytest.mark.logic
def test_keygen_never_writes_over_a_key(tmp_path):
    key = keygen(tmp_path / "swarm.key")
    assert key.stat().st_mode & 0o777 == 0o600
    before = key.read_text()
    done = run(program("swarmtalk-cli"), "keygen", key)
    assert done.returncode == 1
    one_line(done.stderr, "File exists", "never written over")
    assert key.read_text() == before
    assert keygen(tmp_path / "second.key").read_text() != before
