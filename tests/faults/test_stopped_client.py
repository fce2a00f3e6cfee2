"""One of 64 clients stops reading: the others hear everything, and memory stays bounded."""
import os
import signal
import time

import pytest

import swarm

CLIENTS = 64
SECONDS = 4
QUEUE_BYTES = 262144  # over 2 s of the traffic, for clients that a busy machine keeps waiting

pytestmark = [pytest.mark.field,
              pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")]


def test_one_of_64_clients_stops(tmp_path):
    limits = f"[limits]\nqueue_bytes = {QUEUE_BYTES}\n"
    with swarm.Swarm(2, tmp_path, limits) as group:
        hearers = [group.hear(1, f"hear{number}", "crowd") for number in range(CLIENTS)]
        stopped = hearers[CLIENTS // 2]
        before_kb = group.robots[1].memory_kb()
        stopped.process.send_signal(signal.SIGSTOP)
        sender = group.send(0, "send", "crowd", 100, 1000)
        time.sleep(SECONDS)
        sent = sender.end()
        time.sleep(0.5)
        after_kb = group.robots[1].memory_kb()
        accounts = {hearer: hearer.end() for hearer in hearers}

    print(f"{sent['sent']} messages of 1000 B; daemon's memory {before_kb} KiB before, "
          f"{after_kb} KiB after; the stopped one: {accounts[stopped]}")
    for hearer, account in accounts.items():
        assert account["unaccounted"] == 0
        if hearer is not stopped:
            assert account["received"] == sent["sent"], account
    assert after_kb - before_kb <= QUEUE_BYTES / 1024 + 1024
