"""The dissector for Wireshark, in tshark: on the vectors of the air frame, and on a capture that
`swarmtalk-cli capture` has made of two robots with a key."""
import os
import pathlib
import shutil
import struct
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
LUA = ROOT / "packaging/wireshark/swarmtalk.lua"
CLI, LAB = BUILD / "cli/swarmtalk-cli", BUILD / "lab/swarmtalk-lab"
ETHERNET = bytes.fromhex("ffffffffffff02535400000188b5")


def vectors(kind):
    for line in (ROOT / "tests/vectors/air_frames.txt").read_text().splitlines():
        words = line.split()
        if words and words[0] == kind:
            yield words[1:]


def write_pcap(path, frames):
    with open(path, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1))
        for number, frame in enumerate(frames):
            data = ETHERNET + frame
            file.write(struct.pack("<IIII", number, 0, len(data), len(data)) + data)


FIELDS = ["transmitter", "profile", "epoch", "counter", "pose.x", "pose.age", "session", "channel",
          "sender", "message", "payload"]


def dissected(path):
    """The fields of SwarmTalk in each frame, as text: [{name: value}]; absent ones are empty."""
    if shutil.which("tshark") is None:
        pytest.skip("tshark is missing: run tools/setup test")
    words = [word for name in FIELDS for word in ("-e", "swarmtalk." + name)]
    done = subprocess.run(["tshark", "-X", f"lua_script:{LUA}", "-r", str(path), "-T", "fields",
                           "-E", "separator=|", "-E", "occurrence=f", *words], text=True,
                          capture_output=True, timeout=60,
                          env={**os.environ, "HOME": str(path.parent)})
    assert done.returncode == 0, done.stderr
    assert "Lua" not in done.stderr and "Lua Error" not in done.stdout, done.stderr + done.stdout
    return [dict(zip(FIELDS, line.split("|"))) for line in done.stdout.splitlines()]


def test_it_reads_the_vectors_of_the_air_frame(tmp_path):
    good = list(vectors("good"))
    write_pcap(tmp_path / "v.pcap", [bytes.fromhex(words[7]) for words in good])
    frames = dissected(tmp_path / "v.pcap")
    assert len(frames) == len(good)
    for (name, profile, node, epoch, counter, pose, *_), frame in zip(good, frames):
        assert (frame["transmitter"], frame["profile"]) == (node, profile), (name, frame)
        assert int(frame["epoch"], 0) == int(epoch) and frame["counter"] == counter
        assert (frame["pose.age"] != "") == (pose != "-"), name
        if pose != "-" and not pose.endswith(",255"):
            assert float(frame["pose.x"]) == int(pose.split(",")[0]) / 1000, name


def test_it_shows_the_header_of_sealed_frames(tmp_path):
    sealed = list(vectors("sealed"))
    write_pcap(tmp_path / "s.pcap", [bytes.fromhex(words[9]) for words in sealed])
    for words, frame in zip(sealed, dissected(tmp_path / "s.pcap")):
        assert frame["transmitter"] == words[4]
        assert frame["session"].replace(":", "") == words[2]
        assert frame["payload"] == ""


def test_what_no_robot_reads_is_marked_and_ends_nothing(tmp_path):
    bad = [words for words in vectors("bad") if words[2] != "-"]
    write_pcap(tmp_path / "b.pcap", [bytes.fromhex(words[2]) for words in bad])
    frames = dissected(tmp_path / "b.pcap")
    done = subprocess.run(["tshark", "-X", f"lua_script:{LUA}", "-r", str(tmp_path / "b.pcap"),
                           "-z", "expert,note", "-q"], capture_output=True, text=True, timeout=60,
                          env={**os.environ, "HOME": str(tmp_path)})
    for sentence in ("Another version", "Flags that this version does not know", "is cut off",
                     "length of a packet is impossible"):
        assert sentence in done.stdout, done.stdout
    assert len(frames) == len(bad)


@pytest.mark.field
def test_a_capture_of_robots_with_a_key_is_read_after_unsealing(tmp_path):
    key, config, sealed = (tmp_path / name for name in ("swarm.key", "base.toml", "sealed.pcap"))
    subprocess.run([CLI, "keygen", key], check=True, capture_output=True)
    config.write_text(f'[links.wifi]\nkey_file = "{key}"\n[channels]\nhello = 7\n')
    talk = (f"{LAB} exec 2 -- {CLI} capture {sealed} -C 40 -W 60 & "
            f"{LAB} exec 1 -- {CLI} pub --repeat 60 --rate 20 hello 'good morning'; wait")
    done = subprocess.run([LAB, "--name", f"ws{os.getpid()}", "run", "2", "--medium", "udp",
                           "--config", config, "--", "/bin/sh", "-c", talk], text=True,
                          capture_output=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    for frame in dissected(sealed):
        assert frame["transmitter"] in ("1", "2")
        assert frame["session"] != "" and frame["payload"] == ""
    plain = tmp_path / "plain.pcap"
    done = subprocess.run([CLI, "capture", plain, "--from", sealed, "--unseal", key], text=True,
                          capture_output=True)
    assert done.returncode == 0, done.stderr
    assert "40 frames; 40 frames unsealed, 0 left sealed" in done.stdout, done.stdout
    frames = dissected(plain)
    assert len(frames) == 40
    messages = [frame for frame in frames if frame["channel"]]
    assert len(messages) >= 20, "the others are those by which the robots believe each other"
    for frame in messages:
        assert (frame["channel"], frame["sender"], frame["pose.x"]) == ("7", "1", "0"), frame
        assert bytes.fromhex(frame["payload"].replace(":", "")) == b"good morning"


@pytest.fixture
def capture(tmp_path):
    """A capture as we make them, of 40 sealed frames, and their key."""
    _, key_text, *_, frame = next(words for words in vectors("sealed")
                                  if words[0] == "sealed_one_packet")
    folder = tmp_path / "capture"
    folder.mkdir()
    write_pcap(folder / "frames.pcap", [bytes.fromhex(frame)] * 40)
    (folder / "swarm.key").write_text(key_text + "\n")
    sealed = folder / "sealed.pcap"
    done = subprocess.run([CLI, "capture", sealed, "--from", folder / "frames.pcap"], text=True,
                          capture_output=True)
    assert done.returncode == 0, done.stderr
    return sealed, folder / "swarm.key"


def test_mistakes_with_keys_and_files_get_one_line(capture, tmp_path):
    sealed, key = capture
    other = tmp_path / "other.key"
    other.write_text("11" * 32 + "\n")
    out = tmp_path / "out.pcap"

    def line_of(*words):
        done = subprocess.run([CLI, "capture", out, *words], text=True, capture_output=True)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
        return done.stderr
    assert "0 frames unsealed, 40 left sealed" in line_of("--from", sealed, "--unseal", other)
    assert out.read_bytes() == sealed.read_bytes()
    assert line_of("--from", sealed) == (
        f"swarmtalk-cli: cannot make {out}: File exists; --replace overwrites it\n")
    out.unlink()
    (tmp_path / "bad.key").write_text("no key")
    assert "is not a swarm key: 64 hexadecimal digits" in line_of(
        "--from", sealed, "--unseal", tmp_path / "bad.key")
    assert "cannot read the key file" in line_of("--from", sealed, "--unseal", "/nowhere")
    assert "cannot read" in line_of("--from", tmp_path / "bad.key")
    assert line_of("--from", "/nowhere/c") == (
        "swarmtalk-cli: cannot read /nowhere/c: No such file or directory\n")
    done = subprocess.run([CLI, "capture", "/nowhere/c", "--from", sealed], text=True,
                          capture_output=True)
    assert done.stderr == "swarmtalk-cli: cannot make /nowhere/c: No such file or directory\n"


def test_a_copy_may_take_the_place_of_what_it_is_made_of(capture, tmp_path):
    sealed, key = capture
    folder = tmp_path / "copies"
    folder.mkdir()
    file, plain = folder / "c.pcap", folder / "plain.pcap"
    file.write_bytes(sealed.read_bytes())

    def run(*words):
        return subprocess.run([CLI, "capture", *words], text=True, capture_output=True)
    assert run(file, "--from", file, "--unseal", key).returncode == 1
    assert file.read_bytes() == sealed.read_bytes()
    assert run(plain, "--from", file, "--unseal", key).returncode == 0
    done = run(file, "--from", file, "--unseal", key, "--replace")
    assert done.returncode == 0, done.stderr
    assert file.read_bytes() == plain.read_bytes()
    assert sorted(folder.iterdir()) == [file, plain]
    file.write_bytes(sealed.read_bytes()[:-1])  # cut off: nothing is replaced
    assert run(plain, "--from", file, "--replace").returncode == 1
    assert len(dissected(plain)) == 40
    assert sorted(folder.iterdir()) == [file, plain]


def test_a_copy_ends_after_as_many_frames_as_asked_for(capture, tmp_path):
    sealed, _ = capture
    copy = tmp_path / "c.pcap"
    done = subprocess.run([CLI, "capture", copy, "--from", sealed, "-C", "3"], text=True,
                          capture_output=True)
    assert (done.returncode, done.stdout) == (0, f"{copy}: 3 frames\n")
    done = subprocess.run([CLI, "capture", copy, "--from", sealed, "-W", "3"], text=True,
                          capture_output=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert "--from excludes --timeout" in done.stderr
