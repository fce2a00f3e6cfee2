"""Packages for ARM machines: what they need is to be had there, and their programs talk, as far as
qemu's user mode takes them. No machine of the kind takes part: raw layer 2 and systemd are not
tried.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess

import booted
import pytest
from booted import run, wait_for
from conftest import packages_of

pytestmark = pytest.mark.field
QEMU = {"arm64": "qemu-aarch64-static", "armhf": "qemu-arm-static"}
MACHINE = {"arm64": "AArch64", "armhf": "ARM"}
ARMHF_FLAGS = ("hard-float ABI",)
NAMESPACES = ["swarm-a", "swarm-b"]
NETWORK = "10.83.85"
CONFIG = """[node]
id = {number}
[socket]
path = "{socket}"
[links.air]
type = "udp"
interface = "wlan0"
address = "{network}.255"  # qemu 7.2 cannot join a multicast group of an interface
"""


def unpack(folder, architecture, packages):
    """A root of that architecture with these packages and all they need, as apt finds them. Nothing
    of it is run: not everywhere may programs of another machine be started by themselves."""
    repository = folder / "repository"
    repository.mkdir()
    for package in packages.values():
        shutil.copy(package, repository)
    index = run("dpkg-scanpackages", "--multiversion", ".", cwd=repository, timeout=60)
    assert index.returncode == 0, index.stderr
    (repository / "Packages").write_text(index.stdout)
    done = run("mmdebstrap", "--quiet", "--variant=extract", f"--architectures={architecture}",
               f"--include={','.join(packages)}", booted.OWN_SUITE, folder / "root",
               f"deb {booted.mirror()} {booted.OWN_SUITE} main",
               f"deb [trusted=yes] copy:{repository} ./", timeout=900)
    if re.search(booted.UNREACHABLE, done.stderr):
        pytest.skip("no Debian mirror can be reached")
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "root"


@pytest.fixture
def wire():
    if os.geteuid() != 0:
        pytest.skip("network namespaces need root")
    try:
        booted.make_wire(NAMESPACES, "wlan0")
        for number, name in enumerate(NAMESPACES, start=1):
            assert run("ip", "-n", name, "addr", "add", f"{NETWORK}.{number}/24", "brd", "+", "dev",
                       "wlan0").returncode == 0
        yield NAMESPACES
    finally:
        booted.remove_wire(NAMESPACES)


class Emulated:
    """A robot whose programs run in qemu's user mode, in a network namespace."""

    def __init__(self, number, namespace, qemu, root, folder):
        self.prefix = ["ip", "netns", "exec", namespace, qemu, "-L", str(root)]
        self.root = root
        self.socket = folder / f"{number}.sock"
        config = folder / f"{number}.toml"
        config.write_text(CONFIG.format(number=number, network=NETWORK,
                                        socket=self.socket))
        self.log = folder / f"{number}.log"
        with open(self.log, "w", encoding="utf-8") as log:
            self.daemon = subprocess.Popen(self.command("sbin/swarmtalkd", "--config", config),
                                           stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def command(self, program, *words):
        return [*self.prefix, str(self.root / "usr" / program), *map(str, words)]

    def cli(self, *words):
        return self.command("bin/swarmtalk-cli", "--socket", self.socket, *words)

    def status(self):
        assert self.daemon.poll() is None, self.log.read_text()
        done = run(*self.cli("status", "--json"), timeout=60)
        return json.loads(done.stdout) if done.returncode == 0 else None

    def stop(self):
        self.daemon.terminate()
        try:
            self.daemon.wait(20)
        except subprocess.TimeoutExpired:
            self.daemon.kill()
            self.daemon.wait(20)


def talk(robots):
    """One message from the first to the second."""
    for robot in robots:
        wait_for(robot.status, timeout=60, what="daemon to serve")
    heard = subprocess.Popen(robots[1].cli("sub", "c", "--json", "-C", "1", "-W", "60"), text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    wait_for(lambda: robots[1].status()["channels"], timeout=60, what="subscription")
    sent = run(*robots[0].cli("pub", "c", "from an emulated machine"), timeout=60)
    assert sent.returncode == 0, sent.stderr
    out, errors = heard.communicate(timeout=90)
    assert heard.returncode == 0, errors
    message = json.loads(out)
    assert (message["text"], message["sender"]) == ("from an emulated machine", 1)


def check_machine(path, architecture):
    header = run("readelf", "--file-header", path).stdout
    assert re.search(rf"Machine: +{MACHINE[architecture]}\n", header), header
    assert architecture != "armhf" or all(flag in header for flag in ARMHF_FLAGS), header


@pytest.mark.parametrize("architecture", ["arm64", "armhf"])
def test_packages_of_another_machine_resolve_and_their_programs_talk(architecture, tmp_path, wire):
    booted.needs("mmdebstrap", "dpkg-scanpackages", QEMU[architecture])
    packages = packages_of(architecture=architecture)
    assert {"swarmtalkd", "swarmtalk-cli", "swarmtalk-lab", "swarmtalk-suite", "libswarmtalk-dev",
            "libswarmtalk-c0"} <= set(packages)
    root = unpack(tmp_path, architecture, packages)
    triplet = {"arm64": "aarch64-linux-gnu", "armhf": "arm-linux-gnueabihf"}[architecture]
    for path in ("usr/sbin/swarmtalkd", f"usr/lib/{triplet}/libswarmtalk-c.so.0",
                 "usr/libexec/swarmtalk/swarmtalk-sim"):
        check_machine(root / path, architecture)
    folder = pathlib.Path(f"/tmp/swarm{os.getpid()}")  # the path of a socket is at most 107 bytes
    folder.mkdir()
    robots = []
    try:
        for number, name in enumerate(wire, start=1):
            robots.append(Emulated(number, name, QEMU[architecture], root, folder))
        talk(robots)
    finally:
        for robot in robots:
            robot.stop()
        shutil.rmtree(folder)
        shutil.rmtree(root)
