"""Runs one resolved scenario on its platform and leaves the log of it in a file.

Ctrl-C (and SIGTERM) goes to whatever runs, so that it ends with what it has; where the signal comes
between two programs, `interrupted` says so.
"""
import ctypes
import json
import os
import pathlib
import shutil
import signal
import subprocess

import argos
import emulated
import lab
import limits

REAL_TIME = ("coachbot-lab", "coachbot-radio")  # the seed decides less than the machine does

interrupted = False  # Ctrl-C came; the run that it met has ended early
_running = None      # the program that is told of it


class PlatformError(Exception):
    """One line for the user: why the platform cannot run, and what to do."""


class Interrupted(Exception):
    """Ctrl-C came before a program had begun: there is nothing of it."""


def builds() -> list[pathlib.Path]:
    """Where programs of ours may have been built: SWARMTALK_BUILD, or this tree's folders."""
    if "SWARMTALK_BUILD" in os.environ:
        return [pathlib.Path(os.environ["SWARMTALK_BUILD"]).resolve()]
    root = pathlib.Path(__file__).resolve().parent.parent.parent
    return [root / "build", root / "build-test"]


def program_path(name: str, folder: str) -> pathlib.Path:
    """A program of ours: in the build of SWARMTALK_BUILD, in this tree's, in PATH, or installed."""
    candidates = [build / folder / name for build in builds()]
    candidates += [pathlib.Path(found) for found in [shutil.which(name)] if found]
    candidates += [pathlib.Path(prefix) / place / name for prefix in ("/usr/local", "/usr")
                   for place in ("bin", "libexec/swarmtalk")]
    for path in candidates:
        if os.access(path, os.X_OK):
            return path
    raise PlatformError(f"no program {name} in PATH or in a build: build it in a clone with: cmake "
                        f"--preset release && cmake --build --preset release --target {name}; or "
                        "name a build with SWARMTALK_BUILD=DIR")


def catch_interrupts():
    """From here on Ctrl-C ends a run, not this program. A handler and not an exception, which could
    come while a program is being started and leave it behind, running."""
    def handler(*_):
        global interrupted
        if interrupted:  # the second one does not wait for what the run has left to be evaluated
            raise KeyboardInterrupt
        interrupted = True
        if _running is not None and _running.poll() is None:
            _running.send_signal(signal.SIGINT)
    for number in signal.SIGINT, signal.SIGTERM, signal.SIGHUP:
        if signal.getsignal(number) != signal.SIG_IGN:  # as nohup does: the runs are to go on
            signal.signal(number, handler)


PR_SET_PDEATHSIG = 1  # linux/prctl.h
libc = ctypes.CDLL(None)


def end_with_runner():
    """In a program that is being started: it is interrupted when this one is killed, and heeds that
    also where a shell has this one ignore it, as with `&`."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGINT)


def call(command: list, environment: dict | None = None, last_words=str.strip):
    """Runs a program to its end. Raises PlatformError with its last words if it fails,
    Interrupted if it did not begin.

    @param last_words  what of its standard error tells the user why it failed
    """
    global _running
    if interrupted:
        raise Interrupted
    # In a group of its own, or a terminal's Ctrl-C would reach it twice.
    process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               start_new_session=True, preexec_fn=end_with_runner,
                               env=environment)
    _running = process
    if interrupted:  # while it was being started
        process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    _running = None
    # 130: a lab some of whose programs did not begin says so as a shell does.
    if interrupted and process.returncode in (-signal.SIGINT, 128 + signal.SIGINT):
        raise Interrupted
    if process.returncode != 0:
        name = pathlib.Path(command[0]).name
        raise PlatformError(last_words(errors) or f"{name} ended with {process.returncode}")


def record(log: pathlib.Path) -> pathlib.Path:
    """Makes the recording of a run's log, beside it: LOG.mcap. Raises PlatformError if it cannot.

    @return its path
    """
    path = log.with_suffix(".mcap")
    call([program_path("swarmtalk-suite-recording", "suite"), log, path])
    return path


def run_simulated(scenario: dict, log: pathlib.Path, simulator: pathlib.Path | None):
    """swarmtalk-sim: virtual time, same seed, same bytes."""
    limits.check_sections(scenario)
    limits.check_faults(scenario["faults"], len(scenario["robots"]), scenario["seconds"])
    path = log.with_name(log.name + ".scenario")
    path.write_text(json.dumps(scenario) + "\n", encoding="utf-8")
    try:
        call([simulator or program_path("swarmtalk-sim", "suite"), path, log])
    finally:
        path.unlink(missing_ok=True)


def emulator_and_images() -> tuple[pathlib.Path, pathlib.Path]:
    emulator = program_path("kilobot-emulator", "emulation/kilobot")
    return emulator, emulator.parent.parent.parent / "kilobot"


def run_emulated(scenario: dict, log: pathlib.Path):
    """kilobot-emulator: firmware images in virtual time, same seed, same bytes."""
    emulator, images = emulator_and_images()
    try:
        emulated.run(scenario, log, emulator, images, call)
    except emulated.EmulationError as error:
        raise PlatformError(str(error)) from error


def lab_programs() -> list[pathlib.Path]:
    return [program_path("swarmtalk-lab", "lab"), program_path("swarmtalk-suite-robot", "suite"),
            program_path("swarmtalk-suite-bodies", "suite")]


def run_lab(scenario: dict, log: pathlib.Path):
    """swarmtalk-lab: daemons and programs in real time, no two runs alike."""
    try:
        lab.run(scenario, log, *lab_programs(), call)
    except lab.LabError as error:
        raise PlatformError(str(error)) from error


def argos_build() -> pathlib.Path:
    return next((each for each in builds() if (each / "argos/argos.json").exists()), builds()[0])


def run_argos(scenario: dict, log: pathlib.Path, view: bool):
    """argos3 with our modules: virtual time, same seed, same bytes."""
    try:
        argos.run(scenario, log, argos_build(), call, view)
    except argos.ArgosError as error:
        raise PlatformError(str(error)) from error


def check(scenario: dict):
    """What the scenario's platform would refuse, before anything is run. Raises PlatformError or
    ScenarioError."""
    platform = scenario["platform"]
    try:
        if platform == "kilobot-emulated":
            emulated.settings_of(scenario)
        elif platform in REAL_TIME:
            lab.check(scenario)
        elif platform.startswith("argos-"):
            argos.check(scenario, argos.robot_of(scenario))
        else:
            limits.check_sections(scenario)
            limits.check_faults(scenario["faults"], len(scenario["robots"]), scenario["seconds"])
    except (emulated.EmulationError, lab.LabError, argos.ArgosError) as error:
        raise PlatformError(str(error)) from error


def check_is_there(scenario: dict):
    """Whether this machine has what the scenario's platform runs, beside the simulators. Raises
    PlatformError with what to install or build."""
    platform = scenario["platform"]
    try:
        if platform == "kilobot-emulated":
            emulated.find_image(scenario, emulator_and_images()[1])
        elif platform in REAL_TIME:
            lab_programs()
        elif platform.startswith("argos-"):
            argos.find(scenario, argos_build())
    except (emulated.EmulationError, argos.ArgosError) as error:
        raise PlatformError(str(error)) from error


def run(scenario: dict, log: pathlib.Path, simulator: pathlib.Path | None = None,
        view: bool = False) -> bool:
    """Runs it to its end, or until interrupted. The log has its name only when it is written: two
    that run the same, or a program that is killed, leave no half of one.

    @param simulator  in place of the swarmtalk-sim that program_path finds
    @param view  in the platform's own window; ARGoS has one
    @return whether there is a log of this run. Raises PlatformError when it cannot run.
    """
    if view and not scenario["platform"].startswith("argos-"):
        raise PlatformError(f"--view: {scenario['platform']} has no window of its own; "
                            "argos-kilobot and argos-footbot have, and for others there is --mcap "
                            "with swarmtalk-view")
    part = log.with_name(f".{log.name}.{os.getpid()}")
    try:
        if scenario["platform"] == "kilobot-emulated":
            run_emulated(scenario, part)
        elif scenario["platform"] in REAL_TIME:
            run_lab(scenario, part)
        elif scenario["platform"].startswith("argos-"):
            run_argos(scenario, part, view)
        else:
            run_simulated(scenario, part, simulator)
        if part.exists() and part.stat().st_size > 0:
            part.replace(log)
            return True
    except Interrupted:
        pass
    finally:
        part.unlink(missing_ok=True)
    return False
