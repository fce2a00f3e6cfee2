"""The Debian packages of what is under test: lintian looks at them, and they run under a really
booted systemd, in two containers joined by a wire. tests/packages/ builds as a release does."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

import pytest
from conftest import BUILD, ROOT, run, wait_for

sys.path.insert(0, str(ROOT / "tests/support"))
from booted import (ENVIRONMENT, UNIT, Container, make_root, make_wire, needs,  # noqa: E402
                    needs_booting, remove_wire)

pytestmark = pytest.mark.logic


MADE = BUILD / "tests/packages-of-this-build"


@pytest.fixture(scope="module")
def packages():
    """All packages of debian/control, of what the build folder holds, by name."""
    needs("dh")
    shutil.rmtree(MADE, ignore_errors=True)
    done = run(ROOT / "tools/package", "--from", BUILD, MADE, timeout=800)
    assert done.returncode == 0, done.stdout + done.stderr
    return {package.name.split("_")[0]: package for package in MADE.glob("*.deb")}


@pytest.mark.timeout(900)
def test_packages_are_made(packages):
    named = re.findall(r"^Package: (\S+)", (ROOT / "debian/control").read_text(), re.M)
    assert sorted(packages) == sorted(named)


@pytest.mark.timeout(900)
def test_lintian_finds_no_error(packages):
    needs("lintian")
    done = run("lintian", "--no-cfg", "--allow-root", "--tag-display-limit=0", *packages.values(),
               timeout=800)
    found = [line for line in done.stdout.splitlines() if line.startswith(("E:", "W:"))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("compiled_for,machine,code", [
    ("7", "armv6l", 1), ("7", "armv7l", 0), ("7", "aarch64", 0), ("6", "armv6l", 0)])
def test_apt_refuses_what_an_older_arm_cannot_run(tmp_path, compiled_for, machine, code):
    script = tmp_path / "preinst"
    text = (ROOT / "debian/swarmtalk-cli.preinst").read_text()
    script.write_text(text.replace("#ARM#", compiled_for))
    (tmp_path / "uname").write_text(f"#!/bin/sh\necho {machine}\n")
    (tmp_path / "uname").chmod(0o755)
    for action in ("install", "upgrade"):
        done = run("/bin/sh", script, action,
                   env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"})
        assert done.returncode == code, done.stderr
        assert done.stderr.count("\n") == code and (not code or "an ARMv6" in done.stderr)


def test_the_packages_know_what_they_were_compiled_for(tmp_path, packages):
    needs("dpkg-deb")
    script = (ROOT / "debian/swarmtalk-cli.preinst").read_text()
    for name in ("swarmtalk-cli", "libswarmtalk-c0", "swarmtalk-view"):
        assert (ROOT / f"debian/{name}.preinst").read_text() == script, "the same in all"
        run("dpkg-deb", "--control", packages[name], tmp_path / name)
        text = (tmp_path / name / "preinst").read_text()
        assert re.search(r'^compiled_for="[0-9]+"$', text, re.M), text
        assert "DEBHELPER" not in text


@pytest.fixture
def wire():
    """Two network namespaces, each with one end of a wire, named wire0."""
    names = [f"swpkg{os.getpid()}{side}" for side in "ab"]
    try:
        make_wire(names, "wire0")
        yield names
    finally:
        remove_wire(names)


CONFIG = """[node]
id = "hostname"
[links.wire]
type = "raw_l2"
interface = "wire0"
[log]
client = "debug"
"""


@pytest.fixture
def robots(tmp_path, wire, packages):
    needs_booting()
    roots = [tmp_path / "root1", tmp_path / "root2"]
    make_root(roots[0], [packages["swarmtalkd"], packages["swarmtalk-cli"]])
    done = run("cp", "-a", roots[0], roots[1], timeout=120)
    assert done.returncode == 0, done.stderr
    booted = []
    try:
        for number, (root, namespace) in enumerate(zip(roots, wire), start=1):
            (root / "etc/hostname").write_text(f"robot{number}\n")
            (root / "etc/swarmtalk/swarmtalkd.toml").write_text(CONFIG)
            drop_in = root / f"etc/systemd/system/{UNIT}.d/test.conf"
            drop_in.parent.mkdir(parents=True)
            drop_in.write_text("[Service]\nWatchdogSec=2\nRestartSec=0.1\n")
            booted.append(Container(root, namespace, tmp_path / f"console{number}"))
        yield booted
    finally:
        for robot in booted:
            robot.power_off()
        for root in roots:
            shutil.rmtree(root, ignore_errors=True)


def cross(sender, receiver, text):
    """One message from an app of alice on one robot to one on the other."""
    heard = subprocess.Popen(receiver.command(*receiver.as_user(
        "alice", "swarmtalk-cli", "sub", "c", "--json", "-C", "1", "-W", "20")),
        text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env=ENVIRONMENT)
    wait_for(lambda: json.loads(receiver.cli("status", "--json").stdout)["channels"],
             what="subscription")
    sent = sender.cli("pub", "c", text)
    assert sent.returncode == 0, sent.stderr
    out, errors = heard.communicate(timeout=30)
    assert heard.returncode == 0, errors
    return json.loads(out)


def check_start(robot, number):
    robot.systemctl("enable", "--now", "swarmtalkd.socket", UNIT)
    assert robot.show("ActiveState") == "active"
    assert robot.show("StatusText").startswith(f"node {number}, link wire up, ")
    status = pathlib.Path(f"/proc/{robot.leader}/root/proc/{robot.show('MainPID')}/status")
    fields = dict(line.split(":\t", 1) for line in status.read_text().splitlines() if ":\t" in line)
    for name in ("CapEff", "CapPrm", "CapInh", "CapAmb"):
        assert int(fields[name], 16) == 0, name
    assert fields["NoNewPrivs"] == "1" and fields["Uid"].split()[0] != "0"


def check_restart(robot, why):
    """Waits until systemd has started the daemon once more; returns after it serves again."""
    wait_for(lambda: int(robot.show("NRestarts")) == check_restart.count + 1, timeout=30, what=why)
    check_restart.count += 1
    wait_for(robot.is_serving, timeout=30, what="daemon to serve again")


def check_reload(robot):
    config = pathlib.Path(f"/proc/{robot.leader}/root/etc/swarmtalk/swarmtalkd.toml")
    config.write_text(CONFIG + "[limits]\nclients = 50\n")
    robot.systemctl("reload", UNIT)
    assert "now applies: limits.clients" in robot.journal()
    config.write_text(CONFIG + "[limits]\nclients = 0\n")
    assert robot.do("systemctl", "reload", UNIT).returncode != 0
    assert "swarmtalkd.toml:9: key 'limits.clients': 0 is out of range" in robot.journal()
    assert robot.is_serving()
    config.write_text(CONFIG)
    robot.systemctl("reload", UNIT)


def check_rename(robot, number):
    """What doctor says to do about two robots of one id, to the letter."""
    assert robot.do("hostnamectl", "set-hostname", f"robot{number}").returncode == 0
    assert robot.cli("reload").stdout == "applied: node.id\n"
    status = json.loads(robot.cli("status", "--json").stdout)
    assert status["node_id"] == number
    assert f"this is now node {number} (from the host's name" in robot.journal()


FIELD = CONFIG.replace("[node]", """[node]
pose_socket = "/run/swarmtalkd/pose.sock"
""").replace("[links.wire]", """[links.wire]
key_file = "/etc/swarmtalk/swarm.key"
""") + """[metrics]
file = "/run/swarmtalkd/swarmtalk.prom"
interval_s = 1
"""


def restart_with(robot, config):
    path = pathlib.Path(f"/proc/{robot.leader}/root/etc/swarmtalk/swarmtalkd.toml")
    path.write_text(config)
    robot.systemctl("restart", UNIT)
    wait_for(robot.is_serving, timeout=30, what="daemon with another configuration")


def send_text(robot, text, user):
    """A datagram to the pose socket, as a tracking program in another language would."""
    script = ("socket(S, AF_UNIX, SOCK_DGRAM, 0); send(S, $ARGV[0], 0, "
              "pack_sockaddr_un('/run/swarmtalkd/pose.sock')) or die $!")
    return robot.do(*robot.as_user(user, "perl", "-MSocket", "-e", script, text))


def check_field_work(robots):
    """Key, pose socket and metrics file, with all of the unit's hardening."""
    key = pathlib.Path("/etc/swarmtalk/swarm.key")
    first, second = robots
    assert first.do("swarmtalk-cli", "keygen", key).returncode == 0
    places = [pathlib.Path(f"/proc/{robot.leader}/root{key}") for robot in robots]
    places[1].write_bytes(places[0].read_bytes())
    for robot in robots:
        assert robot.do("chmod", "0400", key).returncode == 0
        assert robot.do("chown", "swarmtalk:", key).returncode == 0
        restart_with(robot, FIELD)
    assert "Permission denied" in send_text(first, "0.5 1.0 0.0", "bob").stderr
    for robot, pose in zip(robots, ("3.0 4.0 0.0", "0.0 0.0 0.0")):
        done = send_text(robot, pose, "alice")
        assert done.returncode == 0, done.stderr
        wait_for(lambda robot=robot: json.loads(robot.cli("status", "--json").stdout)["pose"],
                 what="the pose")
    heard = cross(first, second, "sealed")
    assert (heard["text"], heard["distance_m"]) == ("sealed", 5.0)
    metrics = pathlib.Path(f"/proc/{second.leader}/root/run/swarmtalkd/swarmtalk.prom")
    wait_for(lambda: re.search(r"^swarmtalk_messages_received\S* [1-9]", metrics.read_text(), re.M),
             what="metrics of the message")


def check_remedies(robot):
    """A key where the unit hides it, or of the wrong owner: what the journal says is done, once."""
    config = pathlib.Path(f"/proc/{robot.leader}/root/etc/swarmtalk/swarmtalkd.toml")
    install = "install -D -o swarmtalk -m 0400 {} /etc/swarmtalk/new.key"
    for folder in ("/tmp", "/home/alice"):
        key = f"{folder}/new.key"
        robot.do("rm", "-f", key, "/etc/swarmtalk/new.key")
        assert robot.do("swarmtalk-cli", "keygen", key).returncode == 0
        config.write_text(FIELD.replace("/etc/swarmtalk/swarm.key", key))
        assert robot.do("systemctl", "restart", UNIT).returncode != 0
        assert f"run: sudo {install.format(key)}, and name" in robot.journal()
        assert robot.do(*install.format(key).split()).returncode == 0
        restart_with(robot, FIELD.replace("swarm.key", "new.key"))
    for words in ("chown root:swarmtalk", "chmod 0640"):
        robot.do(*words.split(), "/etc/swarmtalk/new.key")
    assert robot.do("systemctl", "restart", UNIT).returncode != 0
    command = re.findall("others can reach the key; run: (.*)", robot.journal())[-1]
    assert robot.do("sh", "-c", command.replace("sudo ", "")).returncode == 0
    restart_with(robot, FIELD.replace("swarm.key", "new.key").replace("/run/swarmtalkd/", "/tmp/"))
    assert "metrics.file: no other program sees /tmp/swarmtalk.prom" in robot.journal()


def check_udp(robots, namespaces):
    for number, (robot, namespace) in enumerate(zip(robots, namespaces), start=1):
        assert run("ip", "-n", namespace, "addr", "add", f"10.83.84.{number}/24", "dev",
                   "wire0").returncode == 0
        folder = f"/etc/systemd/system/{UNIT}.d/"
        assert robot.do("cp", "/usr/share/swarmtalk/udp.conf", folder).returncode == 0
        robot.systemctl("daemon-reload")
        restart_with(robot, CONFIG.replace("raw_l2", "udp"))
    assert cross(robots[0], robots[1], "over IP")["text"] == "over IP"


def check_off(robot):
    """What operations.md says of an end that lasts: whoever connects does not start it."""
    text = (ROOT / "docs/operations.md").read_text(encoding="utf-8")
    for words in re.findall("^    systemctl ((?:stop|disable) .*?) +#", text, re.M):
        robot.systemctl("restart", UNIT)
        robot.systemctl(*words.split())
        assert robot.cli("status").returncode != 0
        assert robot.show("ActiveState") == "inactive", words
    for unit in (UNIT, "swarmtalkd.socket"):
        assert robot.do("systemctl", "is-enabled", unit).stdout == "disabled\n"


@pytest.mark.field
def test_two_robots_under_a_booted_systemd(robots, wire):
    first, second = robots
    started = time.monotonic()
    check_start(first, 1)
    check_start(second, 2)
    heard = cross(first, second, "from one to two")
    assert (heard["text"], heard["sender"], heard["hops"]) == ("from one to two", 1, 0)
    assert cross(second, first, "and back")["sender"] == 2

    refused = first.cli("pub", "c", "x", user="bob")
    assert refused.returncode == 3
    remedy = "no permission for /run/swarmtalk/swarmtalkd.sock; join group swarmtalk"
    assert remedy in refused.stderr
    assert re.search(r"client connected \(pid \d+, uid \d+\)", first.journal())

    check_restart.count = 0
    first.systemctl("kill", "--kill-whom=main", "-s", "KILL", UNIT)
    check_restart(first, "restart after SIGKILL")
    assert cross(first, second, "after a kill")["text"] == "after a kill"
    first.systemctl("kill", "--kill-whom=main", "-s", "STOP", UNIT)
    check_restart(first, "restart by the watchdog")
    assert re.search("[Ww]atchdog", first.journal())
    assert cross(second, first, "after the watchdog")["text"] == "after the watchdog"

    check_reload(first)
    check_rename(first, 11)
    second.systemctl("stop", UNIT)
    assert second.show("ActiveState") == "inactive"
    assert second.cli("status").returncode == 0, "a client's connection starts the daemon"
    assert second.show("ActiveState") == "active"
    assert "a program waits at swarmtalkd.socket" in second.journal()
    check_field_work(robots)
    check_remedies(second)
    check_udp(robots, wire)
    check_off(second)
    print(f"two booted robots: {time.monotonic() - started:.1f} s after boot")
