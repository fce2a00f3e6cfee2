"""A sweep on a cluster: job arrays of Slurm and a shared folder, nothing else.

What is missing is dealt out to the jobs of an array, each of which works through its share one run
at a time and writes finished runs into the sweep's folder. Whoever called --slurm watches: when the
array has ended and something is missing (a job died, a node disappeared, the stopping rule wants
more), another array is sent. The jobs use the runner and the simulators that lie in the folder.
"""
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import time

import platforms
from sweep import SweepError, store as stores, work

MOST_JOBS = 500        # of an array; Slurm's own limit is 1001 where nobody has changed it
LEAST_RUNS = 4         # of a job: to start one takes as long as a short run
BARREN_ROUNDS = 3      # arrays in a row that have finished nothing
LEAST_POLL_S, MOST_POLL_S = 0.5, 10
SILENT_S = 3600        # without an answer of Slurm
ENDED = "Invalid job id"  # squeue, of a job that has been over for a while

JOB = """#!/bin/sh
# Written by swarmtalk-suite sweep --slurm: one share of a sweep.
exec {python} {suite} sweep {file} --folder {folder} --share {share}
"""


def call(*command) -> subprocess.CompletedProcess:
    try:
        return subprocess.run(list(map(str, command)), capture_output=True, text=True,
                              stdin=subprocess.DEVNULL)
    except FileNotFoundError as error:
        raise SweepError(f"no {command[0]} here: call --slurm where Slurm's commands are (Debian's "
                         "slurm-client), or leave it out") from error


def copy_runner(folder: pathlib.Path) -> pathlib.Path:
    """The runner, to where all nodes see it. @return what a job calls"""
    suite, runner = pathlib.Path(sys.argv[0]).resolve(), pathlib.Path(work.__file__).parents[1]
    target = folder / "slurm"
    target.mkdir(parents=True, exist_ok=True)
    if target.resolve() != suite.parent:
        shutil.copy2(suite, target / "swarmtalk-suite")
        shutil.copytree(runner, target / "runner", dirs_exist_ok=True,
                        ignore=shutil.ignore_patterns("__pycache__"))
    return target / "swarmtalk-suite"


def deal(tasks: list, count: int) -> list[list]:
    """Shares as alike as can be: neighbours in the list go to different jobs."""
    return [tasks[share::count] for share in range(count)]


class Array:
    """Job arrays of one sweep, one after the other."""

    def __init__(self, store, options: str):
        self.store, self.options = store, shlex.split(options)
        self.name = f"swarmtalk-{store.plan.identity()}"
        self.folder = store.folder.resolve() / "slurm"

    def submit(self, tasks: list, number: int) -> str:
        """@return the job's id"""
        suite = copy_runner(self.store.folder.resolve())
        shares = deal(tasks, min(-(-len(tasks) // LEAST_RUNS), MOST_JOBS))
        share = self.folder / f"round-{number}.json"
        stores.write_whole(share, json.dumps(shares).encode())
        script = self.folder / "job.sh"
        words = {"python": sys.executable, "suite": suite, "folder": self.folder.parent,
                 "file": self.folder.parent / "sweep.toml", "share": share}
        stores.write_whole(script, JOB.format(
            **{key: shlex.quote(str(word)) for key, word in words.items()}).encode())
        done = call("sbatch", "--parsable", f"--job-name={self.name}", "--requeue", "--ntasks=1",
                    "--cpus-per-task=1", f"--array=0-{len(shares) - 1}",
                    f"--output={self.folder}/%A_%a.out", f"--chdir={self.folder}", *self.options,
                    script)
        if done.returncode != 0:
            raise SweepError(f"sbatch: {last_line(done.stderr) or 'it refused the jobs'}; finished "
                             "runs are kept")
        job = done.stdout.strip().split(";")[0]
        stores.write_whole(self.folder / "job", job.encode())
        return job

    def running(self) -> str | None:
        """The job of an earlier call, if it is still under way."""
        path = self.folder / "job"
        if not path.exists():
            return None
        job = path.read_text(encoding="utf-8")
        return job if self.states(job) else None

    def states(self, job: str) -> list[str] | None:
        """Of the array's jobs that have not ended. None: Slurm does not answer."""
        done = call("squeue", "--noheader", "--array", f"--jobs={job}", f"--name={self.name}",
                    "--format=%T")
        if done.returncode != 0:
            return [] if ENDED in done.stderr else None
        return [line for line in done.stdout.split() if line != "COMPLETING"]

    def watch(self, job: str, progress):
        """Until its jobs have ended. Raises KeyboardInterrupt after Ctrl-C."""
        began_s = heard_s = time.monotonic()
        while True:
            states, now_s = self.states(job), time.monotonic()
            if states is not None:
                heard_s = now_s
            elif now_s - heard_s > SILENT_S:
                raise SweepError(f"Slurm has not answered for {SILENT_S // 60} minutes; job {job} "
                                 "may go on: give the same command again when it answers")
            if states == []:
                return
            progress.show(self.finished(), states)
            pause_s = min(max((now_s - began_s) / 20, LEAST_POLL_S), MOST_POLL_S)
            end_s = now_s + pause_s
            while time.monotonic() < end_s and not platforms.interrupted:
                time.sleep(0.1)
            if platforms.interrupted:
                progress.clear()
                raise KeyboardInterrupt

    def finished(self) -> int:
        return sum(1 for _ in self.store.runs.glob("*/[0-9]*.json"))

    def last_words(self, job: str) -> str:
        """What the last of an array's jobs that said anything has said."""
        outputs = sorted(self.folder.glob(f"{job}_*.out"), key=lambda path: path.stat().st_mtime)
        lines = [last_line(path.read_text(errors="replace")) for path in outputs]
        return next((line for line in reversed(lines) if line), "nothing")


def last_line(text: str) -> str:
    return (text.strip().splitlines() or [""])[-1]


class Progress:
    """How many runs are finished and what the jobs do."""

    def __init__(self, total: int):
        self.total, self.shown_s = total, time.monotonic()
        self.is_terminal = sys.stderr.isatty()

    def show(self, finished: int, states: list | None):
        jobs = "Slurm does not answer" if states is None else \
            f"{states.count('RUNNING')} jobs running, " \
            f"{len(states) - states.count('RUNNING')} waiting"
        line = f"{finished}/{self.total} runs, {jobs}"
        if self.is_terminal:
            work.rewrite(line, sys.stderr)
        elif time.monotonic() - self.shown_s >= work.Progress.EVERY_S:
            self.shown_s = time.monotonic()
            print(f"swarmtalk-suite: {line}", file=sys.stderr, flush=True)

    def clear(self):
        if self.is_terminal:
            work.rewrite("", sys.stderr)
            print("\r", end="", file=sys.stderr, flush=True)


def run_all(store, options: str, say) -> dict:
    """All cells but those in real time. @return the results"""
    array = Array(store, options)
    cells = [cell for cell in store.plan.cells if not cell.is_real_time]
    real = len(store.plan.cells) - len(cells)
    if real:
        say(f"{real} cells in real time are left out: a cluster's nodes are shared; run them "
            "without --slurm")
    job, barren, number = array.running(), 0, 0
    while True:
        results = store.scan()
        finished = array.finished()
        queue = work.Queue(store.plan, results, cells)
        if not queue.ready:
            return results
        if job is None:
            while (array.folder / f"round-{number}.json").exists():
                number += 1
            job = array.submit(list(queue.ready), number)
            say(f"job {job}: {len(queue.ready)} runs")
        else:
            say(f"job {job} is still under way")
        progress = Progress(finished + len(queue.ready))
        try:
            array.watch(job, progress)
        except KeyboardInterrupt:
            say(f"job {job} goes on without this command, which watches again when it is given "
                f"again; scancel {job} ends it")
            raise
        progress.clear()
        barren = barren + 1 if array.finished() <= finished else 0
        if barren == BARREN_ROUNDS:
            raise SweepError(f"{barren} job arrays in a row have finished no run; the last said: "
                             f"{array.last_words(job)}")
        job = None


def run_share(store, path: str) -> int:
    """In a job: its share, one run at a time. Those that others have finished are left out."""
    shares = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    mine = shares[int(os.environ.get("SLURM_ARRAY_TASK_ID", "0"))]
    store.simulators_ = store.simulators()
    scratch = work.make_scratch(store.plan.identity())
    failed = 0
    try:
        for number, run in mine:
            cell = store.plan.cells[number]
            if platforms.interrupted:
                return 130
            if store.path(cell, run).exists() and store.read(cell, run) is not None:
                continue
            try:
                work.do(store, cell, run, scratch)
            except SweepError as error:
                failed += 1
                print(f"swarmtalk-suite: {error}", file=sys.stderr, flush=True)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    return 1 if failed else 0
