"""swarm_check by its command line, and one course for one seed whatever compiled it."""
import os
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CHECK = pathlib.Path(os.environ["SWARMTALK_BUILD"]) / "tests" / "virtual" / "swarm_check"


def run(*words, program=CHECK):
    return subprocess.run([program, *map(str, words)], capture_output=True, text=True)


def courses(program, seeds):
    """The course of each story: a line for each."""
    told = run("--seeds", seeds, "--courses", program=program)
    assert told.returncode == 0, told.stdout[-2000:]
    lines = sorted(line for line in told.stdout.splitlines() if ": course " in line)
    assert len(lines) == seeds
    return lines


@pytest.mark.parametrize("words", [["--seeds"], ["--seeds", "x"], ["--seed", "1.5"],
                                   ["--jobs", "0"], ["--seeds", "-1"], ["17"], ["--what"]])
def test_a_wrong_command_line_gets_the_usage(words):
    told = run(*words)
    assert told.returncode == 2
    assert "usage: swarm-check" in told.stderr
    assert told.stdout == ""


def test_a_story_is_told_and_run_alone():
    told = run("--story", 5)
    assert told.returncode == 0
    assert told.stdout.startswith("seed 5, range 10 m\nrobot 1 at ")
    alone = run("--seed", 5)
    assert alone.returncode == 0
    assert alone.stdout == told.stdout + "every promise was kept\n"
    assert "info: [link] virtual air: up" in alone.stderr


def test_what_struck_and_what_was_decided_is_counted():
    told = run("--seeds", 40, "--first", 100, "--jobs", 2)
    assert told.returncode == 0
    lines = told.stdout.splitlines()
    assert lines[0].startswith("40 stories from seed 100 on, ")
    assert lines[-1] == "every promise was kept"
    counted = {line.split(" struck ")[0].strip(): line.split() for line in lines[1:-1]}
    assert len(counted) == 18
    for name, words in counted.items():
        assert int(words[words.index("struck") + 1]) > 0, name
    decided = [words[-1] for words in counted.values() if "decided" in words]
    assert len(decided) == 10
    assert all(int(count) > 0 for count in decided)


def test_one_seed_has_one_course():
    assert courses(CHECK, 10) == courses(CHECK, 10)


@pytest.mark.field
@pytest.mark.parametrize("compiler, flags", [("clang++", "-O1"), ("g++", "-O1"),
                                             ("g++", "-O1 -fsanitize=address,undefined")])
def test_one_seed_has_one_course_whatever_compiled_it(tmp_path, compiler, flags):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is missing (tools/setup test installs it)")
    c_compiler = {"g++": "gcc", "clang++": "clang"}[compiler]
    subprocess.run(["cmake", "--preset", "test", "-B", tmp_path, f"-DCMAKE_CXX_COMPILER={compiler}",
                    f"-DCMAKE_C_COMPILER={c_compiler}",
                    f"-DCMAKE_CXX_FLAGS_RELWITHDEBINFO={flags}"],
                   cwd=ROOT, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", tmp_path, "--target", "swarm_check"], check=True,
                   capture_output=True)
    assert courses(tmp_path / "tests" / "virtual" / "swarm_check", 200) == courses(CHECK, 200)
