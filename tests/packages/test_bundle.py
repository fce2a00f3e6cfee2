"""The archive for a robot without internet, and the program in it that installs."""
import json
import os
import pathlib
import shutil
import subprocess

import booted
import pytest
from booted import run
from conftest import OWN_ARCHITECTURE, ROOT, bare_root, packages_of


def faked(folder, **answers):
    """An unpacked archive for bookworm amd64, and a PATH whose programs give these answers."""
    shutil.copy(ROOT / "tools/swarmtalk-install", folder)
    (folder / "suite").write_text("bookworm\n")
    (folder / "arch").write_text("amd64\n")
    (folder / "os-release").write_text(f"VERSION_CODENAME={answers.pop('suite', 'bookworm')}\n")
    programs = folder / "bin"
    programs.mkdir()
    for name, answer in {"uname": "x86_64", "dpkg": "amd64", "id": "1000", **answers}.items():
        (programs / name).write_text(f"#!/bin/sh\necho {answer}\n")
        (programs / name).chmod(0o755)
    return {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}",
            "SWARMTALK_OS_RELEASE": str(folder / "os-release")}


@pytest.mark.parametrize("answers,said", [
    ({"uname": "armv6l"}, "this machine is an ARMv6 (Raspberry Pi Zero W or 1)"),
    ({"dpkg": "arm64"}, "for amd64, and this system is arm64: take the archive for arm64"),
    ({"suite": "trixie"}, "for bookworm, and this system is trixie"),
    ({}, "installing needs root: sudo "),
], ids=["armv6", "architecture", "release", "user"])
def test_what_the_archive_is_not_for_is_refused_with_a_sentence(tmp_path, answers, said):
    environment = faked(tmp_path, **answers)
    done = run(tmp_path / "swarmtalk-install", env=environment)
    assert done.returncode == 1
    assert said in done.stderr and done.stderr.count("\n") == 1


def make_bundle(folder, architecture=OWN_ARCHITECTURE):
    packages = packages_of(architecture=architecture)
    done = run(ROOT / "tools/bundle", "--arch", architecture, "--packages",
               next(package.parent for package in packages.values()), folder, timeout=900)
    if "apt cannot fetch" in done.stderr:
        pytest.skip("no Debian mirror can be reached")
    assert done.returncode == 0, done.stderr
    return packages, pathlib.Path(done.stdout.splitlines()[-1])


@pytest.mark.field
def test_the_archive_installs_in_a_bare_system_without_a_network(tmp_path):
    booted.needs_booting()
    packages, archive = make_bundle(tmp_path)
    assert archive.name.endswith(f"-{booted.OWN_SUITE}-{OWN_ARCHITECTURE}.tar")
    root = tmp_path / "root"
    bare_root(root, booted.OWN_SUITE)
    run("tar", "--extract", "--file", archive, "--directory", root)
    name = archive.stem
    try:
        # A network namespace without any interface.
        done = run("unshare", "--net", "chroot", root, f"/{name}/swarmtalk-install", timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        said = run("chroot", root, "swarmtalk-cli", "--version")
        assert said.returncode == 0, said.stderr
        done = run("unshare", "--net", "chroot", root, f"/{name}/swarmtalk-install",
                   *sorted(set(packages)), timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
    finally:
        shutil.rmtree(root)


UDP = """[node]
id = 7
[socket]
path = "/tmp/daemon.sock"
[links.air]
type = "udp"
interface = "lo"
"""


@pytest.mark.field
def test_the_portable_programs_run_on_an_older_debian(tmp_path):
    booted.needs_booting()
    archive = make_bundle(tmp_path)[1]
    done = run(ROOT / "tools/portable", archive, tmp_path, timeout=120)
    assert done.returncode == 0, done.stderr
    root = tmp_path / "root"
    bare_root(root, "bullseye", "essential")
    portable = pathlib.Path(done.stdout.splitlines()[-1])
    run("tar", "--extract", "--file", portable, "--directory", root)
    home = f"/{portable.stem}"
    (root / "tmp/config.toml").write_text(UDP)
    inside = ["chroot", str(root)]
    daemon = None
    try:
        assert run(*inside, "cat", "/etc/debian_version").stdout.startswith("11.")
        # A system's own programs cannot run there: that is why these exist.
        daemon = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "ip link set lo up; exec \"$@\"", "daemon", *inside,
             f"{home}/swarmtalkd", "--config", "/tmp/config.toml"], stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=open(tmp_path / "log", "w", encoding="utf-8"))
        cli = [*inside, f"{home}/swarmtalk-cli", "--socket", "/tmp/daemon.sock"]
        booted.wait_for(lambda: run(*cli, "status").returncode == 0, what="daemon")
        heard = subprocess.Popen([*cli, "sub", "c", "-C", "1", "-W", "60"], text=True,
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        booted.wait_for(lambda: json.loads(run(*cli, "status", "--json").stdout)["channels"],
                        what="subscription")
        assert run(*cli, "pub", "c", "old friend").returncode == 0
        out, errors = heard.communicate(timeout=90)
        assert "old friend" in out, errors
    finally:
        if daemon:
            daemon.terminate()
            daemon.wait(60)
        shutil.rmtree(root)
