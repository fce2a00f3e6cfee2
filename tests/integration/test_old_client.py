"""A program with an older library: what the library wrote to the socket, byte for byte
(tests/vectors/old_client.json, recorded with swarmtalk.py of commit c91cc48, before shares and
redundancy), is answered today with every field that is in the file."""
import json
import os
import pathlib
import random
import socket
import subprocess
import sys

import pytest
from conftest import ROOT, program, run, wait_for

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from local_frames import fields, frame, next_envelope  # noqa: E402

STEPS = json.loads((ROOT / "tests/vectors/old_client.json").read_text(encoding="utf-8"))


@pytest.fixture
def path(tmp_path):
    config, socket_path = tmp_path / "d.toml", tmp_path / "d.sock"
    port = random.Random(os.getpid()).randrange(20000, 60000)
    config.write_text('[node]\nid = 7\n[links.w]\ntype = "udp"\ninterface = "lo"\n'
                      f"port = {port}\n")
    daemon = subprocess.Popen([program("swarmtalkd"), "--config", config, "--socket", socket_path],
                              stderr=subprocess.DEVNULL)
    wait_for(socket_path.exists, what="socket")
    wait_for(lambda: run(program("swarmtalk-cli"), "--socket", socket_path, "status").returncode
             == 0, what="the daemon to serve")
    yield socket_path
    daemon.terminate()
    assert daemon.wait(10) == 0


def check(envelope, told):
    """@param told  the answer of then: values that are the same each time, null for the others"""
    body = told["body"]
    assert body in envelope, (told, envelope)
    assert envelope.get(1) == told.get("answers"), (told, envelope)
    now = fields(envelope[body]) if isinstance(envelope[body], bytes) else {}
    for number, value in told.get("fields", {}).items():
        assert int(number) in now, (told, now)
        if value is not None:
            is_same = now[int(number)] == (value if isinstance(value, int)
                                           else bytes.fromhex(value))
            assert is_same, (number, told, now)


def test_a_program_with_an_older_library_is_served_as_then(path):
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(20)
        connection.connect(str(path))
        received = b""
        for step in STEPS:
            if "client" in step:
                connection.sendall(b"".join(frame(bytes.fromhex(each)) for each in step["client"]))
            elif "program" in step:
                done = run(program("swarmtalk-cli"), "--socket", path, *step["program"])
                assert done.returncode == 0, done.stderr
            else:
                for told in step["daemon"]:
                    envelope, received = next_envelope(received, lambda: connection.recv(65536))
                    check(fields(envelope), told)
