"""Configurations in the documents are accepted, commands have the options that programs have."""
import json
import re
import shlex
import subprocess

import pytest
from blocks import PROGRAMS, ROOT, blocks, documents

LINK = '[links.wifi]\ntype = "raw_l2"\ninterface = "wlan0"\n'
KILOBOTS = '[links.kilobots]\ntype = "udp"\nprofile = "kilobot"\n'
CONFIGURATIONS = [pytest.param(document, number, id=f"{document.split('/')[-1][:-3]}_{number}")
                  for document in documents() if not any(
                      word in document for word in ("suite", "emulator", "sweeps", "settings"))
                  for number in range(len(blocks(document, "toml")))]


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=60, **options)


@pytest.mark.parametrize("document,number", CONFIGURATIONS)
def test_a_configuration_in_a_document_is_accepted(document, number, tmp_path):
    text = blocks(document, "toml")[number][1]
    if "[links." not in text:
        text += LINK + KILOBOTS
    key = tmp_path / "swarm.key"
    if "key_file" in text:
        assert run(PROGRAMS["swarmtalk-cli"], "keygen", key).returncode == 0
    file = tmp_path / "swarmtalkd.toml"
    file.write_text(text.replace("/etc/swarmtalk/swarm.key", str(key)))
    done = run(PROGRAMS["swarmtalkd"], "--check", "--config", file)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("document", ["docs/operating.md", "docs/operations.md"])
def test_the_daemon_takes_a_key_that_is_installed_as_the_document_says(document, tmp_path):
    text = (ROOT / document).read_text(encoding="utf-8")
    command = re.search(r"install -o swarmtalk (-m \d+ swarm.key) /etc/swarmtalk/swarm.key", text)
    assert command, "not shown"
    assert run(PROGRAMS["swarmtalk-cli"], "keygen", tmp_path / "swarm.key").returncode == 0
    key = tmp_path / "installed.key"
    assert run("install", *command.group(1).split(), key, cwd=tmp_path).returncode == 0
    file = tmp_path / "swarmtalkd.toml"
    file.write_text(LINK + f'key_file = "{key}"\n')
    done = run(PROGRAMS["swarmtalkd"], "--check", "--config", file)
    assert done.returncode == 0, done.stderr
    assert not re.search(r"mode 06[1-7]\d|mode 06\d[1-7]", text)


def described(name, cache={}):
    if name not in cache:
        cache[name] = json.loads(run(PROGRAMS[name], "--describe").stdout)
    return cache[name]


def problem_of(words):
    """What one of our programs would not understand of a command line; None if it takes it."""
    levels = [described(words[0])]
    for word in words[1:]:
        if word == "--" or word.startswith(("$", "#", ">", "|", "&&", ";")):
            break
        commands = {name: each for each in levels[-1]["commands"]
                    for name in [each["name"]] + each["aliases"]}
        if word in commands:
            levels.append(commands[word])
        elif word.startswith("--") or (word.startswith("-") and len(word) == 2):
            known = {name for level in levels for each in level["options"]
                     for name in each["names"]}
            if word.split("=")[0] not in known:
                return f"no option {word}"
    return f"no such command: {words}" if levels[-1]["commands"] and len(words) > 1 and not (
        words[1].startswith("-")) else None


def commands_in(block):
    """The command lines of our programs in a block for a shell, without what is around them."""
    rest = ""
    for line in block.replace("\\\n", " ").splitlines():
        try:
            words = shlex.split(rest + line, comments=True)
        except ValueError:  # a quotation goes on
            rest += line + "\n"
            continue
        rest = ""
        for index, word in enumerate(words):
            if word.split("/")[-1] in PROGRAMS and (index == 0 or words[index - 1] in (
                    "sudo", "--", "&&", "|", ";") or words[index - 1].startswith("robot-")):
                yield [word.split("/")[-1]] + words[index + 1:]


@pytest.mark.parametrize("document", [each for each in documents() if blocks(each, "sh")])
def test_commands_in_a_document_are_understood(document):
    for _, block in blocks(document, "sh"):
        done = run("bash", "-n", "-c", block)
        assert done.returncode == 0, done.stderr
        for words in commands_in(block):
            assert problem_of(words) is None, (words, problem_of(words))


def test_what_a_program_does_not_know_is_found():
    assert problem_of(["swarmtalk-cli", "sub", "hello", "--lately"]) == "no option --lately"
    assert problem_of(["swarmtalk-cli", "listen"]).startswith("no such command")
    assert problem_of(["swarmtalk-cli", "pose", "set", "1", "0", "90deg"]) is None
    assert list(commands_in("sudo swarmtalk-lab exec 1 -- swarmtalk-cli sub x  # hears")) == [
        ["swarmtalk-lab", "exec", "1", "--", "swarmtalk-cli", "sub", "x"],
        ["swarmtalk-cli", "sub", "x"]]
