"""The subcommands that look: channels, hz, ping, decode, pose watch, top, radar; and the formats of
sub and pub. Screens are looked at through tmux; what --json prints is held against its document."""
import itertools
import json
import os
import pty
import re
import shutil
import signal
import subprocess

import pytest
from conftest import ROOT, one_line, program, run, wait_for

FRAME = ("535401010032000000023096c8a8000001ce01f4000000000000170002000001" +
         "2b0001126700000006c8a80007000000a040")
TERMINALS = itertools.count()
KINDS = {bool: "true or false", int: "integer", float: "number", str: "text", type(None): "null"}


@pytest.fixture
def lab(udp_lab):
    """Three robots; robot 1 publishes on `alarm` and robot 2 on 4711, and robot 3 hears `alarm`."""
    made = udp_lab(3)
    cli = program("swarmtalk-cli")
    started = [made.start(1, cli, "pub", "alarm", "hello", "--repeat", "0", "--rate", "20"),
               made.start(2, cli, "pub", "4711", "--fmt", "<Hf", "7 2.5", "--repeat", "0",
                          "--rate", "20")]
    started.append(made.start_sub(3, "alarm"))
    started.append(made.start(1, cli, "ping", "--answer"))
    wait_for(lambda: any(each["name"] == "ping" and each["subscribers"]
                         for each in made.status(1)["channels"]), what="the answering robot")
    yield made
    for process in started:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)


def test_channels_names_who_publishes_on_the_air(lab):
    done = lab.cli(3, "channels", "--json", "-W", "0.6")
    assert done.returncode == 0, done.stderr
    channels = {each["name"] or each["number"]: each
                for each in json.loads(done.stdout)["channels"]}
    assert [each["node_id"] for each in channels["alarm"]["on_air"]] == [1]
    assert channels["alarm"]["subscribers_here"] == 1
    assert [each["node_id"] for each in channels[4711]["on_air"]] == [2]
    assert channels[4711]["subscribers_here"] == 0
    assert channels[4711]["on_air"][0]["messages_per_s"] > 0
    done = lab.cli(3, "channels", "-W", "0.3")
    assert re.search(r"^alarm +\d+ .* 1$", done.stdout, re.M), done.stdout


def test_sub_prints_all_channels_and_in_a_format_of_ones_own(lab):
    done = lab.cli(3, "sub", "--all", "-C", "12", "-F", "%c %s %l", "-W", "20")
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.splitlines()) == {"alarm 1 5", "4711 2 6"}
    done = lab.cli(3, "sub", "4711", "--fmt", "<Hf", "-C", "1", "--time", "-W", "20")
    assert re.match(r"\d{4}-\d\d-\d\dT[\d:.]+Z  4711: robot 2 .* values 7 2\.5$", done.stdout)
    done = lab.cli(3, "sub", "4711", "--fmt", "<Hf", "-C", "1", "--json", "-W", "20")
    assert json.loads(done.stdout)["values"] == [7, 2.5]
    done = lab.cli(3, "sub", "alarm", "--fmt", "<Hf", "-C", "1", "-W", "20")
    assert "values (not <Hf: 5 bytes, not 6)" in done.stdout


def test_hz_tells_the_rate_of_each_sender(lab):
    done = lab.cli(3, "hz", "alarm", "-C", "1")
    assert re.match(r"alarm: robot 1  \d+\.\d\d Hz  every 0\.\d+ s", done.stdout), done.stdout


def test_ping_tells_round_trips_and_who_does_not_answer(lab):
    done = lab.cli(3, "ping", "1", "-C", "3", "--period", "5", "--json")
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert [each["sequence"] for each in answers] == [1, 2, 3]
    assert [each["hops_there"] for each in answers] == [0, 0, 0]
    assert answers[-1]["heard_there"] == answers[-1]["told_of"] == answers[-1]["answered"] == 3
    done = lab.cli(3, "ping", "2", "-C", "2", "--period", "0.2")
    assert done.returncode == 1
    assert done.stdout.count("no answer within 0.20 s") == 2
    assert "2 sent, 0 answered; lost on the way there 0, back 0, not known where 2" in done.stdout
    one_line(done.stderr, "robot 2 has not answered")
    done = lab.cli(3, "ping", "3")
    assert done.returncode == 2
    one_line(done.stderr, "robot 3 is this one")


def test_daemons_that_report_answer_ping_and_every_hop_is_told(udp_lab, tmp_path):
    """A row of four robots, each of which hears the next alone; no program runs on them."""
    config = tmp_path / "row.toml"
    config.write_text("[links.wifi]\nvirtual_range_m = 0.6\n[reserved]\nreport = true\n")
    lab = udp_lab(4, "--config", config)
    for robot in range(1, 5):
        assert lab.cli(robot, "pose", "set", robot * 0.5, 0, 0).returncode == 0
    done = lab.cli(1, "ping", "4", "-C", "6", "--period", "0.4", "--by-hop", "--json")
    assert done.returncode == 0, done.stderr
    last = json.loads(done.stdout.splitlines()[-1])
    assert last["hops_there"] == last["hops_back"] == 2
    assert [hop["robot"] for hop in last["hops"]] == [2, 3, 4]
    assert [hop["hops_there"] for hop in last["hops"]] == [0, 1, 2]
    assert last["hops"][2]["answered"] == last["answered"] >= 4
    assert all(hop["answered"] and hop["median_ms"] > 0 for hop in last["hops"])
    text = lab.cli(1, "ping", "3", "-C", "4", "--period", "0.4", "--by-hop").stdout
    assert re.search(r"^hop 1  robot 2: \d+\.\d\d ms  \d sent, ", text, re.M), text
    assert re.search(r"^hop 2  robot 3: \d+\.\d\d ms  4 sent, ", text, re.M), text


def test_a_daemon_that_does_not_report_answers_no_ping(udp_lab):
    lab = udp_lab(2)
    done = lab.cli(1, "ping", "2", "-C", "1", "--period", "0.5")
    assert done.returncode == 1
    one_line(done.stderr, "report = true", "ping --answer")


def test_pub_sends_a_message_a_line(udp_lab, tmp_path):
    lab = udp_lab(2)
    sub = lab.start_sub(2, "a", "--json", "-C", "3")
    lines = tmp_path / "lines"
    lines.write_text("one\n\nthree")
    done = lab.cli(1, "pub", "a", "--lines", "--file", lines, "--rate", "100")
    assert (done.returncode, done.stderr) == (0, "")
    out, _ = sub.communicate(timeout=20)
    assert [json.loads(line)["text"] for line in out.splitlines()] == ["one", "", "three"]
    lines.write_text("1 2\n1\n")
    done = lab.cli(1, "pub", "a", "--lines", "--file", lines, "--fmt", "<HH")
    assert done.returncode == 1
    one_line(done.stderr, "line 2 of .*: format <HH takes 2 values, not 1; the lines before")


def test_decode_names_the_fields_of_a_frame():
    cli = program("swarmtalk-cli")
    ethernet = "ffffffffffff02535400000288b5"
    for text in (FRAME, ethernet + FRAME):
        done = run(cli, "decode", text, "--json")
        assert done.returncode == 0, done.stderr
        frame = json.loads(done.stdout)
        assert (frame["node"], frame["profile"], frame["pose"]["x_m"]) == (2, "wifi", 0.5)
        (packet,) = frame["packets"]
        assert (packet["channel"], packet["hex"]) == (4711, "07000000a040")
    assert "  channel 4711\n" in run(cli, "decode", FRAME).stdout
    for length in range(2, len(FRAME), 2):
        done = run(cli, "decode", FRAME[:length]) if length % 8 == 2 else None
        if done is not None:
            assert done.returncode == 1
            one_line(done.stderr, "air frame does|not whole")


def test_mistakes_are_one_line_and_the_documented_exit_code(udp_lab, tmp_path):
    lab = udp_lab(1)
    for words, code, pattern in (
            (("sub",), 2, "CHANNEL, or --all"),
            (("sub", "a", "-F", "%q"), 2, "-F has %q"),
            (("sub", "a", "--fmt", "k"), 2, "--fmt k is not a format"),
            (("pub", "a"), 2, "DATA"),
            (("pub", "a", "--fmt", "B", "256"), 2, "'256' is not a value"),
            (("pub", "a", "--file", tmp_path / "none"), 1, "No such file"),
            (("decode", "zz"), 2, "not hexadecimal"),
            (("top",), 1, "top --once"),
            (("radar",), 1, "radar --once"),
            (("top", "--sort", "x"), 2, "sort")):
        done = lab.cli(1, *words)
        assert done.returncode == code, (words, done.stderr)
        one_line(done.stderr, pattern)
    for words in (("channels",), ("hz", "a"), ("pose", "watch"), ("top", "--once"),
                  ("radar", "--once"), ("sub", "--all")):
        done = run(program("swarmtalk-cli"), "--socket", tmp_path / "none", *words)
        assert done.returncode == 3, (words, done.stderr)
        one_line(done.stderr, "does not exist")


def test_a_daemon_that_dies_ends_the_screens_with_one_line(udp_lab):
    lab = udp_lab(1)
    started = [lab.start(1, program("swarmtalk-cli"), verb, "--json", "--period", "0.1")
               for verb in ("top", "radar")]
    for process in started:
        assert process.stdout.readline()
    os.kill(lab.pid(1), signal.SIGKILL)
    for process in started:
        _, error = process.communicate(timeout=20)
        assert process.returncode == 3
        one_line(error, "swarmtalkd")


class Tmux:
    """A terminal of a given size in which a command runs."""

    def __init__(self, width, height, command):
        # A server of its own: the one before may still be ending.
        self.words = ["tmux", "-L", f"swarmtalk-{os.getpid()}-{next(TERMINALS)}", "-f", "/dev/null"]
        run(*self.words, "new-session", "-d", "-x", width, "-y", height,
            f"{command}; echo exit code $?; exec sleep 60")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        run(*self.words, "kill-server")

    def text(self):
        return run(*self.words, "capture-pane", "-p").stdout

    def keys(self, *keys):
        run(*self.words, "send-keys", *keys)

    def wait(self, pattern):
        wait_for(lambda: re.search(pattern, self.text(), re.M), timeout=20, what=pattern)
        return self.text()


needs_tmux = pytest.mark.skipif(not shutil.which("tmux"), reason="tmux is not installed")


def in_robot(lab, robot, *words):
    return " ".join([program("swarmtalk-lab"), "--name", lab.name, "exec", str(robot), "--",
                     program("swarmtalk-cli"), *words])


@needs_tmux
@pytest.mark.parametrize("width", [80, 40])
def test_top_and_radar_fit_the_terminal_and_obey_keys(lab, width):
    with Tmux(width, 24, in_robot(lab, 3, "top")) as screen:
        text = screen.wait("^alarm +[0-9]")
        for head in ("^CHANNEL +MSG/S", "^PROGRAM", "^NEIGHBOUR", "^4711 +[0-9]", "^q quit"):
            assert re.search(head, text, re.M), text
        assert ("ROBOTS" in text) == (width == 80), text
        assert all(len(line) <= width for line in text.splitlines())
        screen.keys("s")
        screen.wait("sort:rate")
        screen.keys("/")
        screen.keys("ala", "Enter")
        text = screen.wait("filter:ala")
        assert "4711" not in text and "alarm" in text, text
        screen.keys("q")
        screen.wait("^exit code 0$")
    with Tmux(width, 24, in_robot(lab, 3, "radar", "--range", "1")) as screen:
        text = screen.wait(r"^2 heard; rings at 0\.50 m and 1\.00 m$")
        assert re.search(r"\^.*$", text, re.M) and re.search(r"[ .]2[ .~?]", text), text
        screen.keys("+")
        screen.wait(r"rings at 0\.25 m and 0\.50 m$")
        screen.keys("C-c")
        screen.wait("^exit code 130$")


def test_a_terminal_that_goes_away_ends_top(lab):
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm"}
    words = in_robot(lab, 3, "top").split()
    process = subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=subprocess.PIPE,
                               env=environment, start_new_session=True)
    os.close(theirs)
    assert os.read(ours, 10)
    os.close(ours)
    process.communicate(timeout=20)
    assert process.returncode is not None


def paths(value, at=""):
    """Each leaf of a JSON value, as ("a.b[].c", its kind)."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from paths(each, f"{at}.{key}" if at else key)
    elif isinstance(value, list):
        for each in value:
            yield from paths(each, at + "[]")
    else:
        yield at, KINDS[type(value)]


def documented(heading):
    """The table under a heading of docs/cli-json.md: {path: kinds}."""
    text = (ROOT / "docs/cli-json.md").read_text()
    section = text.split(f"## `{heading}`\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `([^`]+)` \| ([^|]+) \|", section, re.M)
    return {path: {kind.strip() for kind in kinds.split(", ")} for path, kinds in rows}


def named(path):
    """Keys that are names of things stand for all of their kind."""
    return re.sub(r"\b(counters|shares)\.\w+", r"\1.NAME", path)


VERBS = {
    "channels": ("-W", "0.5"), "hz": ("alarm", "-C", "1"), "top": ("-C", "1"),
    "neighbours": (), "pose get": (), "pose watch": ("-C", "1"),
    "ping": ("1", "-C", "1", "--period", "10"),
    "sub": ("alarm", "-C", "1", "-W", "20"), "status": (), "decode": (FRAME,),
    "doctor": ("--period", "0.2", "--peer", "1"),
}


def test_what_json_prints_is_what_its_document_says(lab):
    wait_for(lambda: len(json.loads(lab.cli(3, "neighbours", "--json").stdout)["neighbours"]) == 2,
             what="the neighbours")
    for verb, words in VERBS.items():
        done = lab.cli(3, *verb.split(), *words, "--json")
        assert done.returncode == 0, (verb, done.stderr)
        told = documented(verb + " --json")
        found = set(paths(json.loads(done.stdout.splitlines()[-1])))
        for path, kind in found:
            path = named(path)
            assert path in told, f"{verb} prints {path}; docs/cli-json.md has no such key"
            kinds = told[path] | ({"integer"} if "number" in told[path] else set())
            assert kind in kinds, f"{verb} prints {path} as {kind}; docs/cli-json.md says {kinds}"
        keys = {named(path) for path, _ in found}
        for path in told:
            within = [key for key in keys if key == path or key.startswith(path + ".") or
                      key.startswith(path + "[]") or path.startswith(key + ".") or
                      path.startswith(key + "[]")]
            empty = any("[]" in path and not any(key.startswith(path[:m.end()]) for key in keys)
                        for m in re.finditer(r"\[\]", path))
            assert within or empty, f"docs/cli-json.md has {path}; {verb} does not print it"


def test_every_table_of_the_document_is_held():
    text = (ROOT / "docs/cli-json.md").read_text()
    assert set(re.findall(r"^## `(.+) --json`$", text, re.M)) == set(VERBS)
