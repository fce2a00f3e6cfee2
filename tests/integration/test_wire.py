"""What is on the wire, read from a capture; and what the daemon does with frames that are not ours
or not whole."""
import signal
import struct
import subprocess
import sys
import time

from conftest import run, wait_for

BROADCAST = b"\xff" * 6
ETHERTYPE = 0x88B5


def read_pcap(path):
    """Frames of a little-endian microsecond pcap file."""
    raw = path.read_bytes()
    magic, = struct.unpack_from("<I", raw)
    assert magic == 0xA1B2C3D4
    frames, at = [], 24
    while at + 16 <= len(raw):
        _, _, captured, length = struct.unpack_from("<IIII", raw, at)
        assert captured == length
        frames.append(raw[at + 16:at + 16 + captured])
        at += 16 + captured
    return frames


def only_broadcast_frames_of_our_ethertype_are_on_the_wire(lab, tmp_path):
    capture = tmp_path / "wire.pcap"
    dump = subprocess.Popen(
        ["ip", "netns", "exec", f"swarmtalk-{lab.name}-air", "tcpdump", "-i", "robot1", "-U",
         "-Z", "root", "-w", str(capture)], stderr=subprocess.PIPE, text=True)
    assert "listening on" in dump.stderr.readline()
    listener = lab.start_sub(2, "c", "-C", "5", "-W", "60")
    assert lab.cli(1, "pub", "c", "marker-on-the-wire", "--repeat", "5",
                   "--rate", "50").returncode == 0
    listener.communicate(timeout=90)
    assert lab.cli(2, "pub", "c", "answer").returncode == 0
    wait_for(lambda: capture.exists() and len(read_pcap(capture)) >= 6, what="captured frames")
    dump.send_signal(signal.SIGTERM)
    dump.communicate(timeout=60)
    frames = read_pcap(capture)
    assert any(b"marker-on-the-wire" in frame for frame in frames)
    for frame in frames:
        assert frame[:6] == BROADCAST, frame.hex()
        assert struct.unpack_from("!H", frame, 12)[0] == ETHERTYPE, frame.hex()
        assert frame[14:17] == b"ST\x01", frame.hex()
        length, = struct.unpack_from("!H", frame, 18)
        assert length <= len(frame) - 14


INJECT = """
import socket, struct, sys, random
s = socket.socket(socket.AF_PACKET, socket.SOCK_RAW)
s.bind(("wlan0", 0))
def frame(body, ethertype=0x88B5):
    s.send(b"\\xff" * 6 + bytes.fromhex("020000000099") + struct.pack("!H", ethertype) + body)
def header(length, version=1, flags=0, profile=0, magic=b"ST"):
    return magic + struct.pack("!BBHBBHII", version, flags, length, profile, 0, 77, 1, 1)
"""


def inject(lab, robot, code):
    done = lab.execute(robot, sys.executable.replace(sys.executable, "/usr/bin/python3"), "-c",
                       INJECT + code)
    assert done.returncode == 0, done.stderr


def bad_frames_are_counted_by_cause(lab):
    inject(lab, 1, """
for i in range(3): frame(header(18, magic=b"XX"))           # not ours
for i in range(4): frame(header(18, version=9))
for i in range(5): frame(header(18, flags=0x40))
for i in range(6): frame(header(18, profile=3))
for i in range(7): frame(header(1200))                      # says more than there is
for i in range(8): frame(header(21) + b"\\xff\\xff\\x00")   # packet length past the end
for i in range(9): frame(header(18), ethertype=0x88B6)      # somebody else's
""")
    expected = {"frames_not_ours": 3, "frames_other_version": 4, "frames_unknown_flags": 5,
                "frames_other_profile": 6, "frames_truncated": 7, "frames_bad_packet_length": 8}
    wait_for(lambda: lab.link_counter(2, "frames_bad_packet_length") >= 8, what="the last frame")
    counters = lab.status(2)["links"][0]["counters"]
    assert {name: counters[name] for name in expected} == expected


def garbage_on_the_wire_never_stops_the_daemon(lab):
    pid = lab.pid(2)
    inject(lab, 1, """
random.seed(20200509)
for i in range(20000):
    kind = i % 4
    body = bytes(random.randrange(256) for _ in range(random.randrange(1, 80)))
    if kind == 1: body = header(18 + len(body)) + body
    if kind == 2: body = header(20 + len(body)) + struct.pack("!H", len(body)) + body
    if kind == 3: body = header(random.randrange(65536), random.randrange(3),
                                random.randrange(256), random.randrange(4)) + body
    frame(body)
""")
    listener = lab.start_sub(2, "c", "-C", "1", "-W", "60")
    assert lab.cli(1, "pub", "c", "still here").returncode == 0
    out, _ = listener.communicate(timeout=90)
    assert "still here" in out
    assert lab.pid(2) == pid


def in_namespace(lab, robot, *command):
    done = run("ip", "-n", lab.namespace(robot), *command)
    assert done.returncode == 0, done.stderr


def crosses(lab, text):
    """True when a message from robot 1 reaches robot 2 within a few attempts."""
    for _ in range(4):
        listener = lab.start_sub(2, "c", "-C", "1", "-W", "10")
        lab.cli(1, "pub", "c", text, "-W", "10")
        out, _ = listener.communicate(timeout=30)
        if text in out:
            return True
    return False


def link_is_up(lab, robot):
    return lab.status(robot)["links"][0]["up"]


def the_link_survives_its_interface_going_down_and_up(lab):
    assert crosses(lab, "before")
    in_namespace(lab, 2, "link", "set", "wlan0", "down")
    wait_for(lambda: not link_is_up(lab, 2), what="the link to be seen down")
    assert "wlan0" in lab.status(2)["links"][0]["state"]
    in_namespace(lab, 2, "link", "set", "wlan0", "up")
    wait_for(lambda: link_is_up(lab, 2), what="the link to be seen up")
    assert crosses(lab, "after")


def the_link_survives_its_interface_being_deleted_and_created_again(lab):
    pid = lab.pid(2)
    in_namespace(lab, 2, "link", "delete", "wlan0")
    wait_for(lambda: not link_is_up(lab, 2), what="the link to be seen gone")
    time.sleep(0.2)
    hub = f"swarmtalk-{lab.name}-air"
    assert run("ip", "link", "add", "wlan0", "netns", lab.namespace(2), "type", "veth", "peer",
               "name", "again", "netns", hub).returncode == 0
    assert run("ip", "-n", hub, "link", "set", "again", "master", "air", "up").returncode == 0
    in_namespace(lab, 2, "link", "set", "wlan0", "up")
    wait_for(lambda: link_is_up(lab, 2), what="the link to be seen back")
    assert crosses(lab, "after")
    assert lab.pid(2) == pid


def test_a_wire_carries_our_frames_and_bears_what_happens_to_it(bridge_lab, tmp_path):
    lab = bridge_lab(2)
    only_broadcast_frames_of_our_ethertype_are_on_the_wire(lab, tmp_path)
    bad_frames_are_counted_by_cause(lab)
    garbage_on_the_wire_never_stops_the_daemon(lab)
    the_link_survives_its_interface_going_down_and_up(lab)
    the_link_survives_its_interface_being_deleted_and_created_again(lab)
