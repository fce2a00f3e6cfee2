"""Ctrl-C at the moments at which programs are being started."""
import importlib.machinery
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "suite/runner"), str(ROOT / "tests/support")]
import platforms  # noqa: E402
from commands import wait_for  # noqa: E402

# Ends on the first SIGINT, with 0, as programs of ours do; says that it listens.
OBEYS = ("import signal, sys\nsignal.signal(signal.SIGINT, lambda *_: sys.exit(0))\n"
         "open(sys.argv[1], 'w').close()\nwhile True: signal.pause()\n")
ENDINGS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.fixture
def interrupts(monkeypatch):
    """Handlers as the runner's; undone afterwards."""
    before = {each: signal.getsignal(each) for each in ENDINGS}
    monkeypatch.setattr(platforms, "interrupted", False)
    platforms.catch_interrupts()
    yield
    for each, handler in before.items():
        signal.signal(each, handler)


def test_interrupt_while_a_program_is_started_ends_it(interrupts, monkeypatch, tmp_path):
    """The program runs already, and the runner does not know its number yet."""
    listens, started = tmp_path / "listens", []

    class Started(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            started.append(self)
            wait_for(listens.exists, timeout=60, what="the program")
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(platforms.subprocess, "Popen", Started)
    platforms.call([sys.executable, "-c", OBEYS, listens])
    assert platforms.interrupted and started[0].returncode == 0


@pytest.mark.parametrize("command", [
    ["sleep", "1000"], ["sh", "-c", "trap 'exit 130' INT; kill -INT $$"]], ids=["dies", "says_so"])
def test_interrupt_before_a_program_listens_is_no_failure(interrupts, monkeypatch, command):
    """It dies of the signal, or it is a lab one of whose programs did: the run has no log, and
    that is all."""
    class Started(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(platforms.subprocess, "Popen", Started)
    with pytest.raises(platforms.Interrupted):
        platforms.call(command)


@pytest.mark.parametrize("number", ENDINGS)
def test_signal_that_was_ignored_stays_ignored(interrupts, number):
    """As by nohup. The programs of a run heed an interrupt all the same: it is how they end."""
    signal.signal(number, signal.SIG_IGN)
    platforms.catch_interrupts()
    os.kill(os.getpid(), number)
    assert not platforms.interrupted
    with pytest.raises(platforms.PlatformError, match=str(-signal.SIGINT)):
        platforms.call(["sh", "-c", "kill -INT $$"])
    for each in set(ENDINGS) - {number}:
        assert callable(signal.getsignal(each))


def test_terminal_that_goes_away_ends_the_runs(interrupts):
    os.kill(os.getpid(), signal.SIGHUP)
    assert platforms.interrupted


@pytest.mark.parametrize("number", ENDINGS)
def test_second_signal_waits_for_nothing(interrupts, number):
    os.kill(os.getpid(), number)
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), number)


def test_interrupt_between_two_runs_starts_no_other(interrupts, tmp_path):
    os.kill(os.getpid(), signal.SIGINT)
    with pytest.raises(platforms.Interrupted):
        platforms.call(["touch", tmp_path / "ran"])
    assert not (tmp_path / "ran").exists()


def test_interrupt_of_a_report_is_no_traceback(monkeypatch):
    report = pytest.importorskip("report")
    loader = importlib.machinery.SourceFileLoader("runner", str(ROOT / "suite/swarmtalk-suite"))
    runner = importlib.util.module_from_spec(importlib.util.spec_from_loader("runner", loader))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    loader.exec_module(runner)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "write", interrupted)
    monkeypatch.setattr(sys, "argv", ["swarmtalk-suite", "report"])
    assert runner.main() == 130
