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

    wait_for(lambda: not is_listening(), what="the recorder before it to be gone")
    process = lab.start(robot, program("swarmtalk-cli"), "record", *arguments)
    wait_for(lambda: is_listening() or process.poll() is not None, what="the recorder")
    return process


def wait_for_channel(lab, robot, name):
    wait_for(lambda: any(name in (channel["name"], str(channel["number"])) and
                         channel["subscribers"] for channel in lab.status(robot)["channels"]),
             what=f"a subscription of {name}")


CLOCK = "clock is not synchronised"  # which is so on some machines


def without(error, *hints):
    return "".join(line for line in error.splitlines(True)
                   if not any(hint in line for hint in hints))


def end(process, number=signal.SIGINT):
    """Ends it; returns its exit code, standard output and error."""
    process.send_signal(number)
    out, error = process.communicate(timeout=90)
    return process.returncode, out, without(error, CLOCK)


def without_hints(error):
    """What a recorder says, but that it has heard nothing yet: nobody speaks before it listens, and
    that takes long on a slow machine."""
    return without(error, CLOCK, "nothing was heard yet")


def as_they_came(messages):
    """In the order they came in: those of one moment are handed out channel by channel."""
    return sorted(messages, key=lambda message: message["received_at_ns"])


def played(lab, robot, path, count, *arguments):
    """What `record --jsonl` of robot 2 says of `count` messages that the robot plays."""
    recorder = start_record(lab, 2, "--jsonl", "--channels", "a,b", "-C", str(count), "-W", "60")
    wait_for_channel(lab, 2, "b")
    done = lab.cli(robot, "play", path, *arguments)
    assert done.returncode == 0, done.stderr
    out, _ = recorder.communicate(timeout=90)
    return as_they_came(line for line in map(json.loads, out.splitlines())
                        if line["type"] == "message")


def record_twelve(lab, path, log_line=None):
    """Twelve messages on two channels, 40 a second; returns what `sub --json` printed of them."""
    recorder = start_record(lab, 2, path, "--channels", "a,b", "-C", "12")
    sub = lab.start_sub(2, "a", "b", "--json", "-C", "12")
    wait_for_channel(lab, 2, "b")
    if log_line is not None:
        assert lab.cli(1, "pub", "debug", log_line).returncode == 0
    for number in range(6):
        for channel in "ab":
            done = lab.cli(1, "pub", channel, f"{channel}{number}", "-W", "60")
            assert done.returncode == 0, done.stderr
    out, _ = sub.communicate(timeout=90)
    text, error = recorder.communicate(timeout=90)
    assert (recorder.returncode, without_hints(error)) == (0, "")
    one_line(text, r"12 messages on 2 channels, \d+ bytes")
    return as_they_came(map(json.loads, out.splitlines()))


def spacing(messages):
    """Seconds since the first, of each message's arrival."""
    return [(each["received_at_ns"] - messages[0]["received_at_ns"]) / 1e9 for each in messages]


def play_sends_the_same_messages_in_order_and_with_the_same_spacing(lab, tmp_path):
    path = tmp_path / "a.mcap"
    before = record_twelve(lab, path)
    after = played(lab, 1, path, 12)
    assert [(m["channel"], m["text"]) for m in after] == [(m["channel"], m["text"]) for m in before]
    old, new = spacing(before), spacing(after)
    assert all(b >= a - SPACING_SLACK_S for a, b in zip(old, new)), (old, new)
    fast = played(lab, 1, path, 6, "--rate", "1000", "--channels", "b")
    assert [m["text"] for m in fast] == [f"b{number}" for number in range(6)]
    assert spacing(fast)[-1] < old[-1]


def play_keeps_the_order_across_channels_however_fast(lab, tmp_path):
    path = tmp_path / "a.mcap"
    said = ["a0", "a1", "a2", "b0", "b1", "b2", "a3", "a4", "b3"]
    recorder = start_record(lab, 2, path, "--channels", "a,b", "-C", str(len(said)))
    wait_for_channel(lab, 2, "b")
    for text in said:
        assert lab.cli(1, "pub", text[0], text, "-W", "60").returncode == 0
    recorder.communicate(timeout=90)
    again = played(lab, 1, path, len(said), "--rate", "1000")
    assert [message["text"] for message in again] == said


def record_finds_channels_on_the_air_that_nobody_here_uses(lab, tmp_path):
    recorder = start_record(lab, 2, "--jsonl", "-C", "3")
    pub = lab.start(1, program("swarmtalk-cli"), "pub", "4711", "x", "--repeat", "0",
                    "--rate", "20")
    out, error = recorder.communicate(timeout=90)
    end(pub)
    lines = [json.loads(line) for line in out.splitlines()]
    assert recorder.returncode == 0, error
    messages = [line for line in lines if line["type"] == "message"]
    assert [line["channel"] for line in messages] == ["4711"] * 3
    assert {"pose", "neighbours", "losses"} <= {line["type"] for line in lines}


def more_channels_than_one_program_may_use_are_recorded_or_named(udp_lab, tmp_path):
    base = tmp_path / "base.toml"
    base.write_text("[limits]\nchannels_per_client = 1\n")
    lab = udp_lab(2, "--config", base)
    recorder = start_record(lab, 2, tmp_path / "all.mcap")  # at most eight programs, one: `debug`
    everything = lab.start(2, program("swarmtalk-cli"), "sub", "--all")
    wait_for(lambda: any(each["name"] == "debug" and each["subscribers"] == 3
                         for each in lab.status(2)["channels"]), what="both")
    for number in range(10):
        assert lab.cli(1, "pub", number, "x").returncode == 0

    def heard():
        return sum(each["subscribers"] for each in lab.status(2)["channels"]
                   if each["number"] < 10)

    wait_for(lambda: heard() >= 7 + 7, what="subscriptions")
    for process, pattern in ((recorder, "3 channels left out"), (everything, "")):
        code, text, error = end(process)
        assert code == 128 + signal.SIGINT
        lines = [line for line in error.splitlines() if "is left out" in line]
        assert len(lines) == len(set(lines)) == 3, error
        assert all("channels_per_client" in line for line in lines), error
        if pattern:
            assert error.splitlines() == lines
            one_line(text, pattern)
        else:
            assert error.splitlines()[3:] == ["swarmtalk-cli: 3 channels left out"], error


def record_one_of_each(lab, path, *channels):
    """A message of robot 1 on each channel, recorded by robot 2."""
    recorder = start_record(lab, 2, path, "--channels", ",".join(channels), "-C", len(channels))
    wait_for_channel(lab, 2, "a")
    for channel in channels:
        assert lab.cli(1, "pub", channel, "x").returncode == 0
    assert recorder.wait(timeout=60) == 0
    recorder.communicate()


def play_that_waits_in_a_quiet_lab_says_what_for(lab, other, tmp_path):
    path = tmp_path / "waits.mcap"
    record_one_of_each(lab, path, "a")
    player = other.start(1, program("swarmtalk-cli"), "play", path, "--wait")
    line = player.stderr.readline()
    assert "waiting: no other robot is heard" in line and "beacon_ms" in line
    listener = other.start_sub(1, "a", "-C", "1")
    assert player.wait(timeout=60) == 0, player.communicate()
    assert "x" in listener.communicate(timeout=90)[0]
    player.communicate()


def play_leaves_out_what_robots_say_to_who_looks(lab, other, tmp_path):
    """The programs of `other` may not send there."""
    path = tmp_path / "a.mcap"
    record_one_of_each(lab, path, "harvest", "a")
    done = other.cli(1, "play", path)
    assert done.returncode == 0, done.stderr
    one_line(done.stderr, "1 message of the channel harvest is left out", "-c harvest")
    done = other.cli(1, "play", path, "-c", "harvest")
    assert done.returncode == 1
    one_line(done.stderr, "harvest")
    assert lab.cli(1, "play", path, "-c", "harvest").stderr == ""
    lines = tmp_path / "lines.mcap"
    record_one_of_each(lab, lines, "debug", "a")
    done = other.cli(1, "play", lines)
    assert done.returncode == 0, done.stderr
    one_line(done.stderr, "lines of the channel debug are left out", "debug = true")


def test_what_a_lab_said_is_played_in_another(udp_lab, tmp_path):
    base = tmp_path / "base.toml"
    base.write_text("[reserved]\nharvest = true\ndebug = true\n")
    lab, other = udp_lab(2, "--config", base), udp_lab(1)
    play_that_waits_in_a_quiet_lab_says_what_for(lab, other, tmp_path)
    play_leaves_out_what_robots_say_to_who_looks(lab, other, tmp_path)
    more_channels_than_one_program_may_use_are_recorded_or_named(udp_lab, tmp_path)


def a_channel_recorded_by_its_number_is_played_by_its_name(lab, tmp_path):
    path = tmp_path / "a.mcap"
    recorder = start_record(lab, 2, "-C", "3", path)  # nobody there names the channel
    pub = lab.start(1, program("swarmtalk-cli"), "pub", "alarm", "x", "--repeat", "0",
                    "--rate", "20")
    assert recorder.wait(timeout=60) == 0
    recorder.communicate()
    end(pub)
    sub = lab.start_sub(2, "alarm", "-C", "1", "-W", "60")
    done = lab.cli(1, "play", "-c", "othr", "-c", "alarm", path)
    assert done.returncode == 0
    one_line(done.stderr, "a.mcap has no messages of 'othr'$")
    assert "x" in sub.communicate(timeout=90)[0]
    done = lab.cli(1, "play", "-c", "other", path)
    one_line(done.stderr, "no messages of these channels")


def a_channel_that_is_named_twice_is_heard_once(lab, tmp_path):
    sub = lab.start_sub(2, "alarm", "alarm", "62769", "-F", "%c %p", "-C", "2", "-W", "60")
    number, = [each["number"] for each in lab.status(2)["channels"] if each["name"] == "alarm"]
    recorder = start_record(lab, 2, "--jsonl", "-c", f"alarm,alarm,{number}", "-C", "2", "-W", "60")
    wait_for(lambda: [each["subscribers"] for each in lab.status(2)["channels"]
                      if each["number"] == number] == [2], what="one subscription each")
    for text in "xy":
        assert lab.cli(1, "pub", "alarm", text).returncode == 0
    assert sub.communicate(timeout=90)[0] == "alarm x\nalarm y\n"
    out, _ = recorder.communicate(timeout=90)
    heard = [each for each in map(json.loads, out.splitlines()) if each["type"] == "message"]
    assert [each["text"] for each in heard] == ["x", "y"]


def a_misspelt_channel_is_told_with_the_one_that_there_is(lab, tmp_path):
    path = tmp_path / "a.mcap"
    talker = lab.start(2, program("swarmtalk-cli"), "pub", "alarm", "x", "--repeat", "0",
                       "--rate", "20")
    recorder = lab.start(2, program("swarmtalk-cli"), "record", path, "-c", "alrm", "-W", "60")
    told = next(line for line in recorder.stderr if CLOCK not in line)
    assert "nobody publishes 'alrm' as far as this robot knows; did you mean 'alarm'?" in told
    end(recorder)
    assert lab.cli(2, "record", path, "--replace", "-c", "alarm", "-C", "1",
                   "-W", "60").returncode == 0
    end(talker)
    done = lab.cli(2, "play", path, "-c", "alrm")
    assert done.returncode == 1
    one_line(done.stderr, r"has no messages of these channels; did you mean 'alarm'\?$")
    done = lab.cli(2, "play", path, "-c", "alarm,alrm")
    assert done.returncode == 0
    one_line(done.stderr, r"has no messages of 'alrm'; did you mean 'alarm'\?$")


def one_message_is_told_as_one(lab, tmp_path):
    recorder = start_record(lab, 2, tmp_path / "a.mcap", "-c", "alarm", "-C", "1", "-W", "60")
    wait_for(lambda: any(each["name"] == "alarm" and each["subscribers"]
                         for each in lab.status(2)["channels"]), what="the recorder")
    assert lab.cli(1, "pub", "alarm", "x").returncode == 0
    out, _ = recorder.communicate(timeout=90)
    assert recorder.returncode == 0
    one_line(out, r"1 message on 1 channel, \d+ bytes")


def an_interrupted_recorder_leaves_a_whole_file(lab, tmp_path):
    path = tmp_path / "a.mcap"
    code, text, error = end(start_record(lab, 1, path))
    assert (code, error) == (128 + signal.SIGINT, "")
    one_line(text, r"0 messages on 0 channels, \d+ bytes")
    one_line(lab.cli(1, "play", path).stderr, "has no messages$")


def a_killed_recorder_leaves_whole_seconds_and_play_says_so(lab, tmp_path):
    path = tmp_path / "a.mcap"
    recorder = start_record(lab, 2, path, "--channels", "a")
    wait_for_channel(lab, 2, "a")
    lab.cli(1, "pub", "a", "first")
    wait_for(lambda: lab.cli(1, "play", path).returncode == 0, what="the message on the disk")
    os.kill(recorder_pid(path), signal.SIGKILL)
    recorder.communicate(timeout=90)
    done = lab.cli(1, "play", path)
    assert done.returncode == 0, done.stderr
    one_line(done.stderr, "cut off, as when a recorder is killed, or damaged there",
             r"in \d+ whole chunks? could be read")


def recorder_pid(path):
    """Of the process that has the recording open."""
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if any(link.resolve() == path for link in (folder / "fd").iterdir()):
                return int(folder.name)
        except OSError:
            continue
    raise AssertionError(f"nobody has {path} open")


def a_full_disk_ends_the_recorder_with_one_line_and_a_readable_file(lab, tmp_path):
    path = tmp_path / "a.mcap"
    words = f"ulimit -f 24; exec {program('swarmtalk-cli')} record {path} --channels a"
    recorder = lab.start(2, "sh", "-c", words)
    wait_for_channel(lab, 2, "a")
    pub = lab.start(1, program("swarmtalk-cli"), "pub", "a", "--hex", os.urandom(600).hex(),
                    "--repeat", "0", "--rate", "50")
    out, error = recorder.communicate(timeout=90)
    end(pub)
    assert (recorder.returncode, out) == (1, "")
    one_line(without_hints(error), "cannot write .*a.mcap: File too large",
             "readable up to its last whole chunk")
    assert path.stat().st_size <= 24 * 1024


def mistakes_of_record_are_told_in_one_line(lab, tmp_path):
    path = tmp_path / "a.mcap"
    assert lab.cli(1, "record", path, "-W", "0.1").returncode == 0
    for words, pattern in ((("record", path), "File exists; --replace overwrites it"),
                           (("record", tmp_path, "--replace"), "Is a directory"),
                           (("record", tmp_path / "no" / "a"), "No such file"),
                           (("play", path), "has no messages")):
        done = lab.cli(1, *words)
        assert done.returncode == 1, done.stderr
        one_line(done.stderr, pattern)
    done = run(program("swarmtalk-cli"), "--socket", tmp_path / "none", "play", path)
    assert done.returncode == 3
    one_line(done.stderr, "none does not exist")


def test_two_robots_are_recorded_and_played(udp_lab, tmp_path):
    lab = udp_lab(2)
    for step in (a_channel_recorded_by_its_number_is_played_by_its_name,  # nobody has named it yet
                 a_channel_that_is_named_twice_is_heard_once,
                 a_misspelt_channel_is_told_with_the_one_that_there_is,
                 one_message_is_told_as_one, an_interrupted_recorder_leaves_a_whole_file,
                 play_sends_the_same_messages_in_order_and_with_the_same_spacing,
                 play_keeps_the_order_across_channels_however_fast,
                 record_finds_channels_on_the_air_that_nobody_here_uses,
                 a_killed_recorder_leaves_whole_seconds_and_play_says_so,
                 a_full_disk_ends_the_recorder_with_one_line_and_a_readable_file,
                 mistakes_of_record_are_told_in_one_line):
        folder = tmp_path / step.__name__
        folder.mkdir()
        step(lab, folder)


@pytest.mark.logic
def test_mistakes_are_told_in_one_line_without_a_daemon(tmp_path):
    text = tmp_path / "a.txt"
    text.write_text("no recording, but a text")
    for words, code, pattern in (
            (("record",), 2, "FILE"), (("play", text), 1, "not an MCAP file"),
            (("play", tmp_path / "b"), 1, "No such file"),
            (("play", tmp_path), 1, "not a regular file"),
            (("record", tmp_path / "c"), 3, "none does not exist")):
        done = run(program("swarmtalk-cli"), "--socket", tmp_path / "none", *words)
        assert done.returncode == code, (words, done.stderr)
        one_line(done.stderr, pattern)
    assert not (tmp_path / "c").exists()


@pytest.fixture(scope="session")
def node_modules(tmp_path_factory):
    """A folder with the public JavaScript library, or the reason why there is none."""
    if not shutil.which("npm") or not shutil.which("node"):
        pytest.skip("npm and node are not installed")
    folder = tmp_path_factory.mktemp("node")
    try:
        done = run("npm", "install", "--no-audit", "--no-fund", "--prefix", folder,
                   "@mcap/core@2.2.1", "fzstd@0.1.1", "protobufjs@7.6.6", timeout=120)
    except subprocess.TimeoutExpired:
        pytest.skip("npm has no answer from its registry")
    if done.returncode != 0:
        pytest.skip("npm cannot install @mcap/core: " + done.stderr.strip().splitlines()[-1])
    return folder


@pytest.mark.field
def test_the_public_library_reads_what_sub_printed(udp_lab, tmp_path, node_modules):
    path = tmp_path / "a.mcap"
    speaks = tmp_path / "speaks.toml"
    speaks.write_text("[reserved]\ndebug = true\n")
    before = record_twelve(udp_lab(2, "--config", speaks), path, "tired")
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
    # What a log panel shows, and the same with the fields of ours.
    said = {record["topic"]: (record["schema"], record["content"]) for record in records
            if record["topic"].startswith("/log")}
    assert {topic: schema for topic, (schema, _) in said.items()} == {
        "/log": "foxglove.Log", "/log_lines": "swarmtalk.recording.LogLine"}
    assert (said["/log"][1]["name"], said["/log"][1]["message"]) == ("robot/1", "tired")
    assert (said["/log_lines"][1]["robot"], said["/log_lines"][1]["text"]) == (1, "tired")
    # What a 3D panel draws: once robot 1 is known it is in each picture.
    drawn = {topic: [record for record in records if record["topic"] == topic]
             for topic in ("/swarm", "/tf", "/robots")}
    assert {topic: each[-1]["schema"] for topic, each in drawn.items()} == {
        "/swarm": "foxglove.SceneUpdate", "/tf": "foxglove.FrameTransforms",
        "/robots": "swarmtalk.Robots"}
    robot = next(each for each in drawn["/robots"][-1]["content"]["robots"] if each["id"] == 1)
    assert robot["x_m"] == 0 and not robot.get("is_self")
    assert "robot/1" in [each["id"] for each in drawn["/swarm"][-1]["content"]["entities"]]
    assert "robot/1" in [each["child_frame_id"]
                         for each in drawn["/tf"][-1]["content"]["transforms"]]
