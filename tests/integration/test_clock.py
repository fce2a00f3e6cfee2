"""Setting the wall clock, back and forth, changes nothing for a running daemon."""
import json
import mmap
import os
import signal
import struct
import subprocess
import time

import pytest
from conftest import BUILD, program, udp_port, wait_for

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


class Pair:
    """Two robots on a port of their own; one sends to the other while the clock is set."""

    def __init__(self, folder, environment, port, key_line, count):
        folder.mkdir()
        cli = program("swarmtalk-cli")
        self.started, self.count, sockets = [], count, []
        self.logs = [folder / f"{name}.log" for name in "ab"]
        for log in self.logs:
            config = log.with_suffix(".toml")
            config.write_text(f'[links.w]\ntype = "udp"\ninterface = "lo"\nport = {port}\n'
                              + key_line)
            sockets.append(log.with_suffix(".sock"))
            with open(log, "w", encoding="utf-8") as out:
                self.started.append(subprocess.Popen(
                    [program("swarmtalkd"), "--config", config, "--socket", sockets[-1]],
                    stderr=out, env=environment))
            wait_for(sockets[-1].exists, what="socket")
        self.heard = folder / "heard"  # a pipe holds few messages
        with open(self.heard, "w", encoding="utf-8") as out:
            self.sub = subprocess.Popen(
                [cli, "--socket", sockets[1], "sub", "c", "--json", "--timestamped", "-C",
                 str(count), "-W", "60"], stdout=out)
        self.started.append(self.sub)
        wait_for(lambda: json.loads(subprocess.run(
            [cli, "--socket", sockets[1], "status", "--json"], capture_output=True,
            text=True).stdout)["channels"], what="subscription")
        self.started.append(subprocess.Popen(
            [cli, "--socket", sockets[0], "pub", "c", "x", "--timestamped", "--repeat", str(count),
             "--rate", str(RATE_HZ)]))

    def check(self):
        self.sub.wait(timeout=90)
        messages = [json.loads(line) for line in self.heard.read_text().splitlines()]
        delays = sorted(message["buffering_delay_us"] for message in messages
                        if message["buffering_delay_us"] is not None)
        print(f"{len(messages)} messages over {len(STEPS_S)} clock steps: delay p50 "
              f"{delays[len(delays) // 2]} us, longest {delays[-1]} us")
        assert [m["message_number"] for m in messages] == list(range(1, self.count + 1))
        # A message that waited in the socket while the clock was set would show the step's size.
        assert not any(480_000 <= delay <= 520_000 or delay > 990_000 for delay in delays), delays
        logs = "".join(log.read_text() for log in self.logs)
        assert "warning" not in logs and "error" not in logs, logs

    def end(self):
        for process in reversed(self.started):
            process.send_signal(signal.SIGTERM)
            process.wait(60)


def test_clock_steps_change_neither_delivery_nor_delays(tmp_path):
    """Of open frames and of sealed ones, whose age is judged at the kernel's stamps of the wall
    clock."""
    if "san" in BUILD.name:
        pytest.skip("a sanitizer's library must be the first to be loaded")
    clock = Clock(tmp_path / "offset")
    port = udp_port()
    environment = {**os.environ, "LD_PRELOAD": str(SHIM),
                   "SWARMTALK_CLOCK_OFFSET": str(tmp_path / "offset")}
    key = tmp_path / "swarm.key"
    subprocess.run([program("swarmtalk-cli"), "keygen", key], check=True, capture_output=True)
    count = int(RATE_HZ * (len(STEPS_S) * 0.5 + 1))
    pairs = []
    try:
        for name, key_line in (("open", ""), ("sealed", f'key_file = "{key}"\n')):
            pairs.append(Pair(tmp_path / name, environment, port + len(pairs), key_line, count))
        for seconds in STEPS_S:
            time.sleep(0.5)
            clock.set(seconds)
        for pair in pairs:
            pair.check()
    finally:
        for pair in pairs:
            pair.end()
