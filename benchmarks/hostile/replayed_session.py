"""Recorded frames of robots with a key, played to a receiver that has just started."""
import pathlib
import tempfile

from conftest import program, run, wait_for
from stranger import Air, counter, tell
from wires import heard

TITLE = "20 recorded messages of a run before, played three times to a receiver that restarts"
REFERENCE = "all taken once more after a restart; 2,052 taken in four rounds of 513 sessions"


def measure():
    with tempfile.TemporaryDirectory() as folder, Air() as air:
        key = pathlib.Path(folder, "swarm.key")
        run(program("swarmtalk-cli"), "keygen", key)
        line = f'key_file = "{key}"\n'
        attack = air.begin("replay", "--rate", 2000)
        sender, hearer = air.daemon(1, line), air.daemon(2, line)
        for robot in (sender, hearer):
            wait_for(lambda: counter(robot, "frames_received") > 0, what="robots that are heard")
        sender.publish("5", "open the gripper", "--repeat", 20, "--rate", 100)
        tell(attack, "stop")
        sender.stop()
        hearer.stop()
        hearer.start(f'[node]\nid = 2\n[links.w]\ntype = "raw_l2"\ninterface = "a0"\n{line}')
        listener = hearer.subscribe("5", "-W", "6")
        for order in ("order", "play", "play"):
            tell(attack, order)
        taken = len(heard(listener))
        return f"{taken} of 20 taken, {counter(hearer, 'frames_not_proven')} frames not proven"
