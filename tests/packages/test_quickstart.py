"""tools/quickstart, as somebody runs it who has just cloned the tree, and what it tells to try."""
import os
import re
import shutil
import signal
import subprocess

import pytest
from booted import needs_root, run, wait_for
from conftest import BUILD, ROOT, copy_of_tree, only_with_all

GIB = 1024 * 1024


@pytest.mark.parametrize("free_kb,processors,jobs", [
    (100_000, 4, 1), (900_000, 4, 1), (1_900_000, 4, 2), (16 * GIB, 4, 4)])
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
    (tree / "build-quickstart").mkdir()
    for built in BUILD.iterdir():
        (tree / "build-quickstart" / built.name).symlink_to(built)
    programs = tree / "bin"
    programs.mkdir()
    (programs / "cmake").write_text("#!/bin/sh\ntrue\n")
    (programs / "cmake").chmod(0o755)
    return {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}


def its_map_is_there(words, tree):
    with subprocess.Popen(words, cwd=tree, text=True, stdout=subprocess.PIPE) as process:
        assert "http://localhost:" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 128 + signal.SIGINT


@pytest.mark.field
@needs_root
@pytest.mark.parametrize("is_built", [False, True], ids=["without_its_build", "with_its_build"])
def test_quickstart_talks_and_so_do_the_programs_that_it_tells_of(tmp_path, is_built):
    if is_built:
        only_with_all("what tools/quickstart compiles, four minutes of a processor")
    tree = copy_of_tree(tmp_path / "tree")
    environment = None if is_built else programs_of_this_build(tree)
    before_all = run("git", "-C", tree, "status", "--porcelain").stdout
    done = run(tree / "tools/quickstart", timeout=3000, env=environment)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    if is_built:
        assert re.search(r"^Building: \d+ %$", done.stdout, re.M), "it shows how far it is"
    assert len(re.findall(r"robot \d.*distance 0\.50 m", done.stdout)) >= 4, done.stdout
    below = told(done.stdout)
    [before] = below("In each terminal first")

    def command(words):
        return ["sh", "-c", f"{before}; exec {words}"]
    up, view = below("See it")
    sub, pub = below("Talk to it")
    *programs, down = below("Write a program")
    assert run(*command(up), cwd=tree).returncode == 0
    try:
        its_map_is_there(command(view), tree)
        listener = subprocess.Popen(command(f"{sub} -C 1 -W 60"), cwd=tree, text=True,
                                    stdout=subprocess.PIPE)
        status = f"{sub.split(' -- ')[0]} -- swarmtalk-cli status --json"
        wait_for(lambda: '"hello"' in run(*command(status), cwd=tree).stdout, what="subscription")
        assert run(*command(pub), cwd=tree).returncode == 0
        assert "good morning" in listener.communicate(timeout=90)[0]
        for words in programs:
            done = run("sh", "-c", f"{before}; {words}", cwd=tree, timeout=300)
            assert done.returncode == 0, (words, done.stderr)
            if "exec all" in words:
                assert done.stdout.count("says hello") > 10, done.stdout
    finally:
        assert run(*command(down), cwd=tree).returncode == 0
    assert run("git", "-C", tree, "status", "--porcelain").stdout == before_all
    shutil.rmtree(tree)
