"""Setting the wall clock, back and forth, changes nothing for a running daemon."""
import json
import mmap
import os
import random
import signal
import struct
import subprocess
import time

import pytest
from conftest import BUILD, program, wait_for

SHIM = BUILD / "tests/integration/libclock_shim.so"
STEPS_S = [3600, -3600, 0.5, -0.5, 3, 0, -86400, 0]
RATE_HZ = 40


class Clock:
    """What the daemons are told to add to the wall clock."""

    def __init__(self, path):
        path.write_bytes(bytes(8))
        with open(path, "r+b") as file:
            self.memory = mmap.mmap(file.fileno(), 8)

    def set(self, seconds):
        self.memory[:] = struct.pack("<q", int(seconds * 1e9))


@pytest.mark.parametrize("is_sealed", [False, True], ids=["open", "sealed"])
def test_clock_steps_change_neither_delivery_nor_delays(tmp_path, is_sealed):
    """Sealed frames have an age, which is judged at the kernel's stamps of the wall clock."""
    if "san" in BUILD.name:
        pytest.skip("a sanitizer's library must be the first to be loaded")
    clock = Clock(tmp_path / "offset")
    port = random.Random(os.getpid()).randrange(20000, 60000)
    environment = {**os.environ, "LD_PRELOAD": str(SHIM),
                   "SWARMTALK_CLOCK_OFFSET": str(tmp_path / "offset")}
    started, sockets, key_line = [], [], ""
    if is_sealed:
        key = tmp_path / "swarm.key"
        subprocess.run([program("swarmtalk-cli"), "keygen", key], check=True, capture_output=True)
        key_line = f'key_file = "{key}"\n'
    try:
        for name in "ab":
            config = tmp_path / f"{name}.toml"
            config.write_text(f'[links.w]\ntype = "udp"\ninterface = "lo"\nport = {port}\n'
                              + key_line)
            sockets.append(tmp_path / f"{name}.sock")
            started.append(subprocess.Popen(
                [program("swarmtalkd"), "--config", config, "--socket", sockets[-1]],
                stderr=open(tmp_path / f"{name}.log", "w", encoding="utf-8"), env=environment))
            wait_for(sockets[-1].exists, what="socket")
        cli = program("swarmtalk-cli")
        count = int(RATE_HZ * (len(STEPS_S) * 0.5 + 1))
        sub = subprocess.Popen([cli, "--socket", sockets[1], "sub", "c", "--json", "--timestamped",
                                "-C", str(count), "-W", "60"], stdout=subprocess.PIPE, text=True)
        started.append(sub)
        wait_for(lambda: json.loads(subprocess.run(
            [cli, "--socket", sockets[1], "status", "--json"], capture_output=True,
            text=True).stdout)["channels"], what="subscription")
        started.append(subprocess.Popen(
            [cli, "--socket", sockets[0], "pub", "c", "x", "--timestamped", "--repeat", str(count),
             "--rate", str(RATE_HZ)]))
        for seconds in STEPS_S:
            time.sleep(0.5)
            clock.set(seconds)
        out, _ = sub.communicate(timeout=90)
        messages = [json.loads(line) for line in out.splitlines()]
        delays = sorted(message["buffering_delay_us"] for message in messages
                        if message["buffering_delay_us"] is not None)
        print(f"{len(messages)} messages over {len(STEPS_S)} clock steps: delay p50 "
              f"{delays[len(delays) // 2]} us, longest {delays[-1]} us")
        assert [m["message_number"] for m in messages] == list(range(1, count + 1))
        # A message that waited in the socket while the clock was set would show the step's size.
        assert not any(480_000 <= delay <= 520_000 or delay > 990_000 for delay in delays), delays
        logs = "".join((tmp_path / f"{name}.log").read_text() for name in "ab")
        assert "warning" not in logs and "error" not in logs, logs
    finally:
        for process in reversed(started):
            process.send_signal(signal.SIGTERM)
            process.wait(10)
