"""The command lines of the documents are run in labs, nearly as they stand there: what they name
does work, and values are what programs take (test_blocks.py looks at the options' names). The
tutorial's have a test of their own (test_tutorial.py)."""
import json
import os
import subprocess

import pytest
from blocks import PROGRAMS, blocks, documents
from test_blocks import commands_in

# Of another machine, or of robots that have to be driven.
ELSEWHERE = ("--peer", "survey")
SHELL = ("|", "&&", ";", "&")
# What would run until Ctrl-C ends when something has come.
ENDS = {"sub": ["-C", "1"], "record": ["-C", "1"]}

# Runs in a lab of two: each command in robot 1, beside a robot that speaks on two channels.
RUNNER = """
import json, pathlib, subprocess, sys
cli, lab = sys.argv[1:3]
others = [subprocess.Popen([lab, "exec", "2", "--", cli, "pub", channel, "good morning", "--repeat",
                            "0", "--rate", "20"], stdout=subprocess.DEVNULL)
          for channel in ("hello", "alarm")]
done = subprocess.run([lab, "exec", "1", "--", "timeout", "60", "/usr/bin/python3", "-u", "raw.py"],
                      capture_output=True, text=True, stdin=subprocess.DEVNULL)
results = [[["raw.py"], done.returncode, done.stdout, done.stderr]]
for words in json.load(sys.stdin):
    if words[:2] == ["record", "run.mcap"]:  # there may be one of another document
        pathlib.Path("run.mcap").unlink(missing_ok=True)
    done = subprocess.run([lab, "exec", "1", "--", "timeout", "60", cli, *words],
                          capture_output=True, text=True, stdin=subprocess.DEVNULL)
    results.append([words, done.returncode, done.stdout, done.stderr])
for other in others:
    other.terminate()
    other.wait()
print("RESULTS " + json.dumps(results))
"""


def that_end(words):
    """Of a command line what swarmtalk-cli gets, and what lets it end."""
    end = next((index for index, word in enumerate(words)
                if word in SHELL or word.startswith((">", "2>"))), len(words))
    return [word for word in words[1:end] if word != "--loop"] + ENDS.get(words[1], [])


def commands_on_a_robot():
    found = []
    for document in documents():
        for _, block in blocks(document, "sh"):
            for words in commands_in(block):
                if words[0] == "swarmtalk-cli" and not any(word in ELSEWHERE for word in words):
                    found.append(that_end(words))
    return [words for index, words in enumerate(found) if words not in found[:index]]


def type_what_is_typed_on_a_robot(tmp_path):
    """And a program that speaks the local protocol by hand (ipc.md)."""
    program, = [block for _, block in blocks("docs/ipc.md", "python")]
    (tmp_path / "raw.py").write_text(program)
    commands = commands_on_a_robot()
    assert len(commands) >= 15 and ["record", "run.mcap", "-C", "1"] in commands
    (tmp_path / "runner.py").write_text(RUNNER)
    lab, cli = PROGRAMS["swarmtalk-lab"], PROGRAMS["swarmtalk-cli"]
    done = subprocess.run(
        [lab, "--name", f"docs{os.getpid()}", "run", "2", "--medium", "udp", "--",
         "/usr/bin/python3", "runner.py", cli, lab], cwd=tmp_path, text=True, capture_output=True,
        input=json.dumps(commands), timeout=280)
    lines = [line for line in done.stdout.splitlines() if "RESULTS " in line]
    assert done.returncode == 0 and len(lines) == 1, done.stdout + done.stderr
    results = json.loads(lines[0].split("RESULTS ", 1)[1])
    assert [words for words, *_ in results] == [["raw.py"]] + commands
    assert [result for result in results if result[1] != 0] == []
    said = {" ".join(words): output for words, _, output, _ in results}
    assert "good morning" in said["sub hello -C 1"] and "0.50 m" in said["sub hello -C 1"]
    assert "robot 2 says b'good morning', 0.50 m away" in said["raw.py"]


def tell_the_radio_what_its_document_says(tmp_path):
    lab = f"docs{os.getpid()}"
    environment = {**os.environ, "SWARMTALK_LAB": lab,
                   "PATH": f"{PROGRAMS['swarmtalk-lab'].parent}:{PROGRAMS['swarmtalk-cli'].parent}:"
                           f"{os.environ['PATH']}"}
    lines = blocks("docs/radio.md", "sh")[0][1].splitlines()
    assert "up 9" in lines[0] and "down" in lines[-1]
    try:
        for line in lines:
            done = subprocess.run(["bash", "-c", line.replace("sudo ", "")], cwd=tmp_path,
                                  text=True, capture_output=True, env=environment, timeout=60)
            assert done.returncode == 0, (line, done.stdout, done.stderr)
    finally:
        subprocess.run(["swarmtalk-lab", "down"], capture_output=True, env=environment, timeout=60)


@pytest.mark.clock
def test_what_documents_let_a_person_type_works(tmp_path):
    type_what_is_typed_on_a_robot(tmp_path)
    if os.geteuid() != 0:
        pytest.skip("passed but for its last step: network namespaces need root")
    tell_the_radio_what_its_document_says(tmp_path)
