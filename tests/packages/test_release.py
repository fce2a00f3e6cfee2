"""Packages as a release has them: what they hold, and their life on robots that are booted."""
import json
import pathlib
import re
import shutil
import subprocess

import booted
import pytest
from booted import ENVIRONMENT, UNIT, run, wait_for
from conftest import (OWN_ARCHITECTURE, build, copy_of_tree, older, only_with_all,
                      packages_of)

pytestmark = pytest.mark.field
PACKAGES = {"swarmtalkd", "swarmtalk-cli", "swarmtalk-lab", "swarmtalk-suite", "swarmtalk-view",
            "libswarmtalk-dev", "libswarmtalk-c0", "python3-swarmtalk",
            "swarmtalk-kilobot-firmware"}


def fields(package):
    lines = run("dpkg-deb", "--field", package).stdout.splitlines()
    return dict(line.split(": ", 1) for line in lines if re.match(r"[A-Z][\w-]+: ", line))


def files(package):
    lines = run("dpkg-deb", "--contents", package).stdout.splitlines()
    return {line.split()[5][1:] for line in lines if not line.startswith("d")}


def test_lintian_finds_nothing_in_packages_of_a_release():
    booted.needs("lintian")
    packages = packages_of()
    assert set(packages) == PACKAGES
    done = run("lintian", "--no-cfg", "--allow-root", "--tag-display-limit=0", *packages.values(),
               timeout=300)
    found = [line for line in done.stdout.splitlines() if line.startswith(("E:", "W:"))]
    assert not found, "\n".join(found)


def test_a_package_depends_on_what_its_files_need():
    packages = packages_of()
    depends = {name: fields(package).get("Depends", "") for name, package in packages.items()}
    version = fields(packages["swarmtalkd"])["Version"]
    for name in ("swarmtalkd", "swarmtalk-cli"):
        assert f"{name} (= {version})" in depends["swarmtalk-lab"]
    assert "iproute2" in depends["swarmtalk-lab"]
    assert f"swarmtalk-lab (= {version})" in depends["swarmtalk-suite"]
    assert f"libswarmtalk-c0 (= {version})" in depends["libswarmtalk-dev"]
    assert "libsodium" in depends["swarmtalkd"] and "libpcap" in depends["swarmtalkd"]
    assert "protobuf" not in depends["libswarmtalk-dev"]
    triplet = run("dpkg-architecture", "-qDEB_HOST_MULTIARCH").stdout.strip()
    for name in ("libswarmtalk-dev", "libswarmtalk-c0"):
        libraries = {path for path in files(packages[name]) if re.search(r"\.(so|a)\b", path)}
        assert libraries and all(path.startswith(f"/usr/lib/{triplet}/") for path in libraries)
        assert fields(packages[name])["Multi-Arch"] == "same"


CPP = """#include <memory>
#include <string>
#include <swarmtalk/client.hpp>
int main() {
  const auto path = std::make_shared<std::string>("/nonexistent/" + std::to_string(1));
  swarmtalk::Client robot("consumer", {*path});
  return robot.connect().code() == swarmtalk::StatusCode::kNoDaemon ? 0 : 1;
}
"""


def test_an_application_in_cpp_17_links_neither_protobuf_nor_anything_else(tmp_path):
    """Of the release, with no library but the compiler's own in sight."""
    packages = packages_of()
    run("dpkg-deb", "--extract", packages["libswarmtalk-dev"], tmp_path / "root")
    (tmp_path / "main.cpp").write_text(CPP)
    library = next((tmp_path / "root").rglob("libswarmtalk.a"))
    done = run("g++", "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
               tmp_path / "main.cpp", "-o", tmp_path / "main",
               "-I", tmp_path / "root/usr/include", "-L", library.parent, "-lswarmtalk",
               timeout=120)
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "main").returncode == 0
    assert "protobuf" not in run("ldd", tmp_path / "main").stdout
    assert " _ZN6google8protobuf" not in run("nm", "--extern-only", library).stdout


@pytest.mark.parametrize("architecture", [OWN_ARCHITECTURE, "arm64", "armhf"])
def test_two_builds_are_the_same_bytes(architecture, tmp_path):
    """In another folder, at another time, with nothing of what the first one compiled."""
    only_with_all("a second build")
    first = packages_of(architecture=architecture)
    tree = copy_of_tree(tmp_path / "elsewhere/a tree")
    second = build(tmp_path / "packages", "--jobs", "1", "--arch", architecture,
                   script=tree / "tools/package", CCACHE_DISABLE="1")
    assert set(second) <= set(first) and "swarmtalkd" in second
    different = [name for name in second if first[name].read_bytes() != second[name].read_bytes()]
    assert not different, f"compare with diffoscope: {different}"


class Robot(booted.Container):
    def apt(self, *words):
        done = self.do("apt-get", "-y", "-o", "Dpkg::Options::=--force-confold",
                       *words, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def path(self, path):
        return pathlib.Path(f"/proc/{self.leader}/root{path}")

    def left_behind(self):
        """What is there of us after all packages are purged."""
        found = self.do("find", "/etc", "/usr", "/lib", "/var/lib/systemd", "/run/swarmtalkd",
                        "/run/swarmtalk", "-name", "*swarmtalk*").stdout.split()
        # The user stays, as any package's: its number must not go to somebody else.
        return [path for path in found if not path.startswith("/usr/share/doc/")]


NAMESPACES = ["swrelease-a", "swrelease-b"]
OURS = ("swarmtalkd", "swarmtalk-cli", "python3-swarmtalk", "libswarmtalk-c0")


@pytest.fixture
def robots(tmp_path, request):
    """Two, with the version before installed, joined by a wire named as a robot's radio."""
    booted.needs_booting()
    packages = packages_of(request.param)
    before = older({name: packages[name] for name in OURS}, tmp_path / "older")
    roots = [tmp_path / "root1", tmp_path / "root2"]
    started = []
    try:
        booted.make_wire(NAMESPACES, "wlan0")
        booted.make_root(roots[0], before.values(), request.param)
        (roots[0] / "new").mkdir()
        for name in OURS:
            shutil.copy(packages[name], roots[0] / "new")
        assert run("cp", "-a", roots[0], roots[1], timeout=120).returncode == 0
        for number, (root, namespace) in enumerate(zip(roots, NAMESPACES), start=1):
            (root / "etc/hostname").write_text(f"robot{number}\n")
            started.append(Robot(root, namespace, tmp_path / f"console{number}"))
        yield started
    finally:
        for robot in started:
            robot.power_off()
        booted.remove_wire(NAMESPACES)
        for root in roots:
            shutil.rmtree(root, ignore_errors=True)


def cross(sender, receiver, text):
    """One message from a program of alice on one robot to one on the other."""
    heard = subprocess.Popen(receiver.command(*receiver.as_user(
        "alice", "swarmtalk-cli", "sub", "c", "--json", "-C", "1", "-W", "20")),
        text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=ENVIRONMENT)
    wait_for(lambda: json.loads(receiver.cli("status", "--json").stdout)["channels"],
             what="subscription")
    program = ("import swarmtalk; robot = swarmtalk.Client('p'); "
               f"robot.advertise('c').send({text!r}); robot.run(0.2)")
    sent = sender.do(*sender.as_user("alice", "python3", "-c", program))
    assert sent.returncode == 0, sent.stderr
    out, errors = heard.communicate(timeout=30)
    assert heard.returncode == 0, errors
    assert json.loads(out)["text"] == text


def version_of(robot, package):
    return robot.do("dpkg-query", "-Wf", "${Version}", package).stdout


@pytest.mark.parametrize("robots", ["bookworm", "trixie"], indirect=True)
def test_packages_start_talk_upgrade_and_purge(robots):
    first, second = robots
    for robot in robots:
        assert robot.show("ActiveState") == "inactive", "an installation starts nothing"
        robot.systemctl("start", UNIT)  # with the configuration as it was installed
        wait_for(robot.is_serving, timeout=30, what="daemon")
    cross(first, second, "before")

    mine = second.path("/etc/swarmtalk/swarmtalkd.toml")
    mine.write_text(mine.read_text() + "# mine\n")
    before = version_of(first, "swarmtalkd")
    pids = [robot.show("MainPID") for robot in robots]
    for robot in robots:
        robot.apt("install", *(f"/new/{path.name}" for path in robot.path("/new").iterdir()))
        wait_for(robot.is_serving, timeout=30, what="daemon after the upgrade")
    assert version_of(first, "swarmtalkd") != before
    assert all(robot.show("MainPID") != pid for robot, pid in zip(robots, pids)), "not restarted"
    assert "The version before" not in first.path("/etc/swarmtalk/swarmtalkd.toml").read_text()
    assert mine.read_text().endswith("# mine\n"), "somebody's own configuration is kept"
    cross(second, first, "after")

    for robot in robots:
        robot.systemctl("enable", UNIT)
        robot.apt("purge", *OURS)
        assert robot.left_behind() == []
        assert robot.do("systemctl", "is-active", UNIT).stdout.strip() == "inactive"
