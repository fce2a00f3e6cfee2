"""Robots that are really booted: a Debian with our packages, its systemd, and a network namespace
of its own, by systemd-nspawn. Needs root and a Debian mirror; skips without."""
import os
import pathlib
import platform
import re
import subprocess

import pytest

from commands import needs, run, wait_for

UNIT = "swarmtalkd.service"
SOURCES = pathlib.Path("/etc/apt/sources.list.d/debian.sources")
ENVIRONMENT = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive"}
OWN_SUITE = platform.freedesktop_os_release().get("VERSION_CODENAME")
UNREACHABLE = "Could not (resolve|connect)|Temporary failure|Unable to connect"


needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")


def needs_booting():
    if os.geteuid() != 0:
        pytest.skip("booting containers needs root")
    needs("mmdebstrap", "systemd-nspawn", "nsenter", "dh")
    if not SOURCES.exists():
        pytest.skip(f"{SOURCES} is missing: where is this Debian from?")


class Container:
    """One robot: a Debian with our package, booted, in a network namespace of its own."""

    def __init__(self, root, namespace, log):
        self.log = log
        self.nspawn = subprocess.Popen(
            ["systemd-nspawn", "--quiet", "--directory", root, "--boot", "--register=no",
             "--keep-unit", f"--network-namespace-path=/run/netns/{namespace}",
             "--console=pipe"],
            stdin=subprocess.DEVNULL, stdout=open(log, "w", encoding="utf-8"),
            stderr=subprocess.STDOUT)
        self.leader = None
        wait_for(self.find_leader, timeout=30, what="container to start")
        wait_for(lambda: self.do("systemctl", "is-system-running").stdout.strip()
                 in ("running", "degraded"), timeout=90, what=f"boot, see {log}")

    def find_leader(self):
        assert self.nspawn.poll() is None, pathlib.Path(self.log).read_text(encoding="utf-8")
        children = pathlib.Path(f"/proc/{self.nspawn.pid}/task/{self.nspawn.pid}/children")
        for pid in children.read_text().split():
            if pathlib.Path(f"/proc/{pid}/comm").read_text().strip() == "systemd":
                self.leader = pid
        return self.leader

    def command(self, *words):
        return ["nsenter", "--target", self.leader, "--all", "--wdns=/", "--", *map(str, words)]

    def do(self, *words, **options):
        return run(*self.command(*words), env=ENVIRONMENT, **options)

    def as_user(self, user, *words):
        return ("setpriv", f"--reuid={user}", f"--regid={user}", "--init-groups", *words)

    def systemctl(self, *words):
        done = self.do("systemctl", *words, timeout=60)
        assert done.returncode == 0, (words, done.stdout, done.stderr, self.journal())
        return done.stdout

    def show(self, name):
        return self.systemctl("show", "--value", "-p", name, UNIT).strip()

    def journal(self):
        return self.do("journalctl", "--no-pager", "-o", "cat", "-u", UNIT).stdout

    def cli(self, *words, user="alice"):
        return self.do(*self.as_user(user, "swarmtalk-cli", *words))

    def is_serving(self):
        return self.show("ActiveState") == "active" and self.cli("status").returncode == 0

    def power_off(self):
        if self.leader:
            self.do("systemctl", "poweroff")
        try:
            self.nspawn.wait(30)
        except subprocess.TimeoutExpired:
            self.nspawn.kill()
            self.nspawn.wait(10)


def mirror():
    """Where this machine's Debian is from."""
    return re.search(r"^URIs: *(\S+)", SOURCES.read_text(encoding="utf-8"), re.M)[1]


def make_root(folder, packages, suite=OWN_SUITE, architecture=None):
    """A Debian with systemd, our packages installed by apt, and two users: alice may, bob not."""
    install = f"""set -e
mkdir "$1/packages"
cp {' '.join(str(package) for package in packages)} "$1/packages"
chroot "$1" apt-get install -y --no-install-recommends $(cd "$1" && ls packages/*.deb | sed s,^,./,)
rm -r "$1/packages"
chroot "$1" useradd --create-home --groups swarmtalk alice
chroot "$1" useradd --create-home bob"""
    options = [f"--architectures={architecture}"] if architecture else []
    from_here = suite == OWN_SUITE and not architecture
    with open(SOURCES, encoding="utf-8") as sources:
        try:
            done = subprocess.run(
                ["mmdebstrap", "--quiet", "--variant=minbase", *options,
                 "--include=systemd,systemd-sysv,dbus,iproute2", f"--customize-hook={install}",
                 suite, str(folder), "-" if from_here else mirror()],
                stdin=sources, capture_output=True, text=True, timeout=900)
        except subprocess.TimeoutExpired:
            pytest.skip("a Debian did not come from its mirror within 900 s")
    if done.returncode != 0 and re.search(UNREACHABLE, done.stderr):
        pytest.skip("no Debian mirror can be reached")
    assert done.returncode == 0, done.stderr[-3000:]


def make_wire(names, interface):
    """Two network namespaces of these names, joined by a wire; remove_wire() takes them away."""
    ends = [f"swp{os.getpid()}{side}" for side in "ab"]
    assert all(len(end) <= 15 for end in ends)
    for name in names:
        assert run("ip", "netns", "add", name).returncode == 0
        run("ip", "netns", "exec", name, "sysctl", "-qw", "net.ipv6.conf.all.disable_ipv6=1",
            "net.ipv6.conf.default.disable_ipv6=1")
    done = run("ip", "link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
    assert done.returncode == 0, done.stderr
    for name, end in zip(names, ends):
        assert run("ip", "link", "set", end, "netns", name, "name", interface).returncode == 0
        assert run("ip", "-n", name, "link", "set", interface, "up").returncode == 0


def remove_wire(names):
    for name in names:
        run("ip", "netns", "del", name)
