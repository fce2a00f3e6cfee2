"""What tools/test counts and what it runs once more, on a project of a few shell commands."""
import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRESETS = """{"version": 6,
"configurePresets": [
{"name": "test", "generator": "Ninja", "binaryDir": "${sourceDir}/build-test"}],
"buildPresets": [{"name": "test", "configurePreset": "test"}]}
"""
PASSES, FAILS = "true", "false"
FAILS_ONCE = "mkdir \"$0.d\" 2>/dev/null && exit 1; true"
SKIPS = "exit 77"
ALONE = "integration.clock.tells[a+b.c-*(1)]"  # in real time by its name; not a regular expression


class Project:
    """A folder in which tools/test runs tests of these commands: each writes its name down."""

    def __init__(self, folder, tests):
        self.folder, self.log = folder, folder / "log"
        (folder / "tools").mkdir()
        shutil.copy(ROOT / "tools/test", folder / "tools/test")
        for name in ("setup", "check"):
            (folder / "tools" / name).write_text("#!/bin/sh\n")
            (folder / "tools" / name).chmod(0o755)
        (folder / "CMakePresets.json").write_text(PRESETS)
        lines = ["cmake_minimum_required(VERSION 3.25)", "project(small LANGUAGES NONE)",
                 "enable_testing()"]
        for number, (name, command) in enumerate(tests.items()):
            script = folder / f"{number}.sh"
            script.write_text(f"echo '{name}' >>{self.log}\n{command}\n")
            lines += [f"add_test(NAME [=[{name}]=] COMMAND sh {script})",
                      f"set_tests_properties([=[{name}]=] PROPERTIES SKIP_RETURN_CODE 77)"]
            if name.endswith("long"):
                lines.append(f"set_tests_properties([=[{name}]=] PROPERTIES LABELS long)")
        (folder / "CMakeLists.txt").write_text("\n".join(lines) + "\n")

    def run(self):
        """Exit status, what was run in this order, the lines before the sum, and the sum."""
        environment = {name: value for name, value in os.environ.items()
                       if not name.startswith(("CTEST_", "SWARMTALK_"))}
        done = subprocess.run([self.folder / "tools/test"], capture_output=True, text=True,
                              timeout=200, stdin=subprocess.DEVNULL, env=environment)
        lines = done.stdout.splitlines()
        sums = re.fullmatch(r"tools/test: (\d+) passed, (\d+) failed, (\d+) skipped in .*",
                            lines[-1])
        assert sums, done.stdout + done.stderr
        return (done.returncode, self.log.read_text().splitlines(), lines[:-1],
                tuple(map(int, sums.groups())))


@pytest.fixture
def project(tmp_path):
    return lambda tests: Project(tmp_path, tests)


def test_each_test_runs_once_and_those_in_real_time_come_last(project):
    status, ran, _, counts = project({
        ALONE: PASSES, "Hub.Sends": PASSES, "python.documents.x": SKIPS, "suite.runner.y": PASSES,
        "Loop.LooksForEventsBeforeItSleepsWhereItWasAskedTo": PASSES, "wifi.long": FAILS}).run()
    assert status == 0 and counts == (4, 0, 1)
    assert sorted(ran[:2]) == ["Hub.Sends", "suite.runner.y"]
    assert sorted(ran[2:]) == ["Loop.LooksForEventsBeforeItSleepsWhereItWasAskedTo", ALONE,
                               "python.documents.x"]


def test_what_fails_once_in_real_time_is_named_and_is_not_red(project):
    status, ran, lines, counts = project(
        {ALONE: FAILS_ONCE, "integration.clock.tells": PASSES, "Hub.Sends": PASSES}).run()
    assert status == 0 and counts == (3, 0, 0)
    assert ran.count(ALONE) == 2 and ran[-1] == ALONE and len(ran) == 4
    assert lines[-1] == f"tools/test: passed at the second try: {ALONE}"


def test_what_fails_twice_is_red(project):
    status, ran, lines, counts = project(
        {ALONE: FAILS, "view.page.z": FAILS_ONCE, "Hub.Sends": PASSES}).run()
    assert status == 1 and counts == (2, 1, 0) and ran.count(ALONE) == 2
    assert lines[-2:] == [f"tools/test: failed: {ALONE}",
                          "tools/test: passed at the second try: view.page.z"]


def test_no_other_test_gets_a_second_try(project):
    status, ran, lines, counts = project({"Hub.Sends": FAILS_ONCE, ALONE: PASSES}).run()
    assert status == 1 and counts == (1, 1, 0) and ran == ["Hub.Sends", ALONE]
    assert lines[-1] == "tools/test: failed: Hub.Sends"


def test_a_product_that_is_broken_is_not_tried_again(project):
    tests = {f"hostile.air.t{number}": FAILS for number in range(21)}
    status, ran, _, counts = project({"Hub.Sends": PASSES, **tests}).run()
    assert status == 1 and counts == (1, 21, 0) and len(ran) == 22
