"""`swarmtalk-cli record` and `play`, and what others make of the recordings."""
import json
import os
import pathlib
import shutil
import signal
import subprocess

import pytest
from conftest import one_line, program, run, wait_for

HERE = pathlib.Path(__file__).resolve().parent
SPACING_SLACK_S = 0.05  # a message that waits for the link comes later, and the next one less so


def start_record(lab, robot, *arguments):
    """Starts `swarmtalk-cli record`; returns it once it is subscribed to `debug`."""
    def is_listening():
        return any(channel["name"] == "debug" and channel["subscribers"]
                   for channel in lab.status(robot)["channels"])

    process = lab.start(robot, program("swarmtalk-cli"), "record", *arguments)
    wait_for(lambda: is_listening() or process.poll() is not None, what="the recorder")
    return process


def wait_for_channel(lab, robot, name):
    wait_for(lambda: any(name in (channel["name"], str(channel["number"])) and
                         channel["subscribers"] for channel in lab.status(robot)["channels"]),
             what=f"a subscription of {name}")


def end(process, number=signal.SIGINT):
    """Ends it; returns its exit code, standard output and error."""
    process.send_signal(number)
    out, error = process.communicate(timeout=20)
    return process.returncode, out, error


def played(lab, robot, path, count, *arguments):
    """What `record --jsonl` of robot 2 says of `count` messages that the robot plays."""
    recorder = start_record(lab, 2, "--jsonl", "--channels", "a,b", "-C", str(count), "-W", "20")
    wait_for_channel(lab, 2, "b")
    done = lab.cli(robot, "play", path, *arguments)
    assert done.returncode == 0, done.stderr
    out, _ = recorder.communicate(timeout=30)
    return [line for line in map(json.loads, out.splitlines()) if line["type"] == "message"]


def record_twelve(lab, path):
    """Twelve messages on two channels, 40 a second; returns what `sub --json` printed of them."""
    recorder = start_record(lab, 2, path, "--channels", "a,b", "-C", "12")
    sub = lab.start_sub(2, "a", "b", "--json", "-C", "12")
    wait_for_channel(lab, 2, "b")
    for number in range(6):
        for channel in "ab":
            done = lab.cli(1, "pub", channel, f"{channel}{number}", "-W", "20")
            assert done.returncode == 0, done.stderr
    out, _ = sub.communicate(timeout=20)
    text, error = recorder.communicate(timeout=20)
    assert (recorder.returncode, error) == (0, "")
    one_line(text, r"12 messages on 2 channels, \d+ bytes")
    return [json.loads(line) for line in out.splitlines()]


def spacing(messages):
    """Seconds since the first, of each message's arrival."""
    return [(each["received_at_ns"] - messages[0]["received_at_ns"]) / 1e9 for each in messages]


def test_play_sends_the_same_messages_in_order_and_with_the_same_spacing(udp_lab, tmp_path):
    path = tmp_path / "a.mcap"
    lab = udp_lab(2)
    before = record_twelve(lab, path)
    after = played(lab, 1, path, 12)
    assert [(m["channel"], m["text"]) for m in after] == [(m["channel"], m["text"]) for m in before]
    old, new = spacing(before), spacing(after)
    assert all(b >= a - SPACING_SLACK_S for a, b in zip(old, new)), (old, new)
    fast = played(lab, 1, path, 6, "--rate", "1000", "--channels", "b")
    assert [m["text"] for m in fast] == [f"b{number}" for number in range(6)]
    assert spacing(fast)[-1] < old[-1]


def test_record_finds_channels_on_the_air_that_nobody_here_uses(udp_lab, tmp_path):
    lab = udp_lab(2)
    recorder = start_record(lab, 2, "--jsonl", "-C", "3")
    pub = lab.start(1, program("swarmtalk-cli"), "pub", "4711", "x", "--repeat", "0",
                    "--rate", "20")
    out, error = recorder.communicate(timeout=30)
    end(pub)
    lines = [json.loads(line) for line in out.splitlines()]
    assert recorder.returncode == 0, error
    messages = [line for line in lines if line["type"] == "message"]
    assert [line["channel"] for line in messages] == ["4711"] * 3
    assert {"pose", "neighbours", "losses"} <= {line["type"] for line in lines}


def test_an_interrupted_recorder_leaves_a_whole_file(udp_lab, tmp_path):
    path = tmp_path / "a.mcap"
    lab = udp_lab(1)
    code, text, error = end(start_record(lab, 1, path))
    assert (code, error) == (128 + signal.SIGINT, "")
    one_line(text, r"0 messages on 0 channels, \d+ bytes")
    one_line(lab.cli(1, "play", path).stderr, "has no messages$")


def test_a_killed_recorder_leaves_whole_seconds_and_play_says_so(udp_lab, tmp_path):
    path = tmp_path / "a.mcap"
    lab = udp_lab(2)
    recorder = start_record(lab, 2, path, "--channels", "a")
    wait_for_channel(lab, 2, "a")
    empty = path.stat().st_size
    lab.cli(1, "pub", "a", "first")
    wait_for(lambda: path.stat().st_size > empty + 200, what="a chunk on the disk")
    pid = recorder_pid(path)
    os.kill(pid, signal.SIGKILL)
    recorder.communicate(timeout=20)
    done = lab.cli(1, "play", path)
    assert done.returncode == 0, done.stderr
    one_line(done.stderr, "cut off, as when a recorder is killed", r"\d+ whole chunks")


def recorder_pid(path):
    """Of the process that has the recording open."""
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if any(link.resolve() == path for link in (folder / "fd").iterdir()):
                return int(folder.name)
        except OSError:
            continue
    raise AssertionError(f"nobody has {path} open")


def test_a_full_disk_ends_the_recorder_with_one_line_and_a_readable_file(udp_lab, tmp_path):
    path = tmp_path / "a.mcap"
    lab = udp_lab(2)
    words = f"ulimit -f 4; exec {program('swarmtalk-cli')} record {path} --channels a"
    recorder = lab.start(2, "sh", "-c", words)
    wait_for_channel(lab, 2, "a")
    pub = lab.start(1, program("swarmtalk-cli"), "pub", "a", "--hex", os.urandom(600).hex(),
                    "--repeat", "0", "--rate", "50")
    out, error = recorder.communicate(timeout=60)
    end(pub)
    assert (recorder.returncode, out) == (1, "")
    one_line(error, "cannot write .*a.mcap: File too large", "readable up to its last whole chunk")
    assert path.stat().st_size <= 4 * 1024


def test_record_and_play_tell_mistakes_in_one_line(udp_lab, tmp_path):
    path = tmp_path / "a.mcap"
    text = tmp_path / "a.txt"
    text.write_text("no recording, but a text")
    lab = udp_lab(1)
    cli = program("swarmtalk-cli")
    assert lab.cli(1, "record", path, "-W", "0.1").returncode == 0
    for words, code, pattern in (
            (("record", path), 1, "File exists"),
            (("record",), 2, "FILE"),
            (("record", tmp_path / "no" / "a"), 1, "No such file"),
            (("play", text), 1, "not an MCAP file"),
            (("play", tmp_path / "b"), 1, "No such file"),
            (("play", tmp_path), 1, "not a regular file"),
            (("play", path), 1, "has no messages")):
        done = lab.cli(1, *words)
        assert done.returncode == code, done.stderr
        one_line(done.stderr, pattern)
    for words in (("record", tmp_path / "c"), ("play", path)):
        done = run(cli, "--socket", tmp_path / "none", *words)
        assert done.returncode == 3
        one_line(done.stderr, "none")
    assert not (tmp_path / "c").exists()


@pytest.fixture(scope="session")
def node_modules(tmp_path_factory):
    """A folder with the public JavaScript library, or the reason why there is none."""
    if not shutil.which("npm") or not shutil.which("node"):
        pytest.skip("npm and node are not installed")
    folder = tmp_path_factory.mktemp("node")
    try:
        done = run("npm", "install", "--no-audit", "--no-fund", "--prefix", folder,
                   "@mcap/core@2", "fzstd@0.1", "protobufjs@7", timeout=120)
    except subprocess.TimeoutExpired:
        pytest.skip("npm has no answer from its registry")
    if done.returncode != 0:
        pytest.skip("npm cannot install @mcap/core: " + done.stderr.strip().splitlines()[-1])
    return folder


@pytest.mark.long
def test_the_public_library_reads_what_sub_printed(udp_lab, tmp_path, node_modules):
    path = tmp_path / "a.mcap"
    before = record_twelve(udp_lab(2), path)
    done = run("node", HERE / "read_mcap.mjs", path,
               env={**os.environ, "NODE_MODULES": str(node_modules)})
    assert done.returncode == 0, done.stderr
    records = [json.loads(line) for line in done.stdout.splitlines()]
    heard = [record["content"] for record in records
             if record["schema"] == "swarmtalk.recording.HeardMessage"]
    assert len(heard) == len(before)
    for ours, theirs in zip(before, heard):
        for key in ("channel", "channel_number", "text", "sender", "epoch", "message_number"):
            assert theirs[key] == ours[key], (key, theirs, ours)
        assert abs(theirs["distance_m"] - ours["distance_m"]) < 1e-6
    assert any(record["topic"] == "/pose" for record in records)
