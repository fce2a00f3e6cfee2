"""docs/tutorial.md as somebody types it: its programs under the names that it gives them, its
blocks for a shell in their order. A block that only listens runs until the next one is done: it is
what the first of two terminals shows. The map runs until it has said where it is."""
import os
import pathlib
import re
import subprocess
import tempfile
import time

TUTORIAL = pathlib.Path(__file__).resolve().parents[2] / "docs/tutorial.md"
FIRST = "## Three robots on this machine"
CPP = "## The same in C++"
AFTER_CPP = "## Where robots are"
LAST = "## On two robots"  # needs two robots
LONGEST_S = 60


def blocks(language):
    """[(text before it, block)] of one language, in their order."""
    text = TUTORIAL.read_text(encoding="utf-8")
    return [(text[:match.start()], match.group(1))
            for match in re.finditer(rf"^```{language}\n(.*?)^```", text, re.S | re.M)]


def install_block():
    """How packages are installed."""
    return next(block for before, block in blocks("sh") if FIRST not in before)


def installs(block):
    return block.startswith("sudo apt ")


def is_for_cpp(before):
    return CPP in before and AFTER_CPP not in before


def line_shown():
    """What robot 2 prints, as the tutorial shows it."""
    return re.search(r"^hello: robot 1 .*$", TUTORIAL.read_text(encoding="utf-8"), re.M).group(0)


def write_programs(folder):
    """Each program of the tutorial, under the name that the text before it says."""
    for language in ("python", "cpp"):
        for before, block in blocks(language):
            name = re.findall(r"as `(\w+\.(?:py|cpp))`", before.replace("\n", " "))[-1]
            (folder / name).write_text(block)


def commands():
    """The blocks that need no robots: [(text before it, runs until Ctrl-C, block)]."""
    for before, block in blocks("sh"):
        if FIRST in before and LAST not in before:
            yield before, bool(re.search(r"swarmtalk-cli sub", block)), block


class Terminal:
    """`shell` runs a block, such as ["bash", "-c"]."""

    def __init__(self, shell, block, **options):
        self.shown = tempfile.TemporaryFile()
        self.process = subprocess.Popen([*shell, block], stdin=subprocess.DEVNULL,
                                        stdout=self.shown, stderr=subprocess.STDOUT,
                                        start_new_session=True, **options)

    def end(self):
        """Ctrl-C, by somebody who has seen what came."""
        wait_until(lambda: os.fstat(self.shown.fileno()).st_size > 0)
        os.killpg(self.process.pid, 2)
        self.process.wait(timeout=LONGEST_S)
        self.shown.seek(0)
        return self.shown.read().decode()


def wait_until(condition):
    deadline = time.monotonic() + LONGEST_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def has_subscriber(status, block):
    """Whether somebody listens as the block says, by what `swarmtalk-cli status` printed."""
    channel = re.search(r"swarmtalk-cli sub (\w+)", block)[1]
    return re.search(rf"^{channel} +\d+ +\d+ +1\b", status, re.M)


def type_all(wanted, shell, status, **options):
    """Runs by `shell` the blocks that `wanted(text before it, block)` takes; `status()` is what
    swarmtalk-cli prints on robot 2. Returns what they printed."""
    printed, listening = [], None
    try:
        for before, is_endless, block in commands():
            if not wanted(before, block):
                continue
            if "swarmtalk-lab view" in block:
                printed.append(Terminal(shell, block, **options).end())
                continue
            if is_endless:
                listening = Terminal(shell, block, **options)
                wait_until(lambda block=block: has_subscriber(status(), block))
                continue
            done = subprocess.run([*shell, block], timeout=2 * LONGEST_S, stdin=subprocess.DEVNULL,
                                  capture_output=True, text=True, **options)
            assert done.returncode == 0, block + done.stdout + done.stderr
            printed.append(done.stdout)
            if listening:
                printed.append(listening.end())
                listening = None
    finally:
        if listening and listening.process.poll() is None:
            os.killpg(listening.process.pid, 2)
            listening.process.wait(timeout=LONGEST_S)
    return "\n".join(printed)


def check(text, programs):
    """What the tutorial says is what came. `programs`: how many programs said hello."""
    assert line_shown() in text, "the line that it shows is the one that comes"
    assert "robot 1 | robot 2 says hello 3 from 0.5 m" in text, text
    hellos = re.findall(r"robot 3 \| robot 1 says hello 3 from 0.5 m", text)
    assert len(hellos) == programs, text
    assert re.search(r'robot 3  "fire"  via robot 1  distance 10.00 m .* hops 1$', text, re.M), text
    assert "http://localhost:8080/" in text, text
    assert re.search(r'robot 1  "I am walking"  distance 2.\d\d m', text), text
