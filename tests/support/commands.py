"""Commands that run to their end, and conditions that come true: each with a limit."""
import shutil
import subprocess
import time

import pytest

# Of a wait for what has to come: far longer than it takes, and shorter than the limit of a test.
PATIENCE_S = 60


def run(*command, timeout=PATIENCE_S + 30, **options):
    """Runs a command to its end, at most `timeout` seconds, more than one waits itself (-W 60); its
    result, with text output."""
    return subprocess.run([str(word) for word in command], timeout=timeout, text=True,
                          capture_output=True, stdin=subprocess.DEVNULL, **options)


def wait_for(condition, timeout=PATIENCE_S, what="condition"):
    """Polls until `condition()` is true; returns its value. Fails after `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < deadline, f"timed out waiting for {what}"
        time.sleep(0.02)


def next_line(process):
    """The next line that a process prints on stdout; there must be one. If it has ended instead,
    the failure shows how, and what it printed on stderr, if that is piped."""
    line = process.stdout.readline()
    if not line:
        errors = process.communicate(timeout=PATIENCE_S)[1]
        raise AssertionError(f"{process.args[0]} ended with {process.returncode}: {errors or ''}")
    return line.rstrip("\n")


def needs(*programs):
    """Skips the test that asks if one of the programs is not installed."""
    for name in programs:
        if shutil.which(name) is None:
            pytest.skip(f"{name} is not installed (tools/setup test)")
