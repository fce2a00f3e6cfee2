"""docs/tutorial.md as a new user types it: in a bare Debian that is booted, with our packages in
a folder, from their installation to a program in Python that hears two robots and how far they are.
"""
import os
import shutil
import subprocess
import time

import booted
import pytest
import tutorial
from booted import ENVIRONMENT, run
from conftest import bare_root, packages_of

pytestmark = pytest.mark.field
WITH_CPP = os.environ.get("SWARMTALK_PACKAGES") == "all"
AT_MOST_S = 600  # for all of it, the installation with it
NAMESPACE = f"swtutorial{os.getpid()}"
HOME = "home/alice"


@pytest.fixture
def laptop(tmp_path, request):
    """A user who may use sudo, and the packages of the tutorial's first line. Nothing else."""
    booted.needs_booting()
    packages = packages_of(request.param)
    root = tmp_path / "root"
    bare_root(root, request.param, "minbase", "systemd", "systemd-sysv", "dbus", "sudo")
    run("chroot", root, "useradd", "--create-home", "--shell", "/bin/bash", "alice")
    (root / "etc/sudoers.d/alice").write_text("alice ALL=(ALL) NOPASSWD: ALL\n")
    for package in packages.values():
        shutil.copy(package, root / HOME)
    tutorial.write_programs(root / HOME)
    try:
        yield root
    finally:
        shutil.rmtree(root, ignore_errors=True)


def as_alice(*words):
    return ["setpriv", "--reuid=alice", "--regid=alice", "--init-groups", "env", "HOME=/" + HOME,
            "PYTHONUNBUFFERED=1", "bash", "-e", "-c", f"cd /{HOME} && eval \"$1\"", "bash", *words]


def install(root, block):
    """Not booted yet: the only step that needs the internet, by this machine's network."""
    done = run("systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--as-pid2",
               "--console=pipe",
               "--directory", root, *as_alice(block.replace("apt install", "apt install -y")),
               env=ENVIRONMENT, timeout=AT_MOST_S)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


@pytest.mark.parametrize("laptop", ["bookworm", "trixie"], indirect=True)
def test_a_new_user_gets_from_nothing_to_a_program_of_his_own(laptop, tmp_path):
    started = time.monotonic()
    install(laptop, tutorial.install_block())
    installed = time.monotonic()
    compiler = next(block for before, block in tutorial.blocks("sh")
                    if tutorial.is_for_cpp(before) and tutorial.installs(block))
    if WITH_CPP:
        install(laptop, compiler)
    with_compiler = time.monotonic()
    robot = None
    try:
        assert run("ip", "netns", "add", NAMESPACE).returncode == 0
        robot = booted.Container(laptop, NAMESPACE, tmp_path / "console")
        begun = time.monotonic()

        def status():
            return robot.do(*as_alice("swarmtalk-lab exec 2 -- swarmtalk-cli status")).stdout

        def wanted(before, block):
            return not tutorial.installs(block) and (WITH_CPP or not tutorial.is_for_cpp(before))

        text = tutorial.type_all(wanted, robot.command(*as_alice()), status, env=ENVIRONMENT)
        ended = time.monotonic()
    finally:
        if robot:
            robot.power_off()
        subprocess.run(["ip", "netns", "del", NAMESPACE], check=False)
    tutorial.check(text, programs=2 if WITH_CPP else 1)
    took = installed - started + ended - begun
    print(f"tutorial: packages installed in {installed - started:.0f} s, the rest typed in "
          f"{ended - begun:.0f} s: {took:.0f} s; a compiler: {with_compiler - installed:.0f} s")
