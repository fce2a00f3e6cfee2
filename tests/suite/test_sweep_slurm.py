"""A sweep on a Slurm of one node: jobs that die, a node that disappears, no Slurm at all."""
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import time

import pytest

from test_runner import ENVIRONMENT, ROOT, SUITE, suite
from test_sweep import CELLS, FOUR, SMALL, finished

sys.path.insert(0, str(ROOT / "tests/support"))
sys.path.insert(0, str(ROOT / "suite/runner"))
import slurm_node  # noqa: E402
from sweep import slurm  # noqa: E402

RUNS = 10
ON_SLURM = ["sweep", "s.toml", "--slurm"]


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    reason = slurm_node.missing()
    if reason:
        pytest.skip(reason)
    node = slurm_node.SlurmNode(tmp_path_factory.mktemp("slurm"))
    yield node
    node.end()


def start(node, folder) -> subprocess.Popen:
    return subprocess.Popen(node.inside([SUITE, *ON_SLURM]), cwd=folder, text=True,
                            env=ENVIRONMENT | node.settings,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def wait_for(is_so, what: str, seconds: float = 250):
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


def table_without_slurm(folder) -> bytes:
    (folder / "here").mkdir()
    (folder / "here/s.toml").write_text(SMALL.format(runs=RUNS))
    done = suite(folder / "here", "sweep", "s.toml")
    assert done.returncode == 0, done.stderr
    return (folder / "here/sweep-s/table.csv").read_bytes()


@pytest.mark.field
def test_a_job_that_is_killed_is_run_again_and_the_table_is_the_same(node, tmp_path):
    seed = random.randrange(10**6)
    print(f"seed {seed}")
    wanted = table_without_slurm(tmp_path)
    (tmp_path / "s.toml").write_text(SMALL.format(runs=RUNS))
    process = start(node, tmp_path)
    wait_for(lambda: finished(tmp_path) >= random.Random(seed).randrange(5, 40), "no run is done")
    wait_for(node.programs, "no job runs")
    killed = node.programs()
    for pid in killed:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    output, errors = process.communicate(timeout=500)
    assert process.returncode == 0, errors + output
    assert killed and finished(tmp_path) == RUNS * CELLS
    assert errors.count("swarmtalk-suite: job ") >= 2, errors  # what was lost was sent once more
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == wanted


@pytest.mark.field
def test_a_node_that_disappears_loses_nothing_that_was_finished(node, tmp_path):
    wanted = table_without_slurm(tmp_path)
    (tmp_path / "s.toml").write_text(SMALL.format(runs=RUNS))
    process = start(node, tmp_path)
    wait_for(lambda: finished(tmp_path) >= 20, "no run is done")
    node.kill_node()
    kept = {path: path.stat().st_ino for path in tmp_path.glob("sweep-s/runs/*/[0-9]*.json")}
    # Who watches is killed as well: the same command finds the jobs that are under way.
    process.kill()
    process.communicate()
    node.start_node()
    process = start(node, tmp_path)
    output, errors = process.communicate(timeout=500)
    assert process.returncode == 0, errors + output
    assert {path: path.stat().st_ino for path in kept} == kept and len(kept) >= 20
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == wanted


@pytest.mark.field
def test_jobs_that_can_never_succeed_are_given_up_with_their_last_words(node, tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 2\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    for path in tmp_path.glob("sweep-s/runs/*/[0-9]*.json"):
        path.unlink()
    for path in tmp_path.glob("sweep-s/programs/*/swarmtalk-sim"):
        path.write_text("#!/bin/sh\necho swarmtalk-sim: this node has no libc >&2\nexit 1\n")
    process = start(node, tmp_path)
    _, errors = process.communicate(timeout=500)
    assert process.returncode == 1 and "3 job arrays in a row" in errors, errors
    assert "this node has no libc" in errors.splitlines()[-1]


def test_without_slurm_it_is_one_clear_line(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 1\n")
    done = subprocess.run([sys.executable, SUITE, *ON_SLURM], cwd=tmp_path, text=True,
                          env=ENVIRONMENT | {"PATH": "/nowhere"}, capture_output=True, timeout=60)
    assert done.returncode == 1 and "no sbatch here" in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1


def test_shares_hold_every_run_once_and_a_job_leaves_finished_ones_alone(tmp_path):
    shares = slurm.deal(list(range(11)), 3)
    assert sorted(sum(shares, [])) == list(range(11)) and max(map(len, shares)) == 4
    (tmp_path / "s.toml").write_text(FOUR + "runs = 3\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    before = (tmp_path / "sweep-s/table.csv").read_bytes()
    first, second = (tmp_path / f"sweep-s/runs/00000/{run}.json" for run in (0, 1))
    second.unlink()
    kept = first.stat().st_ino
    share = tmp_path / "share.json"
    share.write_text(json.dumps([[[0, 2]], [[0, 0], [0, 1]]]))
    job = subprocess.run([SUITE, "sweep", "s.toml", "--share", share], cwd=tmp_path, timeout=100,
                         env=ENVIRONMENT | {"SLURM_ARRAY_TASK_ID": "1"}, capture_output=True)
    assert job.returncode == 0, job.stderr
    assert first.stat().st_ino == kept and second.exists()
    (tmp_path / "sweep-s/table.csv").unlink()
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == before
    assert not list(pathlib.Path(tmp_path / "sweep-s").glob("runs/*/.*"))
