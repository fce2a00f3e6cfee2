"""Network namespaces joined by wires, made and removed by whoever asks for them. Needs root."""
import itertools
import os
import subprocess

TIMEOUT_S = 60
_count = itertools.count()


def run(*command):
    subprocess.run([str(word) for word in command], check=True, timeout=TIMEOUT_S)


class Robots:
    """`count` namespaces, one a robot, each with an interface wlan0, all on one wire.

    Two are joined directly, more by a bridge in a namespace of its own. Addresses are
    10.231.77.NUMBER/24; IPv6 is off, so nobody speaks but what is under test.
    """

    NETWORK = "10.231.77"

    def __init__(self, count, prefix="swarmtalk"):
        stem = f"{prefix}-{os.getpid()}-{next(_count)}"
        self.names = [f"{stem}-{number}" for number in range(1, count + 1)]
        self.hub = f"{stem}-hub" if count != 2 else None

    def __enter__(self):
        try:
            self._make()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _make(self):
        for name in [*self.names, *([self.hub] if self.hub else [])]:
            run("ip", "netns", "add", name)
            for key in ("all", "default"):
                self.command(name, "sysctl", "-qw", f"net.ipv6.conf.{key}.disable_ipv6=1")
            self.command(name, "ip", "link", "set", "lo", "up")
        if self.hub is None:
            run("ip", "link", "add", "wlan0", "netns", self.names[0], "type", "veth", "peer",
                "wlan0", "netns", self.names[1])
        else:
            self.command(self.hub, "ip", "link", "add", "air", "type", "bridge", "mcast_snooping",
                         "0")
            self.command(self.hub, "ip", "link", "set", "air", "up")
            for number, name in enumerate(self.names, 1):
                port = f"robot{number}"
                run("ip", "link", "add", "wlan0", "netns", name, "type", "veth", "peer", port,
                    "netns", self.hub)
                self.command(self.hub, "ip", "link", "set", port, "master", "air", "up")
        for number, name in enumerate(self.names, 1):
            self.command(name, "ip", "address", "add", f"{self.NETWORK}.{number}/24", "dev",
                         "wlan0")
            self.command(name, "ip", "link", "set", "wlan0", "up")
            self.command(name, "ip", "route", "add", "default", "dev", "wlan0")

    def __exit__(self, *_):
        for name in [*self.names, *([self.hub] if self.hub else [])]:
            subprocess.run(["ip", "netns", "delete", name], check=False, stderr=subprocess.DEVNULL)

    @staticmethod
    def words(name, *command):
        return ["ip", "netns", "exec", name, *map(str, command)]

    def command(self, name, *command):
        run(*self.words(name, *command))

    def start(self, name, *command, **options):
        """Starts a command in a namespace. `ip netns exec` becomes it, so the pid is its own."""
        return subprocess.Popen(self.words(name, *command), **options)
