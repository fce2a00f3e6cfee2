"""A wire with robots, and a stranger on it: a network namespace without a daemon, in which the
attacks of this folder run as programs. Used by the tests beside it and by benchmarks/hostile.py."""
import os
import pathlib
import subprocess
import sys

from wires import Wires

ATTACKS = pathlib.Path(__file__).resolve().parent
LINK = '[links.w]\ntype = "raw_l2"\ninterface = "a0"\n'


class Air(Wires):
    """One wire `a`. robot(NUMBER) has a daemon on it, attack(NAME) runs on the stranger's robot."""

    def __init__(self):
        super().__init__()
        self.stranger = None

    def __enter__(self):
        super().__enter__()
        self.wire("a")
        self.stranger = self.robot("a")
        return self

    def daemon(self, number, more=""):
        """A robot with node id `number`. @param more: lines behind those of its link"""
        return self.robot("a").start(f"[node]\nid = {number}\n{LINK}{more}")

    def begin(self, name, *arguments):
        """Starts an attack (NAME.py). Its seed is SWARMTALK_SEED."""
        words = ["ip", "netns", "exec", self.stranger.namespace, sys.executable,
                 ATTACKS / f"{name}.py", "--interface", "a0", "--seed",
                 os.environ.get("SWARMTALK_SEED", "1"), *arguments]
        return self.keep(subprocess.Popen([str(word) for word in words], text=True,
                                          stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                          stderr=subprocess.PIPE))

    def attack(self, name, *arguments, timeout=120):
        """Runs an attack to its end; returns what it printed."""
        process = self.begin(name, *arguments)
        out, error = process.communicate(timeout=timeout)
        assert process.returncode == 0, error
        return out


def tell(attack, command):
    """Gives a command to an attack that reads some; returns its answer."""
    attack.stdin.write(command + "\n")
    attack.stdin.flush()
    return attack.stdout.readline().strip()


def counter(robot, name, link="w"):
    return robot.link(link)["counters"][name]
