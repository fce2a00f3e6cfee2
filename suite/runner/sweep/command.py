"""swarmtalk-suite sweep, as a user calls it."""
import dataclasses
import hashlib
import json
import os
import pathlib
import shlex
import subprocess
import sys

import platforms
from sweep import SweepError, page, plan as plans, profiles, slurm, store as stores, table, work


def add_arguments(commands):
    """The command line's part of swarmtalk-suite."""
    sweep = commands.add_parser(
        "sweep", help="run every combination that a file asks for, over all cores")
    sweep.add_argument("file", help="TOML file (docs/sweeps.md)")
    sweep.add_argument("--folder", help="where it works and what it goes on with (sweep-FILE)")
    sweep.add_argument("--jobs", type=int, help="runs at a time (one for each core)")
    what = sweep.add_mutually_exclusive_group()
    what.add_argument("--check", action="store_true", help="say what would be run, and run nothing")
    what.add_argument("--merge", action="store_true", help="table and report of what is there")
    what.add_argument("--repeat", type=int, metavar="CELL",
                      help="run a cell again and compare with what it gave")
    what.add_argument("--slurm", action="store_true", help="run as job arrays of Slurm")
    what.add_argument("--share", help="a job's part of a sweep on Slurm; for --slurm's own use")
    sweep.add_argument("--seed", type=int, help="with --repeat: only the run with this seed")
    sweep.add_argument("--pictures", type=pathlib.Path, metavar="FOLDER",
                       help="the report's figures as SVG files, too")
    sweep.add_argument("--sbatch", default="", metavar="OPTIONS",
                       help="with --slurm: more options for sbatch, as one word")


def say(text: str):
    print(f"swarmtalk-suite: {text}", file=sys.stderr, flush=True)


def check_options(arguments):
    """Nothing that is given is ignored. Raises SweepError."""
    if arguments.jobs is not None and arguments.jobs < 1:
        raise SweepError(f"--jobs is {arguments.jobs}: must be 1 or more")
    if arguments.seed is not None and arguments.repeat is None:
        raise SweepError("--seed is for --repeat CELL; where a sweep's seeds begin, its file says")
    if arguments.sbatch and not arguments.slurm:
        raise SweepError("--sbatch is for --slurm: give both, or leave it out")


def jobs_of(arguments) -> int:
    return arguments.jobs or len(os.sched_getaffinity(0))


def repeat_command(arguments, folder: pathlib.Path):
    """The command that repeats a cell."""
    words = [sys.argv[0], "sweep", arguments.file, "--folder", str(folder), "--repeat"]
    return lambda cell: shlex.join([*words, str(cell.number)])


def check(plan) -> int:
    """What a file asks for."""
    for axis, labels in plan.axes.items():
        print(f"{axis}: {', '.join(labels)}")
    most = f" to {plan.stop.at_most}" if plan.stop else ""
    real = sum(cell.is_real_time for cell in plan.cells)
    real = f", {real} of them in real time" if real else ""
    built = len({profiles.header_text(c.profile, c.scenario["program"])
                 for c in plan.cells if c.profile})
    print(f"{len(plan.cells)} cells{real}, {plan.runs}{most} runs of each, "
          f"{built} simulators to compile")
    for error in missing_here(plan.cells):
        print(f"not on this machine: {error}")
    return 0


def missing_here(cells: list) -> list[str]:
    """What cells need beside the simulators and this machine does not have."""
    found = {}
    for cell in cells:
        key = cell.scenario["platform"], cell.scenario["program"]
        if key in found:
            continue
        try:
            found[key] = platforms.check_is_there(cell.scenario)
        except platforms.PlatformError as error:
            name = f" ({cell.name()})" if cell.labels else ""
            found[key] = f"cell {cell.number}{name}: {error}"
    return [error for error in found.values() if error]


def prepare(store, jobs: int, cells: list):
    """Simulators of all cells, and what those need that are to be run. Raises SweepError."""
    for error in missing_here(cells):
        raise SweepError(f"{error}; nothing has been run, finished runs are kept")
    store.simulators_ = store.simulators()
    simulated = sum(c.scenario["platform"].startswith("sim-") for c in store.plan.cells)
    if len(store.simulators_) < simulated:
        found = profiles.make_all(store.plan.cells, store.folder / "programs", jobs, say)
        store.keep_simulators(found)
        store.simulators_ = found
    if any(cell.scenario["program"] == "news" and cell.profile for cell in store.plan.cells):
        check_messages(store)


def check_messages(store):
    """What a profile cannot carry is found before the first run. Raises SweepError."""
    told = {}
    for cell in store.plan.cells:
        if cell.scenario["program"] != "news" or not cell.profile:
            continue
        path = store.simulator(cell)
        if path not in told:
            told[path] = json.loads(subprocess.run([path, "--profile"], capture_output=True,
                                                   text=True, check=True).stdout)
        message = cell.scenario.get("message", {})
        for key, usual, most in (("ttl", 15, "ttl_max"), ("bytes", 5, "message_bytes")):
            if message.get(key, usual) > told[path][most]:
                raise SweepError(f"cell {cell.number} ({cell.name()}): message.{key} is "
                                 f"{message.get(key, usual)}, and its profile has room for at "
                                 f"most {told[path][most]}")


def made_of(plan, content: bytes, repeat) -> str:
    """A mark of all that a report tells: another one is made when it would say something else."""
    stop = dataclasses.astuple(plan.stop) if plan.stop else None
    text = json.dumps([plan.report, list(plan.axes), stop, repeat(plan.cells[0])]).encode()
    return hashlib.sha256(content + text).hexdigest()[:16]


def merge(arguments, plan, store, results: dict):
    """Table and report."""
    repeat = repeat_command(arguments, store.folder)
    path, report = store.folder / "table.csv", store.folder / "report.html"
    content = table.runs_csv(plan, results).encode()
    mark = made_of(plan, content, repeat)
    is_new = arguments.merge or arguments.pictures or not path.exists() or \
        path.read_bytes() != content or page.mark_of(report) != mark
    made = "table.csv, cells.csv, report.html"
    if is_new:
        stores.write_whole(path, content)
        stores.write_whole(store.folder / "cells.csv",
                           table.cells_csv(plan, results, repeat).encode())
        try:
            page.write(plan, results, report, f"Sweep {pathlib.Path(arguments.file).stem}",
                       repeat, arguments.pictures, mark)
        except ImportError:
            made = "table.csv, cells.csv"
            say("no report: figures need matplotlib: apt-get install python3-matplotlib; then run "
                "this with --merge")
    names = table.metric_names(plan, results)
    for name in [*plan.report, *([plan.stop.metric] if plan.stop else [])]:
        if names and name not in names:
            say(f"no run has the figure '{name}'; there is: " + " ".join(names))
    print(f"{store.folder}: {made} of "
          f"{sum(len(table.counted(plan, results, c)) for c in plan.cells)} runs", flush=True)


def repeat(arguments, plan, store) -> int:
    """Runs a cell's finished runs again. @return 1 if one gives something else"""
    cell = plan.cells[arguments.repeat]
    prepare(store, jobs_of(arguments), [cell])
    results = store.scan()
    runs = [run for run, _ in table.counted(plan, results, cell)] or list(range(plan.runs))
    if arguments.seed is not None:
        runs = [arguments.seed - cell.seed(0)]
        if not 0 <= runs[0] < plans.SEEDS_OF_A_CELL:
            raise SweepError(f"--seed is {arguments.seed}: this cell's begin at {cell.seed(0)}")
    differ = 0
    for run in runs:
        result = work.run_once(cell, run, store.folder, store.simulator(cell))
        if result is None:
            return 130
        print(json.dumps(result), flush=True)
        before = results[cell.number].get(run)
        if before is not None and json.loads(json.dumps(result)) != before:
            differ += 1
            say(f"seed {cell.seed(run)} gave something else before: {json.dumps(before)}")
    return 1 if differ else 0


def check_repeat(arguments, plan):
    """Raises SweepError."""
    if not 0 <= arguments.repeat < len(plan.cells):
        raise SweepError(f"no cell {arguments.repeat}; they are 0 to {len(plan.cells) - 1}")
    if plan.cells[arguments.repeat].is_real_time:
        raise SweepError(f"cell {arguments.repeat} runs in real time, no two runs alike: it is "
                         "never run twice")


def run(arguments) -> int:
    """Raises SweepError; KeyboardInterrupt after Ctrl-C."""
    check_options(arguments)
    plan = plans.read(arguments.file)
    if arguments.check:
        return check(plan)
    if arguments.repeat is not None:
        check_repeat(arguments, plan)
    file = pathlib.Path(arguments.file)
    store = stores.Store(pathlib.Path(arguments.folder or f"sweep-{file.stem}"), plan)
    is_new = store.open(file)
    if arguments.merge and is_new:
        raise SweepError(f"no sweep has begun in {store.folder}: there is nothing to merge")
    if arguments.repeat is not None:
        if is_new:
            store.lock()
            store.mark(file)
        return repeat(arguments, plan, store)
    if arguments.share:
        return slurm.run_share(store, arguments.share)
    store.lock()
    store.mark(file)
    results = store.scan()
    tell_what_is_there(plan, store, results)
    if not arguments.merge:
        here = [c for c in plan.cells if not (arguments.slurm and c.is_real_time)]
        ready = {number for number, _ in work.Queue(plan, results, here).ready}
        if ready:
            try:
                prepare(store, jobs_of(arguments), [plan.cells[n] for n in sorted(ready)])
            except platforms.Interrupted:
                say_stopped(results)
                raise
    if arguments.slurm:
        results = slurm.run_all(store, arguments.sbatch, say)
    elif not arguments.merge:
        for cells, jobs in ((False, jobs_of(arguments)), (True, 1)):
            queue = work.Queue(plan, results, [c for c in plan.cells if c.is_real_time == cells])
            error = run_queue(store, queue, jobs)
            if error:
                raise SweepError(error)
    merge(arguments, plan, store, results)
    return 0


def count(results: dict) -> tuple[int, int]:
    """Finished runs, and those in real time that were cut off."""
    found = [result for of_cell in results.values() for result in of_cell.values()]
    return sum(r is not None for r in found), sum(r is None for r in found)


def told(results: dict) -> str:
    done, cut = count(results)
    return f"{done} finished runs" + (
        f" (and {cut} in real time that were cut off, which are not done again)" if cut else "")


def tell_what_is_there(plan, store, results: dict):
    if any(results.values()):
        say(f"{told(results)} are there")
    if store.damaged:
        say(f"{store.damaged} files in {store.runs} hold no result: these runs are done again, "
            "unless they were in real time")


def say_stopped(results: dict):
    say(f"stopped; {told(results)} are kept, the same command goes on with the rest")


def run_queue(store, queue, jobs: int) -> str | None:
    """@return the error of a run that cannot be done"""
    if not queue.ready:
        return None
    progress = work.Progress(queue)
    progress.show()
    try:
        return work.run_all(store, queue, jobs, progress)
    except KeyboardInterrupt:
        say_stopped(store.scan())
        raise
