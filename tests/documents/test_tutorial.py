"""docs/tutorial.md, typed as it stands there: blocks for a shell in their order, programs under the
names that it gives them."""
import os
import re
import shutil
import subprocess
import time

import pytest
from blocks import BUILD, PROGRAMS, ROOT, blocks

TUTORIAL = "docs/tutorial.md"
FIRST = "## Three robots on this machine"
LAST = "## On two robots"  # needs two robots
LONGEST_S = 60
# What a program of the system would do where the library is installed.
PKG_CONFIG = f"""#!/bin/sh
[ "$*" = "--cflags --libs --static swarmtalk" ] || exit 1
echo -I{ROOT}/client_lib/include {BUILD}/client_lib/libswarmtalk.a -lprotobuf -pthread
"""


def write_programs(folder):
    """Each program of the tutorial, under the name that the text before it says."""
    for language in ("python", "cpp"):
        for before, block in blocks(TUTORIAL, language):
            name = re.findall(r"as `(\w+\.(?:py|cpp))`", before.replace("\n", " "))[-1]
            (folder / name).write_text(block)


def write_path(folder):
    folder.mkdir()
    for name, path in PROGRAMS.items():
        (folder / name).symlink_to(path)
    (folder / "sudo").write_text('#!/bin/sh\nexec "$@"\n')
    (folder / "pkg-config").write_text(PKG_CONFIG)
    (folder / "python3").symlink_to("/usr/bin/python3")
    for name in ("sudo", "pkg-config"):
        (folder / name).chmod(0o755)


def commands():
    """The blocks that need no robots: [(runs until Ctrl-C, block)]."""
    for before, block in blocks(TUTORIAL, "sh"):
        if FIRST in before and LAST not in before:
            yield bool(re.search(r"swarmtalk-cli sub", block)), block


class Terminal:
    def __init__(self, block, **options):
        self.process = subprocess.Popen(["bash", "-c", block], text=True, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                        start_new_session=True, **options)

    def end(self):
        """Ctrl-C."""
        os.killpg(self.process.pid, 2)
        return self.process.communicate(timeout=LONGEST_S)[0]


def has_subscriber(environment):
    """Whether robot 2 has one, on channel hello."""
    done = subprocess.run([PROGRAMS["swarmtalk-lab"], "exec", "2", "--", PROGRAMS["swarmtalk-cli"],
                           "status"], capture_output=True, text=True, env=environment)
    return re.search(r"^hello +\d+ +\d+ +1\b", done.stdout, re.M)


def wait_until(condition):
    deadline = time.monotonic() + LONGEST_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
def test_its_commands_do_what_it_says(tmp_path):
    for program in ("g++", "ip"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is missing: run tools/setup test")
    write_programs(tmp_path)
    write_path(tmp_path / "path")
    environment = {**os.environ, "PATH": f"{tmp_path}/path:{os.environ['PATH']}",
                   "PYTHONPATH": f"{ROOT}/client_lib/python", "SWARMTALK_LAB": f"tut{os.getpid()}",
                   "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    options = {"cwd": tmp_path, "env": environment}
    printed, listening = [], None
    try:
        for is_endless, block in commands():
            if is_endless:
                listening = Terminal(block, **options)
                wait_until(lambda: has_subscriber(environment))
                continue
            done = subprocess.run(["bash", "-e", "-c", block], timeout=LONGEST_S,
                                  capture_output=True, text=True, **options)
            assert done.returncode == 0, block + done.stdout + done.stderr
            printed.append(done.stdout)
            if listening:
                printed.append(listening.end())
                listening = None
    finally:
        if listening:
            listening.end()
        subprocess.run([PROGRAMS["swarmtalk-lab"], "down"], capture_output=True, **options)
    text = "\n".join(printed)
    shown = re.search(r"^hello: robot 1 .*$", (ROOT / TUTORIAL).read_text(), re.M)
    assert shown.group(0) in text, "the line that it shows is the one that comes"
    assert "robot 1 | robot 2 says hello 3 from 0.5 m" in text
    both = re.findall(r"robot 3 \| robot 1 says hello 3 from 0.5 m", text)
    assert len(both) == 2, "the program in Python and the one in C++"
    assert re.search(r'robot 1  "I am walking"  distance 2.\d\d m', text), text
