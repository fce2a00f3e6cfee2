"""Sweeps as a user runs them: killed, taken up again, in each other's way, and without room."""
import csv
import fcntl
import importlib.util
import json
import os
import pathlib
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios

import pytest

from test_runner import BUILD, CCACHE, ENVIRONMENT, ROOT, SUITE, suite

sys.path[:0] = [str(ROOT / "suite/runner"), str(ROOT / "tests/support")]
import platforms  # noqa: E402
from commands import wait_for  # noqa: E402
from sweep import plan as plans, store as stores, work  # noqa: E402

SMALL = """
program = "hop_count"
seconds = 12
runs = {runs}
report = ["converged_s"]
[vary]
robots = [4, 9]
radio.loss = [0.0, 0.1, 0.3]
platform = ["sim-kilobot", "sim-coachbot"]
"""
CELLS = 12
FOUR = "program = 'hop_count'\nrobots = 4\nreport = ['delivery']\n"
# Of a profile nobody runs for long.
COMPILING = ENVIRONMENT | {"CXXFLAGS": "-O0", "CXX": " ".join([*CCACHE, "g++"])}


def finished(folder) -> int:
    return len(list(pathlib.Path(folder).glob("sweep-s/runs/*/[0-9]*.json")))


def kill_and_resume(folder, at: list[int], patience_s: float):
    """Kills the whole sweep, and all that it runs, when it has finished so many runs."""
    for limit in at:
        process = subprocess.Popen([SUITE, "sweep", "s.toml", "--jobs", "2"], cwd=folder,
                                   env=ENVIRONMENT, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL, start_new_session=True)
        wait_for(lambda: finished(folder) >= limit or process.poll() is not None, patience_s,
                 what="a sweep that seems to stand still")
        assert process.poll() is None, f"ended before {limit} runs"
        os.kill(process.pid, signal.SIGKILL)
        process.wait()


def sweep(folder, patience_s: float):
    return subprocess.run([SUITE, "sweep", "s.toml"], cwd=folder, env=ENVIRONMENT, text=True,
                          capture_output=True, timeout=patience_s)


def whole_and_broken(tmp_path, text: str, total: int, seed: int, patience_s: float = 250):
    """The same sweep run through, and killed three times at random and taken up again."""
    for name in ("whole", "broken"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "s.toml").write_text(text)
    done = sweep(tmp_path / "whole", patience_s)
    assert done.returncode == 0, done.stderr
    kill_and_resume(tmp_path / "broken", sorted(random.Random(seed).sample(range(1, total - 5), 3)),
                    patience_s)
    kept = finished(tmp_path / "broken")
    done = sweep(tmp_path / "broken", patience_s)
    assert done.returncode == 0, done.stderr
    assert f"{kept} finished runs are there" in done.stderr
    return [(tmp_path / name / "sweep-s/table.csv").read_bytes() for name in ("whole", "broken")]


@pytest.mark.timeout(1500)  # five waits of 250 s
def test_a_sweep_that_was_killed_and_resumed_gives_the_same_table(tmp_path):
    whole, broken = whole_and_broken(tmp_path, SMALL.format(runs=2), 2 * CELLS, seed=1)
    assert whole == broken and whole.count(b"\n") == 1 + 2 * CELLS
    identity = plans.read(str(tmp_path / "broken/s.toml")).identity()
    assert not list(pathlib.Path(tempfile.gettempdir()).glob(f"{work.SCRATCH}{identity}-*"))


@pytest.mark.field
def test_two_thousand_runs_killed_and_resumed_give_the_same_table(tmp_path):
    text = SMALL.format(runs=167).replace("seconds = 12", "seconds = 2")
    whole, broken = whole_and_broken(tmp_path, text, 167 * CELLS, seed=2, patience_s=1400)
    assert whole == broken and whole.count(b"\n") == 1 + 167 * CELLS


def test_interrupt_keeps_what_is_finished_and_says_so(tmp_path):
    (tmp_path / "s.toml").write_text(SMALL.format(runs=500))
    process = subprocess.Popen([SUITE, "sweep", "s.toml"], cwd=tmp_path, env=ENVIRONMENT,
                               stderr=subprocess.PIPE, text=True)
    wait_for(lambda: finished(tmp_path) >= 3, timeout=100, what="finished runs")
    with open(tmp_path / "sweep-s/lock", encoding="utf-8") as lock:  # it works alone there
        with pytest.raises(BlockingIOError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=100)
    kept = finished(tmp_path)
    assert process.returncode == 130 and f"{kept} finished runs are kept" in errors, errors
    assert kept < 500 * CELLS and not list(tmp_path.glob("sweep-s/runs/*/.*"))


def test_a_sweep_that_is_at_work_keeps_others_out(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 1\n")
    (tmp_path / "sweep-s").mkdir()
    with open(tmp_path / "sweep-s/lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # as a sweep does
        done = suite(tmp_path, "sweep", "s.toml")
        assert done.returncode == 1 and "another sweep is at work in" in done.stderr, done
        assert finished(tmp_path) == 0
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0


def test_a_swept_profile_is_compiled_once_and_makes_a_difference(tmp_path):
    """One bit of message number: fragments of two messages are put together. And any cell can be
    repeated by the command that the table tells."""
    (tmp_path / "s.toml").write_text("""
program = "news"
robots = 25
seconds = 40
runs = 2
radio.loss = 0.4
message = { bytes = 15, period_ms = 1500 }
report = ["spliced"]
[vary]
numbers = [{ label = "usual", radio.loss = 0.4 }, { label = "1", profile.message_bits = 1 }]
""")

    def sweep(*arguments):
        return subprocess.run([SUITE, "sweep", "s.toml", *arguments], cwd=tmp_path, env=COMPILING,
                              capture_output=True, text=True, timeout=250)
    done = sweep()
    assert done.returncode == 0 and done.stderr.count("compiling 1 simulators") == 1, done.stderr
    rows = list(csv.DictReader(open(tmp_path / "sweep-s/table.csv", encoding="utf-8")))
    assert all(int(r["spliced"]) == 0 for r in rows if r["numbers"] == "usual")
    assert all(int(r["spliced"]) > 0 for r in rows if r["numbers"] == "1")
    (tmp_path / "sweep-s/report.html").unlink()
    assert "compiling" not in sweep().stderr
    cells = list(csv.DictReader(open(tmp_path / "sweep-s/cells.csv", encoding="utf-8")))
    repeated = subprocess.run(cells[1]["repeat"], shell=True, cwd=tmp_path, env=COMPILING,
                              capture_output=True, text=True, timeout=100)
    assert repeated.returncode == 0 and repeated.stdout.count("\n") == 2, repeated.stderr
    path = tmp_path / "sweep-s/runs/00001/1.json"
    path.write_text(path.read_text().replace('"spliced": ', '"spliced": 1'))
    assert sweep("--repeat", "1").returncode == 1
    assert "no cell 2" in sweep("--repeat", "2").stderr


def test_a_profile_that_does_not_compile_is_one_clear_line(tmp_path):
    (tmp_path / "s.toml").write_text("program = 'news'\n[vary]\nprofile.mtu_bytes = [4]\n")
    done = subprocess.run([SUITE, "sweep", "s.toml"], cwd=tmp_path, env=COMPILING,
                          capture_output=True, text=True, timeout=250)
    assert done.returncode == 1 and done.stderr.splitlines()[1:] == [
        "swarmtalk-suite: the profile with mtu_bytes = 4 does not compile: this profile leaves no "
        "payload: its header and checksum fill the whole packet"], done.stderr
    # The file is put right: nothing was run, so the folder is this sweep's.
    (tmp_path / "s.toml").write_text(FOUR + "runs = 1\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0


def test_interrupt_ends_a_compiler_that_is_at_work(tmp_path):
    """It may be at it for minutes, or hang."""
    compiler = tmp_path / "slow"
    compiler.write_text('#!/bin/sh\ncase "$*" in *--version*) exit 0;; esac\n'
                        f"touch {tmp_path}/begun\nexec sleep 600\n")
    compiler.chmod(0o755)
    (tmp_path / "s.toml").write_text("program = 'news'\nprofile.records = 30\n")
    process = subprocess.Popen([SUITE, "sweep", "s.toml"], cwd=tmp_path, stderr=subprocess.PIPE,
                               env=ENVIRONMENT | {"CXX": str(compiler)}, text=True)
    wait_for((tmp_path / "begun").exists, timeout=60, what="the compiler")
    process.send_signal(signal.SIGTERM)
    try:
        _, errors = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130 and "0 finished runs are kept" in errors, errors


def test_a_folder_of_another_sweep_is_refused_and_kept(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 1\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    before = (tmp_path / "sweep-s/table.csv").read_bytes()
    (tmp_path / "s.toml").write_text("program = 'hop_count'\nrobots = 5\nruns = 1\n")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.tex").write_text("x")
    for folder, says in (("sweep-s", "holds another sweep"), ("mine", "is not a sweep's folder")):
        done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
        assert done.returncode == 1 and says in done.stderr and done.stderr.count("\n") == 1
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == before and finished(tmp_path) == 1
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.tex"]


def test_a_damaged_result_is_named_and_done_again(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 3\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    before = (tmp_path / "sweep-s/table.csv").read_bytes()
    (tmp_path / "sweep-s/runs/00000/1.json").write_text("")
    (tmp_path / "sweep-s/table.csv").unlink()
    done = suite(tmp_path, "sweep", "s.toml")
    assert "2 finished runs are there" in done.stderr and "1 files in" in done.stderr
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == before


@pytest.fixture
def small_disk(tmp_path):
    if os.geteuid() != 0:
        pytest.skip("a small disk of its own needs root")
    place = tmp_path / "disk"
    place.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16m", "tmpfs", place],
                      capture_output=True).returncode != 0:
        pytest.skip("cannot mount a tmpfs here")
    yield place
    subprocess.run(["umount", "-l", place], check=True)


def test_a_full_disk_is_one_clear_line_and_loses_nothing(tmp_path, small_disk):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 12\n")
    folder = small_disk / "sweep-s"
    assert suite(tmp_path, "sweep", "s.toml", "--folder", folder, "--check").returncode == 0
    (tmp_path / "begin.toml").write_text(FOUR + "runs = 5\n")
    assert suite(tmp_path, "sweep", "begin.toml", "--folder", folder).returncode == 0
    filler = small_disk / "filler"
    with open(filler, "wb", buffering=0) as file, pytest.raises(OSError):
        while True:
            file.write(b"x" * 4096)
    done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
    lines = [line for line in done.stderr.splitlines() if "no space left" in line]
    assert done.returncode == 1 and len(lines) == 1 and "finished runs are kept" in lines[0], done
    assert "Traceback" not in done.stderr and finished(small_disk) >= 5
    filler.unlink()
    done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
    assert done.returncode == 0 and finished(small_disk) == 12, done.stderr


def fill(place, free_bytes: int):
    """Nothing more fits there than this."""
    filler = place / "filler"
    with open(filler, "wb", buffering=0) as file:
        with pytest.raises(OSError):
            while True:
                file.write(b"x" * 4096)
        file.truncate(os.fstat(file.fileno()).st_size // 4096 * 4096 - free_bytes)
    return filler


def test_a_disk_that_is_full_at_the_beginning_or_at_the_report_spoils_nothing(tmp_path, small_disk):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 2\n[vary]\nradio.loss = [0.0, 0.2]\n")
    folder = small_disk / "sweep-s"
    for free_bytes in (0, 4096):  # nothing fits; the first of two files does
        filler = fill(small_disk, free_bytes)
        done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done
        assert "no space left" in done.stderr.lower()
        filler.unlink()
    done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
    assert done.returncode == 0, done.stderr
    if importlib.util.find_spec("matplotlib") is None:
        return
    wanted = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    filler = fill(small_disk, 12288)  # room for the tables
    done = suite(tmp_path, "sweep", "s.toml", "--folder", folder)
    assert done.returncode == 1 and "no space left" in done.stderr.lower(), done
    assert not (folder / "report.html").exists()
    filler.unlink()
    assert suite(tmp_path, "sweep", "s.toml", "--folder", folder).returncode == 0
    assert (folder / "report.html").read_bytes() == wanted


def test_what_a_platform_needs_is_missed_before_anything_is_run(tmp_path):
    (tmp_path / "build/suite").mkdir(parents=True)
    (tmp_path / "build/suite/swarmtalk-sim").symlink_to(BUILD / "suite/swarmtalk-sim")
    text = FOUR + "runs = 1\n[vary]\nplatform = ['sim-kilobot', '{}']\n"
    for platform, says in (("argos-footbot", "argos.json"), ("argos-kilobot", "argos.json"),
                           ("kilobot-emulated", "no program kilobot-emulator"),
                           ("coachbot-lab", "no program swarmtalk-lab")):
        (tmp_path / "s.toml").write_text(text.format(platform))
        check, run = (subprocess.run(
            [SUITE, "sweep", "s.toml", *words], cwd=tmp_path, capture_output=True, text=True,
            env=ENVIRONMENT | {"SWARMTALK_BUILD": str(tmp_path / "build")}, timeout=100)
            for words in (["--check"], []))
        if run.returncode == 0 and pathlib.Path("/usr/bin/swarmtalk-suite").exists():
            continue  # an installed one has it
        assert run.returncode == 1 and run.stderr.count("\n") == 1 and says in run.stderr, run
        assert f"cell 1 (platform = {platform})" in run.stderr and finished(tmp_path) == 0
        assert check.returncode == 0 and says in check.stdout, check


def test_an_edited_or_moved_file_goes_on_and_the_report_is_the_edited_files(tmp_path):
    """Also where file times are of another century, as after a clock was put right."""
    (tmp_path / "s.toml").write_text(FOUR + "runs = 2\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    for i, path in enumerate(sorted((tmp_path / "sweep-s").rglob("*"))):
        os.utime(path, (0, 0) if i % 2 else (2**32, 2**32))
    (tmp_path / "s.toml").unlink()
    (tmp_path / "moved.toml").write_text(
        FOUR.replace("delivery", "latency_p50_s") + "runs = 2\n")
    before = (tmp_path / "sweep-s/table.csv").read_bytes()
    done = suite(tmp_path, "sweep", "moved.toml", "--folder", "sweep-s")
    assert done.returncode == 0 and "2 finished runs are there" in done.stderr, done
    assert (tmp_path / "sweep-s/table.csv").read_bytes() == before
    if importlib.util.find_spec("matplotlib"):
        assert "latency, median" in (tmp_path / "sweep-s/report.html").read_text()
    assert "moved.toml" in (tmp_path / "sweep-s/sweep.json").read_text()


def test_what_cannot_be_done_is_said_and_leaves_nothing_behind(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 1\n")
    for words, says in ((["--merge"], "nothing to merge"), (["--repeat", "9"], "no cell 9"),
                        (["--repeat", "-1"], "no cell -1"), (["--seed", "3"], "for --repeat"),
                        (["--sbatch=--time=1"], "for --slurm"), (["--jobs", "0"], "1 or more"),
                        (["--folder", "s.toml"], "s.toml is not a folder")):
        done = suite(tmp_path, "sweep", "s.toml", *words)
        assert done.returncode == 1 and says in done.stderr, done
        assert done.stderr.count("\n") == 1 and [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_output_that_nobody_reads_is_one_line_and_all_is_kept(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 2\n")
    done = subprocess.run(f"{SUITE} sweep s.toml | true; exit ${{PIPESTATUS[0]}}", shell=True,
                          executable="/bin/bash", cwd=tmp_path, env=ENVIRONMENT, timeout=100,
                          capture_output=True, text=True)
    assert done.returncode == 1 and "nobody reads the output" in done.stderr, done
    assert done.stderr.count("\n") == 1 and finished(tmp_path) == 2
    assert (tmp_path / "sweep-s/table.csv").exists()


def test_on_a_narrow_terminal_progress_stays_one_line(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR + "runs = 4\n")
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 10, 40, 0, 0))
    done = subprocess.run([SUITE, "sweep", "s.toml"], cwd=tmp_path, env=ENVIRONMENT, stderr=theirs,
                          stdout=subprocess.PIPE, timeout=100)
    os.close(theirs)
    shown = b""
    with pytest.raises(OSError):  # the end of a terminal that nobody has open
        while True:
            shown += os.read(ours, 65536)
    os.close(ours)
    shown = shown.decode()
    assert done.returncode == 0 and "4/4 runs" in shown
    assert max(map(len, re.split(r"[\r\n]", shown))) < 40, shown


def make_store(folder, text: str) -> stores.Store:
    """A sweep's folder, begun in this process."""
    (folder / "s.toml").write_text(text)
    store = stores.Store(folder / "sweep-s", plans.read(str(folder / "s.toml")))
    store.open(folder / "s.toml")
    store.lock()
    store.mark(folder / "s.toml")
    return store


def test_a_run_in_real_time_is_marked_and_never_done_twice(tmp_path, monkeypatch):
    """One finished, one cut off by a kill: neither is begun again, and the table tells which."""
    from sweep import table
    store = make_store(tmp_path, "program = 'hop_count'\nplatform = 'coachbot-lab'\nruns = 3\n")
    begun = []

    def lab(scenario, log, simulator):
        begun.append(scenario["seed"])
        if len(begun) == 2:
            raise MemoryError  # in the place of a kill
        subprocess.run([BUILD / "suite/swarmtalk-sim", make_scenario(tmp_path, scenario), log],
                       check=True)
        return True

    monkeypatch.setattr(platforms, "run", lab)
    cell = store.plan.cells[0]
    assert work.do(store, cell, 0, tmp_path)["success"]
    with pytest.raises(MemoryError):
        work.do(store, cell, 1, tmp_path)
    queue = work.Queue(store.plan, store.scan(), store.plan.cells)
    assert list(queue.ready) == [(0, 2)] and begun == [1, 2]
    rows = list(csv.DictReader(table.runs_csv(store.plan, store.scan()).splitlines()))
    assert [(r["real_time"], r["cut_off"], r["success"]) for r in rows] == [
        ("1", "0", "1"), ("1", "1", "")]
    done = suite(tmp_path, "sweep", "s.toml", "--repeat", "0")
    assert done.returncode == 1 and "never run twice" in done.stderr


def make_scenario(folder, scenario: dict) -> pathlib.Path:
    path = folder / "scenario.json"
    path.write_text(json.dumps(scenario | {"platform": "sim-coachbot"}) + "\n")
    return path


def test_a_worker_that_is_killed_is_replaced(tmp_path):
    (tmp_path / "s.toml").write_text(SMALL.format(runs=2))
    process = subprocess.Popen([SUITE, "sweep", "s.toml", "--jobs", "2"], cwd=tmp_path,
                               env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children")
    wait_for(lambda: finished(tmp_path) >= 1, timeout=100, what="finished runs")
    os.kill(int(children.read_text().split()[0]), signal.SIGKILL)
    _, errors = process.communicate(timeout=250)
    assert process.returncode == 0 and finished(tmp_path) == 2 * CELLS, errors


def test_the_report_needs_nothing_but_itself(tmp_path):
    pytest.importorskip("matplotlib")
    (tmp_path / "s.toml").write_text(
        "program = 'hop_count'\nruns = 3\nreport = ['converged_s', 'success']\n"
        "[vary]\nrobots = [9, 49]\nradio.loss = [0.0, 0.4]\n")
    done = suite(tmp_path, "sweep", "s.toml", "--pictures", "pictures")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "sweep-s/report.html").read_text()
    assert text.count("<svg") == 2 and "--repeat 3" in text and "robots: 9 &rarr; 49" in text
    assert not re.search(r"(src|href)=\"(https?:)?//|url\(http|@import", text)
    assert sorted(p.name for p in (tmp_path / "pictures").iterdir()) == [
        "converged_s.svg", "success.svg"]


def test_a_sweep_goes_on_until_its_rule_is_content(tmp_path):
    """One figure is the same in all runs, the other never: as few and as many runs as there may
    be. Cells without what the report asks for are no reason to fail."""
    for metric, runs in (("wrong_hops", 2), ("converged_s", 7)):
        (tmp_path / f"{metric}.toml").write_text(
            f"program = 'hop_count'\nrobots = 4\nruns = 2\nreport = ['{metric}', 'nonsense']\n"
            f"[stop]\nmetric = '{metric}'\nbelow = 1e-9\nat_most = 7\nstep = 3\n"
            "[vary]\nradio.loss = [0.0, 0.05]\n")
        done = suite(tmp_path, "sweep", f"{metric}.toml")
        assert done.returncode == 0, done.stderr
        assert (tmp_path / f"sweep-{metric}/table.csv").read_text().count("\n") == 1 + 2 * runs


def test_tables_and_report_are_made_of_what_is_there(tmp_path):
    (tmp_path / "s.toml").write_text(FOUR.replace("robots = 4\n", "") + "runs = 3\n[vary]\n"
                                     "robots = [4, 9]\nradio.loss = [0.0, 0.2]\n")
    assert suite(tmp_path, "sweep", "s.toml").returncode == 0
    shutil.rmtree(tmp_path / "sweep-s/runs/00003")
    done = suite(tmp_path, "sweep", "s.toml", "--merge")
    assert done.returncode == 0 and "of 9 runs" in done.stdout, done.stderr
    text = (tmp_path / "sweep-s/report.html").read_text()
    assert "1 of 2 combinations" in text or importlib.util.find_spec("matplotlib") is None


def test_progress_says_how_far_and_how_long():
    class Out:
        lines = []

        def isatty(self):
            return False

        def write(self, text):
            self.lines.append(text)

        def flush(self):
            pass
    cells = [plans.Cell(i, {}, {}, {"robots": [0] * n, "seconds": 10, "platform": "sim-kilobot"},
                        {}) for i, n in enumerate((10, 90))]
    plan = plans.Plan({}, cells, 1, None, [])
    queue = work.Queue(plan, {0: {}, 1: {}}, cells)
    time_s = iter((0.0, 0.0, 20.0))
    progress = work.Progress(queue, Out(), lambda: next(time_s))
    queue.finished((0, 0), {})
    progress.count((0, 0))
    assert progress.text() == "1/2 runs, 3 min left"  # nine times as many robots: 180 s
    assert [work.duration(s) for s in (3.2, 200, 7500)] == ["4 s", "4 min", "2 h 5 min"]
