"""tools/quickstart, as somebody runs it who has just cloned the tree, and what it tells to try."""
import os
import re
import shutil
import subprocess

import pytest
from booted import needs_root, run, wait_for
from conftest import BUILD, ROOT, copy_of_tree, only_with_all

GIB = 1024 * 1024


@pytest.mark.parametrize("free_kb,processors,jobs", [
    (100_000, 4, 1), (900_000, 4, 1), (1_900_000, 4, 3), (16 * GIB, 4, 4)])
def test_as_many_compilers_run_as_memory_allows(tmp_path, free_kb, processors, jobs):
    text = (ROOT / "tools/jobs").read_text().replace("/proc/meminfo", str(tmp_path / "meminfo"))
    text = text.replace("/sys/fs/cgroup", str(tmp_path))
    (tmp_path / "meminfo").write_text(f"MemTotal: 99999999 kB\nMemAvailable: {free_kb} kB\n")
    (tmp_path / "nproc").write_text(f"#!/bin/sh\necho {processors}\n")
    (tmp_path / "nproc").chmod(0o755)
    done = run("sh", "-c", text, env={"PATH": f"{tmp_path}:{os.environ['PATH']}"})
    assert (done.returncode, done.stdout) == (0, f"{jobs}\n"), done.stderr


def told(output):
    """The commands below the heading that begins so, without their comments."""
    def below(heading):
        part = output[output.index(heading):].split("\n\n")[0]
        return [re.sub(r"  +#.*", "", line.strip()) for line in part.splitlines()[1:]
                if line.startswith("  ")]
    return below


def programs_of_this_build(tree):
    """What quickstart would have built is there, from the build under test; nothing compiles."""
    (tree / "build-quickstart").symlink_to(BUILD)
    programs = tree / "bin"
    programs.mkdir()
    (programs / "cmake").write_text("#!/bin/sh\ntrue\n")
    (programs / "cmake").chmod(0o755)
    return {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}


@pytest.mark.field
@needs_root
@pytest.mark.parametrize("is_built", [False, True], ids=["without_its_build", "with_its_build"])
def test_quickstart_talks_and_so_do_the_programs_that_it_tells_of(tmp_path, is_built):
    if is_built:
        only_with_all("what tools/quickstart compiles, four minutes of a processor")
    tree = copy_of_tree(tmp_path / "tree")
    environment = None if is_built else programs_of_this_build(tree)
    done = run(tree / "tools/quickstart", timeout=3000, env=environment)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    if is_built:
        assert re.search(r"^\[ ?\d+%, [\d.]+ s\] ", done.stdout, re.M), "it shows how far it is"
    assert len(re.findall(r"robot \d.*distance 0\.50 m", done.stdout)) >= 4, done.stdout
    below = told(done.stdout)
    for heading in ("Now your own program, in C++", "Or in Python"):
        commands = below(heading)
        assert len(commands) >= 2
        for command in commands:
            last = subprocess.run(command, shell=True, cwd=tree, capture_output=True, text=True,
                                  timeout=300)
            assert last.returncode == 0, (command, last.stderr)
        assert last.stdout.count("says hello") > 10, last.stdout
    up, sub, pub, down = below("Three robots that stay")
    assert run("sh", "-c", up, cwd=tree).returncode == 0
    try:
        listener = subprocess.Popen(f"exec {sub} -C 1 -W 60", shell=True, cwd=tree, text=True,
                                    stdout=subprocess.PIPE)
        status = f"{sub.split(' -- ')[0]} -- {pub.split(' -- ')[1].split()[0]} status --json"
        wait_for(lambda: '"channels":[]' not in run("sh", "-c", status, cwd=tree).stdout.replace(
            " ", ""), what="subscription")
        assert run("sh", "-c", pub, cwd=tree).returncode == 0
        assert "good morning" in listener.communicate(timeout=90)[0]
    finally:
        assert run("sh", "-c", down, cwd=tree).returncode == 0
    shutil.rmtree(tree)
