"""Runs what a sweep misses, over all cores: a process for each, which is told one run at a time.

A worker writes its results itself, so what it has finished outlives everybody. Ctrl-C and SIGTERM
throw away the runs that are under way and keep the finished ones; so does every kill.
"""
import collections
import ctypes
import math
import multiprocessing
import multiprocessing.connection
import os
import pathlib
import resource
import shutil
import signal
import sys
import tempfile
import time

import limits
import metrics
import run_log
import platforms
from sweep import SweepError, plan as plans

TRIES = 2  # of a run whose worker was killed
SCRATCH = "swarmtalk-sweep-"


def cpu_s() -> float:
    """Of this process and of those that it has run."""
    return sum(sum(resource.getrusage(who)[:2])
               for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def run_once(cell, run: int, scratch: pathlib.Path, simulator) -> dict | None:
    """One run's figures; None if it was interrupted."""
    log = scratch / f"{os.getpid()}.jsonl"
    scenario = cell.scenario | {"seed": cell.seed(run)}
    try:
        if not platforms.run(scenario, log, simulator) or platforms.interrupted:
            return None
        return metrics.evaluate(run_log.Log(str(log)))
    finally:
        log.unlink(missing_ok=True)


def do(store, cell, run: int, scratch: pathlib.Path) -> dict | None:
    """One run, and its file. Raises SweepError with the run's name in it."""
    before = cpu_s()
    try:
        if cell.is_real_time:
            store.begin(cell, run)
        result = run_once(cell, run, scratch, store.simulator(cell))
        if result is not None:
            store.put(cell, run, result, round(cpu_s() - before, 4))
            if cell.is_real_time:
                store.forget(cell, run)
        return result
    except (platforms.PlatformError, run_log.LogError, limits.ScenarioError, OSError) as error:
        if cell.is_real_time:
            store.forget(cell, run)  # it never came to be
        name = f" ({cell.name()})" if cell.labels else ""
        raise SweepError(f"cell {cell.number}{name}, seed {cell.seed(run)}: {error}; finished runs "
                         "are kept") from error


def work(store, pipe, scratch: pathlib.Path):
    """A worker: answers each (cell's number, run) with (result, error)."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: ends with its owner
    cells = store.plan.cells
    try:
        while not platforms.interrupted:
            number, run = pipe.recv()
            try:
                result, error = do(store, cells[number], run, scratch), None
            except SweepError as failure:
                result, error = None, str(failure)
            pipe.send((result, error))
    except (EOFError, OSError, KeyboardInterrupt):  # its owner is gone, or all are to end at once
        pass
    os._exit(0)


class Worker:
    """A worker as its owner sees it."""

    def __init__(self, store, scratch: pathlib.Path, others: list):
        context = multiprocessing.get_context("fork")
        self.pipe, theirs = context.Pipe()
        mine = [self.pipe, *(each.pipe for each in others)]

        def main():
            for pipe in mine:  # or one that is killed would not be missed
                pipe.close()
            work(store, theirs, scratch)

        self.process = context.Process(target=main)
        self.process.start()
        theirs.close()
        self.task = None

    def give(self, task: tuple):
        self.task = task
        try:
            self.pipe.send(task)
        except OSError:
            pass  # it was killed: its end of the pipe says so


class Queue:
    """What is to be run, and when it is enough."""

    def __init__(self, plan, results: dict, cells: list):
        self.plan, self.results, self.cells = plan, results, cells
        self.given = set()
        self.ready = collections.deque()
        self.targets = {}
        for cell in cells:
            self.targets[cell.number] = plans.wanted(plan, results[cell.number])
        most = max(self.targets.values(), default=0)
        for run in range(most):  # all cells grow together: a sweep that is cut short is even
            for cell in cells:
                self.add(cell, run)

    def add(self, cell, run: int):
        task = cell.number, run
        if run < self.targets[cell.number] and run not in self.results[cell.number] \
                and task not in self.given:
            self.given.add(task)
            self.ready.append(task)

    def finished(self, task: tuple, result: dict | None):
        number, run = task
        self.results[number][run] = result
        self.given.discard(task)
        if self.plan.stop is None:
            return
        before = self.targets[number]
        self.targets[number] = plans.wanted(self.plan, self.results[number])
        for extra in range(before, self.targets[number]):
            self.add(self.plan.cells[number], extra)

    def back(self, task: tuple):
        self.ready.appendleft(task)


class Progress:
    """How far it is and how long it will take: a line that is rewritten on a terminal, a line now
    and then where there is none."""
    EVERY_S = 30

    def __init__(self, queue: Queue, out=sys.stderr, clock=time.monotonic):
        self.queue, self.out, self.clock = queue, out, clock
        self.is_terminal = out.isatty()
        self.began_s, self.shown_s = clock(), clock()
        self.done_here, self.work_done = 0, 0.0

    def weight(self, task: tuple) -> float:
        """Runs take as long as they have robots and seconds."""
        scenario = self.queue.plan.cells[task[0]].scenario
        return len(scenario["robots"]) * scenario["seconds"]

    def count(self, task: tuple):
        self.done_here += 1
        self.work_done += self.weight(task)

    def text(self) -> str:
        done = sum(len(self.queue.results[c.number]) for c in self.queue.cells)
        left = sum(map(self.weight, self.queue.given))
        total = done + len(self.queue.given)
        line = f"{done}/{total} runs"
        if self.queue.plan.stop and self.queue.given:
            line += " or more"
        if self.work_done > 0 and left > 0:
            seconds = (self.clock() - self.began_s) * left / self.work_done
            line += f", {duration(seconds)} left"
        return line

    def show(self, now: bool = False):
        if self.is_terminal:
            rewrite(self.text(), self.out)
        elif now or self.clock() - self.shown_s >= self.EVERY_S:
            self.shown_s = self.clock()
            print(f"swarmtalk-suite: {self.text()}", file=self.out, flush=True)

    def clear(self):
        if self.is_terminal:
            rewrite("", self.out)
            print("\r", end="", file=self.out, flush=True)


def rewrite(text: str, out):
    """The terminal's last line anew: never longer than it is wide, or it would become two."""
    try:
        width = os.get_terminal_size(out.fileno()).columns or 80
    except (OSError, ValueError):
        width = 80
    width = max(width - 1, 1)
    print(f"\r{text[:width]:<{width}}", end="", file=out, flush=True)


def duration(seconds: float) -> str:
    """For people: 12 s, 3 min, 2 h 5 min."""
    if seconds < 90:
        return f"{math.ceil(seconds)} s"
    minutes = math.ceil(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def remove_stale(identity: str):
    """Logs of runs that were killed, of this sweep on this machine."""
    for path in pathlib.Path(tempfile.gettempdir()).glob(f"{SCRATCH}{identity}-*"):
        pid = path.name[len(SCRATCH) + len(identity) + 1:].partition("-")[0]
        if pid.isdigit() and not pathlib.Path(f"/proc/{pid}").exists():
            shutil.rmtree(path, ignore_errors=True)


def make_scratch(identity: str) -> pathlib.Path:
    """Where logs lie until they are read: on this machine, whatever the sweep's folder is on."""
    remove_stale(identity)
    return pathlib.Path(tempfile.mkdtemp(prefix=f"{SCRATCH}{identity}-{os.getpid()}-"))


def run_all(store, queue: Queue, jobs: int, progress: Progress) -> str | None:
    """Until the queue is empty, Ctrl-C, or the first run that cannot be done.

    @return that run's error. Raises KeyboardInterrupt after Ctrl-C
    """
    scratch = make_scratch(store.plan.identity())
    workers, tries, error = [], collections.Counter(), None
    try:
        while True:
            while queue.ready and not error and not platforms.interrupted:
                idle = next((w for w in workers if w.task is None), None)
                if idle is None and len(workers) < jobs:
                    idle = Worker(store, scratch, workers)
                    workers.append(idle)
                if idle is None:
                    break
                idle.give(queue.ready.popleft())
            busy = {w.pipe: w for w in workers if w.task is not None}
            if not busy or platforms.interrupted:
                break
            for pipe in multiprocessing.connection.wait(list(busy), timeout=1):
                worker = busy[pipe]
                task = worker.task
                try:
                    result, failure = pipe.recv()
                    worker.task = None
                except (EOFError, OSError):
                    result, failure = None, lost(store, worker, workers)
                    tries[task] += 1
                    if store.plan.cells[task[0]].is_real_time:
                        queue.finished(task, None)  # it was cut off, and is not done again
                        continue
                    if not platforms.interrupted and tries[task] < TRIES:
                        queue.back(task)
                        continue
                if result is not None:
                    queue.finished(task, result)
                    progress.count(task)
                elif not platforms.interrupted:
                    error = error or failure
            progress.show()
    finally:
        end(workers)
        shutil.rmtree(scratch, ignore_errors=True)
        progress.clear()
    if platforms.interrupted:
        raise KeyboardInterrupt
    return error


def lost(store, worker: Worker, workers: list) -> str:
    """A worker that was killed is taken off. @return why its run could not be done"""
    worker.process.join()
    workers.remove(worker)
    number, run = worker.task
    cell = store.plan.cells[number]
    return (f"cell {number}, seed {cell.seed(run)}: the process that ran it was killed twice "
            f"(it ended with {worker.process.exitcode}): is there too little memory? Finished runs "
            "are kept")


def end(workers: list):
    """They finish nothing any more."""
    for worker in workers:
        worker.pipe.close()
        if worker.task is not None and worker.process.pid:
            worker.process.terminate()  # its handler ends the run that it is at
    for worker in workers:
        worker.process.join()
