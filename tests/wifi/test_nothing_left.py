"""However a guest ends, no process and no file of it stays."""
import os
import pathlib
import signal
import subprocess
import sys
import time

import guest
import pytest

pytestmark = pytest.mark.long
HERE = pathlib.Path(__file__).resolve().parent
BOOTS = """
import sys, time
sys.path.insert(0, sys.argv[1])
import guest
machine = guest.Guest(radios=1, access_points=0)
machine.start("r1", "sleep 1000")
print(machine.folder, machine.keeper.pid, flush=True)
time.sleep(1000)
"""


def processes_of(folder):
    """Processes that name this guest's folder: its keeper and QEMU."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes()
        except OSError:
            continue
        if str(folder).encode() in words:
            found[int(process.name)] = words.split(b"\0")[0].decode()
    return found


def wait_until_gone(folder, limit_s=15):
    deadline = time.monotonic() + limit_s
    while processes_of(folder) or folder.exists():
        assert time.monotonic() < deadline, (processes_of(folder), folder.exists())
        time.sleep(0.1)


@pytest.fixture
def booted():
    """A guest of another process: (process, folder, the keeper's pid)."""
    guest.needs_guest()
    owner = subprocess.Popen([sys.executable, "-B", "-c", BOOTS, HERE], stdout=subprocess.PIPE,
                             text=True)
    line = owner.stdout.readline().split()
    assert len(line) == 2, "no guest"
    folder = pathlib.Path(line[0])
    assert len(processes_of(folder)) == 2 and (folder / "initramfs").exists()
    yield owner, folder, int(line[1])
    if owner.poll() is None:
        owner.kill()
    owner.wait()
    owner.stdout.close()


def test_nothing_is_left_when_its_owner_is_killed(booted):
    owner, folder, _ = booted
    os.kill(owner.pid, signal.SIGKILL)
    wait_until_gone(folder)


def test_no_process_is_left_when_its_keeper_is_killed_and_the_next_guest_sweeps(booted):
    owner, folder, keeper = booted
    os.kill(keeper, signal.SIGKILL)
    deadline = time.monotonic() + 15
    while processes_of(folder):
        assert time.monotonic() < deadline, processes_of(folder)
        time.sleep(0.1)
    owner.kill()
    assert folder.exists()  # nobody was left to remove it
    deadline = time.monotonic() + 15
    while folder.exists():  # a process that is being killed lets go of its files last
        assert time.monotonic() < deadline, "still locked"
        os.utime(folder, (0, 0))
        guest.wifi_guest.sweep(folder.parent)
        time.sleep(0.1)


def test_a_machine_without_qemu_is_told_what_to_install(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    reason = guest.wifi_guest.missing()
    assert "apt-get install" in reason and "\n" not in reason
