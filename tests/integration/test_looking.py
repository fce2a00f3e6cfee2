"""The subcommands that look: channels, hz, ping, decode, pose watch, top, radar; and the formats of
sub and pub. What --json prints is held against its document. Screens: test_screens.py; against a
daemon that dies or does not answer, and a ping over hops: tests/unit/cli/looking_test.cpp."""
import json
import re
import signal

import pytest
from conftest import ROOT, one_line, program, run, wait_for

FRAME = ("535401010032000000023096c8a8000001ce01f4000000000000170002000001" +
         "2b0001126700000006c8a80007000000a040")
KINDS = {bool: "true or false", int: "integer", float: "number", str: "text", type(None): "null"}


def channels_names_who_publishes_on_the_air(lab):
    done = lab.cli(3, "channels", "--json", "-W", "1")
    assert done.returncode == 0, done.stderr
    channels = {each["name"] or each["number"]: each
                for each in json.loads(done.stdout)["channels"]}
    assert [each["node_id"] for each in channels["alarm"]["on_air"]] == [1]
    assert channels["alarm"]["subscribers_here"] == 1
    assert [each["node_id"] for each in channels[4711]["on_air"]] == [2]
    assert channels[4711]["subscribers_here"] == 0
    assert channels[4711]["on_air"][0]["messages_per_s"] > 0
    done = lab.cli(3, "channels", "-W", "1")
    assert re.search(r"^alarm +\d+ .* 1$", done.stdout, re.M), done.stdout
    assert "this robot" not in done.stdout, "signs are explained where they stand"
    done = lab.cli(1, "channels", "-W", "1")
    assert re.search(r"^alarm +\d+ .* 1\*$", done.stdout, re.M), done.stdout
    assert "*: this robot." in done.stdout


def sub_prints_all_channels_and_in_a_format_of_ones_own(lab):
    done = lab.cli(3, "sub", "--all", "-C", "12", "-F", "%c %s %l", "-W", "60")
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.splitlines()) == {"alarm 1 5", "4711 2 6"}
    done = lab.cli(3, "sub", "alarm", "-C", "1", "-F", "%s\\0", "-W", "60")
    assert done.stdout == "1\0\n"
    done = lab.cli(3, "sub", "4711", "--fmt", "<Hf", "-C", "1", "--time", "-W", "60")
    assert re.match(r"\d{4}-\d\d-\d\dT[\d:.]+Z  4711: robot 2 .* values 7 2\.5$", done.stdout)
    done = lab.cli(3, "sub", "4711", "--fmt", "<Hf", "-C", "1", "--json", "-W", "60")
    assert json.loads(done.stdout)["values"] == [7, 2.5]
    done = lab.cli(3, "sub", "alarm", "--fmt", "<Hf", "-C", "1", "-W", "60")
    assert "values (not <Hf: 5 bytes, not 6)" in done.stdout


def top_finds_a_channel_by_its_name_where_only_its_number_is_known(lab):
    channels = json.loads(lab.cli(3, "channels", "--json", "-W", "1").stdout)["channels"]
    number, = [each["number"] for each in channels if each["name"] == "alarm"]
    done = lab.cli(2, "top", "--once", "--filter", "alarm")  # nobody uses it on robot 2
    assert done.returncode == 0, done.stderr
    assert re.search(rf"^{number} +[0-9]", done.stdout, re.M), done.stdout
    assert "4711" not in done.stdout
    done = lab.cli(2, "top", "--once", "--filter", "alar")
    assert str(number) not in done.stdout and "none of that name" in done.stdout, done.stdout


def hz_tells_the_rate_of_each_sender(lab):
    done = lab.cli(3, "hz", "alarm", "-C", "1", "--period", "1")
    assert re.match(r"alarm: robot 1  \d+\.\d\d Hz  every 0\.\d+ s", done.stdout), done.stdout


def ping_is_answered_by_a_program_that_does(lab):
    """By daemons: tests/virtual/ping_test.cpp."""
    done = lab.cli(3, "ping", "1", "-C", "3", "--period", "2", "--json")
    assert done.returncode == 0, done.stderr
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert [each["sequence"] for each in answers] == [1, 2, 3]
    assert [each["hops_there"] for each in answers] == [0, 0, 0]
    assert answers[-1]["heard_there"] == answers[-1]["told_of"] == answers[-1]["answered"] == 3


@pytest.mark.logic
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
    for nothing in ("", "\\n\\n"):
        done = run("sh", "-c", f"printf '{nothing}' | {cli} decode -")
        assert done.returncode == 1
        one_line(done.stderr, "there was no frame on standard input")
    done = run(cli, "decode", FRAME[:20], "zz00", FRAME, "--json")
    assert done.returncode == 2
    cut, whole = map(json.loads, done.stdout.splitlines())
    assert set(cut) == {"bytes", "problem"} and cut["bytes"] == 10
    assert cut["problem"] in done.stderr and whole["problem"] is None


@pytest.mark.logic
def test_mistakes_are_one_line_and_the_documented_exit_code(tmp_path):
    """All but the last need no daemon."""
    cli = (program("swarmtalk-cli"), "--socket", tmp_path / "none")
    for words, code, pattern in (
            (("sub",), 2, "CHANNEL, or --all"),
            (("sub", "a", "-F", "%q"), 2, "-F has %q"),
            (("sub", "a", "-F", "%p\\q"), 2, r"-F has \\q; it takes"),
            (("sub", ""), 2, "a channel has a name, or a number"),
            (("hz", ""), 2, "a channel has a name, or a number"),
            (("sub", "a", "-F", "%p", "--json"), 2, "--format excludes --json"),
            (("sub", "a", "-F", "%p", "--time"), 2, "--format excludes --time"),
            (("sub", "--all", "--timestamped"), 2, "all excludes --time|timestamped excludes"),
            (("record", "x", "--jsonl"), 2, "FILE excludes|--jsonl excludes"),
            (("record", "--jsonl", "--replace"), 2, "--replace requires FILE"),
            (("top", "-C", "2"), 2, "--count requires --json"),
            (("top", "--json", "--filter", "a"), 2, "--filter excludes|--json excludes"),
            (("radar", "--json", "--range", "1"), 2, "--range excludes|--json excludes"),
            (("ping", "--answer", "-C", "2"), 2, "--answer excludes|--count excludes"),
            (("pub", "a", "x", "--copies", "101"), 2, "1 to 100"),
            (("sub", "a", "--fmt", "k"), 2, "--fmt k is not a format"),
            (("sub", "a", "--fmt", ""), 2, "--fmt: must not be empty"),
            (("sub", "a", "--fmt", "<"), 2, "--fmt < is not a format: it has no values"),
            (("pub", "a", "--fmt", " ", ""), 2, "--fmt   is not a format: it has no values"),
            (("sub", "a", "-F", ""), 2, "--format: must not be empty"),
            (("hz", "a", "--period", "0"), 2, "a number from 0.01 to 1000000, not 0"),
            (("sub", "a", "--keep-last", "0"), 2, "1 to 4294967295, not 0"),
            (("pub", "a"), 2, "DATA"),
            (("pub", "a", "--fmt", "B", "256"), 2, "'256' is not a value"),
            (("pub", "a", "--file", tmp_path / "none"), 1, "No such file"),
            (("decode", "zz"), 2, "not hexadecimal"),
            (("top", "--sort", "x"), 2, "sort")):
        done = run(*cli, *words)
        assert done.returncode == code, (words, done.stderr)
        one_line(done.stderr, pattern)
    for words in (("channels",), ("hz", "a"), ("pose", "watch"), ("top", "--once"),
                  ("radar", "--once"), ("sub", "--all"), ("ping", "2"), ("record", "--jsonl")):
        for socket, pattern in ((tmp_path / "none", "does not exist"),
                                (tmp_path, "is not a socket of swarmtalkd")):
            done = run(program("swarmtalk-cli"), "--socket", socket, *words)
            assert done.returncode == 3, (words, done.stderr)
            one_line(done.stderr, pattern)


def numeric_options(command, path=()):
    """Words of each verb, and the names of the options that it takes a number for."""
    yield path, [each["names"][-1] for each in command["options"]
                 if each["names"] and re.match("FLOAT|U?INT", each["value"])]
    for each in command["commands"]:
        yield from numeric_options(each, (*path, each["name"]))


@pytest.mark.logic
@pytest.mark.parametrize("word", ["inf", "nan", "1e400", "-inf", "x", ""])
@pytest.mark.parametrize("tool", ["swarmtalk-cli", "swarmtalk-lab", "swarmtalk-view"])
def test_numbers_that_are_none_are_refused_by_every_option(tool, word):
    described = json.loads(run(program(tool), "--describe").stdout)
    seen = 0
    for path, names in numeric_options(described):
        for name in names:
            seen += 1
            done = run(program(tool), *path, f"{name}={word}")
            assert done.returncode == 2, (path, name, word, done.stdout, done.stderr)
            one_line(done.stderr, tool)
    assert seen >= (1 if tool == "swarmtalk-view" else 5)


def a_misspelt_channel_is_told_with_the_one_that_there_is(lab):
    hint = "uses channel 'alrm'; did you mean 'alarm'"
    done = lab.cli(1, "pub", "alrm", "x")
    assert done.returncode == 0
    one_line(done.stderr, hint)
    done = lab.cli(1, "pub", "alrm", "x", "--repeat", "3")
    one_line(done.stderr, hint)
    for words in (("pub", "alarm", "x"), ("pub", "elsewhere", "x"), ("pub", "4711", "x")):
        done = lab.cli(1, *words)
        assert (done.returncode, done.stderr) == (0, "")
    quiet = lab.start(1, program("swarmtalk-cli"), "hz", "alrm", "--period", "60")
    assert "nobody publishes 'alrm' as far as this robot knows; did you mean 'alarm'?" in (
        quiet.stderr.readline())
    quiet.send_signal(signal.SIGINT)
    quiet.communicate(timeout=90)


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
    "channels": ("-W", "0.5"), "hz": ("alarm", "-C", "1", "--period", "1"), "top": ("-C", "1"),
    "neighbours": (), "pose get": (), "pose watch": ("-C", "1"),
    "ping": ("1", "-C", "1", "--period", "10"),
    "sub": ("alarm", "-C", "1", "-W", "60"), "status": (), "decode": (FRAME,),
    "doctor": ("--period", "0.2", "--peer", "1"),
}


def what_json_prints_is_what_its_document_says(lab):
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


def test_three_robots_are_seen_by_every_command_that_looks(talking_lab):
    for look in (channels_names_who_publishes_on_the_air,
                 sub_prints_all_channels_and_in_a_format_of_ones_own,
                 top_finds_a_channel_by_its_name_where_only_its_number_is_known,
                 hz_tells_the_rate_of_each_sender, ping_is_answered_by_a_program_that_does,
                 a_misspelt_channel_is_told_with_the_one_that_there_is,
                 what_json_prints_is_what_its_document_says):
        look(talking_lab)


@pytest.mark.logic
def test_every_table_of_the_document_is_held():
    text = (ROOT / "docs/cli-json.md").read_text()
    assert set(re.findall(r"^## `(.+) --json`$", text, re.M)) == set(VERBS)
