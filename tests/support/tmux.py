"""A terminal in which a program draws, looked at through tmux."""
import itertools
import os
import re
import shutil

import pytest
from commands import run, wait_for

TERMINALS = itertools.count()

needs_tmux = pytest.mark.skipif(not shutil.which("tmux"), reason="tmux is not installed")


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

    def whole_lines(self):
        """As the command wrote them: what the terminal has folded is one line again."""
        return run(*self.words, "capture-pane", "-p", "-J").stdout.splitlines()

    def keys(self, *keys):
        run(*self.words, "send-keys", *keys)

    def wait(self, pattern, timeout=60):
        try:
            wait_for(lambda: re.search(pattern, self.text(), re.M), timeout=timeout, what=pattern)
        except AssertionError as error:
            raise AssertionError(f"{error}; there is\n{self.text()}") from None
        return self.text()
