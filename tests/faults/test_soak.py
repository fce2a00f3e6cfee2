"""5000 messages a second between four daemons: memory is flat, every message accounted for."""
import os
import signal
import time

import pytest

import swarm

SECONDS = float(os.environ.get("SWARMTALK_SOAK_SECONDS", "120"))
RATE_HZ = 1250  # of each robot
ROBOTS = 4
MEMORY_SLACK_KB = 256

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")


@pytest.mark.field
def test_soak(tmp_path):
    with swarm.Swarm(ROBOTS, tmp_path) as group:
        hearers = [group.hear(robot, "hear", "soak") for robot in range(ROBOTS)]
        senders = [group.send(robot, "send", "soak", RATE_HZ) for robot in range(ROBOTS)]
        # Whatever keeps a program from its processor later then fills no queue for the first time.
        for hearer in hearers:
            hearer.process.send_signal(signal.SIGSTOP)
            time.sleep(1)
            hearer.process.send_signal(signal.SIGCONT)
        samples = []
        started = time.monotonic()
        while (passed := time.monotonic() - started) < SECONDS:
            time.sleep(min(5.0, SECONDS / 20))
            samples.append((passed, [robot.memory_kb() for robot in group.robots]))
        sent = [sender.end() for sender in senders]
        time.sleep(0.5)
        heard = [hearer.end() for hearer in hearers]
        seconds = time.monotonic() - started

    # The first quarter is for buffers to reach their size.
    steady = [memory for passed, memory in samples if passed > SECONDS / 4]
    rises = [steady[-1][robot] - steady[0][robot] for robot in range(ROBOTS)]
    total = sum(account["sent"] for account in sent)
    print(f"{seconds:.0f} s, {total / seconds:.0f} messages/s sent; resident memory KiB "
          f"{steady[0]} after a quarter, {steady[-1]} at the end")
    for robot, account in enumerate(heard):
        # The robot's own sender is another program, so it is heard too.
        print(f"robot {robot + 1}: {total} sent, {account}")
        lost = sum(account[place] for place in ("air", "kernel", "daemon", "client"))
        assert account["unaccounted"] == 0
        assert account["received"] + lost - account["late"] == total
    assert all(account["open"] == 0 for account in sent)
    assert max(rises) <= MEMORY_SLACK_KB, rises
