"""However a guest ends, no process and no file of it stays."""
import os
import pathlib
import signal
import subprocess
import sys
import time

import guest
import pytest

pytestmark = pytest.mark.field
HERE = pathlib.Path(__file__).resolve().parent
BOOTS = """
import pathlib, sys, tempfile, time
sys.path.insert(0, sys.argv[1])
import guest
folder = tempfile.mkdtemp(prefix=guest.wifi_guest.PREFIX)
print(pathlib.Path(folder).resolve(), flush=True)
machine = guest.Guest(radios=1, access_points=0, folder=pathlib.Path(folder).resolve())
machine.start("r1", "sleep 1000")
print("up", flush=True)
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


def wait_until_gone(folder, limit_s=60):
    deadline = time.monotonic() + limit_s
    while processes_of(folder) or folder.exists():
        assert time.monotonic() < deadline, (processes_of(folder), folder.exists())
        time.sleep(0.1)


def wait_for_processes(folder):
    """Until a guest's keeper and QEMU run. @return the keeper's pid"""
    deadline = time.monotonic() + 60
    while len(found := processes_of(folder)) < 2:
        assert time.monotonic() < deadline, found
        time.sleep(0.1)
    assert len(found) == 2 and (folder / "initramfs").exists(), found
    return next(pid for pid, name in found.items() if "qemu" not in name)


@pytest.fixture
def owner():
    """A process that boots a guest: (process, folder)."""
    guest.needs_guest()
    process = subprocess.Popen([sys.executable, "-B", "-c", BOOTS, HERE], stdout=subprocess.PIPE,
                               text=True)
    folder = pathlib.Path(process.stdout.readline().strip())
    assert folder.is_absolute(), "no guest"
    yield process, folder
    if process.poll() is None:
        process.kill()
    process.wait()
    process.stdout.close()


def test_nothing_is_left_when_its_owner_is_killed(owner):
    process, folder = owner
    assert process.stdout.readline() == "up\n"
    wait_for_processes(folder)
    os.kill(process.pid, signal.SIGKILL)
    wait_until_gone(folder)


def test_no_process_is_left_when_its_keeper_is_killed_and_the_next_guest_sweeps(owner):
    process, folder = owner
    keeper = wait_for_processes(folder)  # while it boots
    os.kill(process.pid, signal.SIGSTOP)
    os.kill(keeper, signal.SIGKILL)
    deadline = time.monotonic() + 60
    while processes_of(folder):
        assert time.monotonic() < deadline, processes_of(folder)
        time.sleep(0.1)
    process.kill()
    process.wait()
    assert folder.exists()  # nobody was left to remove it
    deadline = time.monotonic() + 60
    while folder.exists():  # a process that is being killed lets go of its files last
        assert time.monotonic() < deadline, "still locked"
        os.utime(folder, (0, 0))
        guest.wifi_guest.sweep(folder.parent)
        time.sleep(0.1)


def test_a_machine_without_qemu_is_told_what_to_install(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    reason = guest.wifi_guest.missing()
    assert "apt-get install" in reason and "\n" not in reason
