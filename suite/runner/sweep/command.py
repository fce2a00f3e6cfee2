"""swarmtalk-suite sweep, as a user calls it."""
import json
import os
import pathlib
import shlex
import subprocess
import sys

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


def jobs_of(arguments) -> int:
    if arguments.jobs is not None and arguments.jobs < 1:
        raise SweepError(f"--jobs is {arguments.jobs}: must be 1 or more")
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
    return 0


def prepare(store, jobs: int):
    """Simulators of all cells."""
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


def merge(arguments, plan, store, results: dict):
    """Table and report."""
    repeat = repeat_command(arguments, store.folder)
    path, report = store.folder / "table.csv", store.folder / "report.html"
    content = table.runs_csv(plan, results).encode()
    is_new = arguments.merge or arguments.pictures or not report.exists() or \
        not path.exists() or path.read_bytes() != content
    if is_new:
        stores.write_whole(path, content)
        stores.write_whole(store.folder / "cells.csv",
                           table.cells_csv(plan, results, repeat).encode())
        try:
            page.write(plan, results, report, f"Sweep {pathlib.Path(arguments.file).stem}",
                       repeat, arguments.pictures)
        except ImportError:
            say("no report: figures need matplotlib: apt-get install python3-matplotlib; then run "
                "this with --merge")
    print(f"{store.folder}: table.csv, cells.csv, report.html of "
          f"{sum(len(table.counted(plan, results, c)) for c in plan.cells)} runs")


def repeat(arguments, plan, store) -> int:
    """Runs a cell's finished runs again. @return 1 if one gives something else"""
    if not 0 <= arguments.repeat < len(plan.cells):
        raise SweepError(f"no cell {arguments.repeat}; they are 0 to {len(plan.cells) - 1}")
    cell = plan.cells[arguments.repeat]
    if cell.is_real_time:
        raise SweepError(f"cell {cell.number} runs in real time, no two runs alike: it is never "
                         "run twice")
    prepare(store, jobs_of(arguments))
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


def run(arguments) -> int:
    """Raises SweepError; KeyboardInterrupt after Ctrl-C."""
    plan = plans.read(arguments.file)
    if arguments.check:
        return check(plan)
    file = pathlib.Path(arguments.file)
    store = stores.Store(pathlib.Path(arguments.folder or f"sweep-{file.stem}"), plan)
    store.open(file)
    if arguments.repeat is not None:
        return repeat(arguments, plan, store)
    if arguments.share:
        return slurm.run_share(store, arguments.share)
    store.lock()
    prepare(store, jobs_of(arguments))
    results = store.scan()
    tell_what_is_there(plan, store, results)
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


def tell_what_is_there(plan, store, results: dict):
    done = sum(map(len, results.values()))
    if done:
        say(f"{done} finished runs are there")
    if store.damaged:
        say(f"{store.damaged} files in {store.runs} hold no result: these runs are done again, "
            "unless they were in real time")


def run_queue(store, queue, jobs: int) -> str | None:
    """@return the error of a run that cannot be done"""
    if not queue.ready:
        return None
    progress = work.Progress(queue)
    progress.show()
    try:
        return work.run_all(store, queue, jobs, progress)
    except KeyboardInterrupt:
        done = sum(map(len, store.scan().values()))
        say(f"stopped; {done} finished runs are kept, the same command goes on with the rest")
        raise
