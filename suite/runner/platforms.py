"""Runs one resolved scenario on its platform and leaves the log of it in a file."""
import json
import os
import pathlib
import signal
import subprocess

interrupted = False  # Ctrl-C came; the run that it met has ended early


class PlatformError(Exception):
    """One line for the user: why the platform cannot run, and what to do."""


def program_path(name: str, *folders: str) -> str:
    """A program of ours: in the build of SWARMTALK_BUILD, in this tree's, or installed."""
    here = pathlib.Path(__file__).resolve().parent
    builds = [pathlib.Path(os.environ["SWARMTALK_BUILD"])] if "SWARMTALK_BUILD" in os.environ else [
        here.parent.parent / "build", here.parent.parent / "build-test"]
    candidates = [build / folder / name for build in builds for folder in folders]
    candidates += [pathlib.Path("/usr/local/bin") / name, pathlib.Path("/usr/bin") / name]
    for path in candidates:
        if os.access(path, os.X_OK):
            return str(path)
    raise PlatformError(f"no program {name}; build it, and name the build with SWARMTALK_BUILD=DIR")


def wait(process: subprocess.Popen) -> int:
    """Waits; a Ctrl-C is passed on once, so that the run ends with what it has."""
    global interrupted
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            interrupted = True
            process.send_signal(signal.SIGINT)


def run_simulated(scenario: dict, log: pathlib.Path):
    """swarmtalk-sim: virtual time, same seed, same bytes."""
    path = log.with_suffix(".scenario")
    path.write_text(json.dumps(scenario) + "\n", encoding="utf-8")
    # In a group of its own, or a terminal's Ctrl-C would reach it twice.
    process = subprocess.Popen([program_path("swarmtalk-sim", "suite"), path, log],
                               stderr=subprocess.PIPE, text=True, start_new_session=True)
    code = wait(process)
    path.unlink()
    if code != 0:
        raise PlatformError(process.stderr.read().strip() or f"swarmtalk-sim ended with {code}")


def run(scenario: dict, log: pathlib.Path):
    """Runs it to its end. Raises PlatformError when it cannot."""
    run_simulated(scenario, log)
