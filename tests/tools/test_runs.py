"""What tools/test counts and what it runs once more, on a project of a few shell commands."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

from commands import wait_for  # noqa: E402

PRESETS = """{"version": 6,
"configurePresets": [
{"name": "test", "generator": "Ninja", "binaryDir": "${sourceDir}/build-test"},
{"name": "asan", "generator": "Ninja", "binaryDir": "${sourceDir}/build-asan",
 "cacheVariables": {"SWARMTALK_SANITIZE": "undefined"}}],
"buildPresets": [{"name": "test", "configurePreset": "test"},
{"name": "asan", "configurePreset": "asan"}]}
"""
PASSES, FAILS = "true", "false"
FAILS_ONCE = "mkdir \"$0.d\" 2>/dev/null && exit 1; true"
SKIPS = "echo \"SKIPPED [1] x.py:7: no root\"; exit 77"
ALONE = "integration.clock.tells[a+b.c-*(1)]"  # not a regular expression
PAGE = ROOT / "docs/field-results.md"


class Project:
    """A folder in which tools/test runs tests of these commands, by kind: each writes its name
    down. Its cache is its own. Namespaces take a third of a run: only with `is_private`."""

    def __init__(self, folder, kinds, is_private=False):
        self.folder, self.log = folder, folder / "log"
        for name in ("tools", "docs", "cmake", "tests/fuzz", "tests/support", "tests/small"):
            (folder / name).mkdir(parents=True)
        for name in ("tools/test", "tools/privately", "tools/field_results.py",
                     "tools/test_results.py", "tools/pick_tests.py", "tests/support/kinds.py",
                     "tests/pytest.ini", "cmake/SwarmtalkPytest.cmake"):
            shutil.copy(ROOT / name, folder / name)
        if not is_private:
            (folder / "tools/privately").write_text("#!/bin/sh\nexec \"$@\"\n")
        text = PAGE.read_text()
        (folder / "docs/field-results.md").write_text(text[:text.index("|---|")] + "|---|---|---|"
                                                      "---|---|---|\n")
        for name in ("setup", "check"):
            (folder / "tools" / name).write_text("#!/bin/sh\n")
            (folder / "tools" / name).chmod(0o755)
        (folder / "CMakePresets.json").write_text(PRESETS)
        self.lines = ["cmake_minimum_required(VERSION 3.25)", "project(small LANGUAGES NONE)",
                      "enable_testing()", "add_custom_target(sanitized)",
                      "include(cmake/SwarmtalkPytest.cmake)",
                      "cmake_language(DEFER CALL swarmtalk_write_test_lists)"]
        self.number = 0
        for kind, tests in kinds.items():
            for name, command in tests.items():
                self.add(kind, name, command)

    def add(self, kind, name, command):
        script = self.folder / f"{self.number}.sh"
        self.number += 1
        script.write_text(f"echo '{name}' >>{self.log}\n{command}\n")
        self.lines += [f"add_test(NAME [=[{name}]=] COMMAND sh {script})",
                       f"set_tests_properties([=[{name}]=] PROPERTIES SKIP_RETURN_CODE 77 "
                       f"LABELS \"{kind}\")"]
        (self.folder / "CMakeLists.txt").write_text("\n".join(self.lines) + "\n")

    def add_python(self, kind, **files):
        """Files of pytest's, in a folder of this kind: log(NAME) writes down that a test ran."""
        for name, text in files.items():
            (self.folder / f"tests/small/test_{name}.py").write_text(
                "import os\nimport pytest\n\ndef log(name):\n"
                f"    print(name, file=open({str(self.log)!r}, 'a'))\n\n" + textwrap.dedent(text))
        (self.folder / "tests/small/CMakeLists.txt").write_text(f"swarmtalk_pytest(small {kind})\n")
        self.lines.append("add_subdirectory(tests/small)")
        (self.folder / "CMakeLists.txt").write_text("\n".join(self.lines) + "\n")

    def add_cpp(self, **programs):
        """Programs of GoogleTest's, each of files of a suite of this name; several are compiled as
        one."""
        shutil.copy(ROOT / "cmake/SwarmtalkBuild.cmake", self.folder / "cmake")
        self.lines[1:2] = ["project(small LANGUAGES CXX)", "set(SWARMTALK_JOIN_SOURCES ON)",
                           "find_package(GTest REQUIRED)", "include(GoogleTest)",
                           "include(cmake/SwarmtalkBuild.cmake)"]
        small = self.folder / "tests/small"
        for program, suites in programs.items():
            for suite in suites:
                (small / f"{suite}.cpp").write_text(
                    f"#include <gtest/gtest.h>\nTEST({suite}, Holds) {{}}\n"
                    f"TEST({suite}, Fails) {{ FAIL(); }}\n")
            with (small / "CMakeLists.txt").open("a") as file:
                file.write(f"swarmtalk_test({program} SOURCES {'.cpp '.join(suites)}.cpp)\n")
        self.lines.append("add_subdirectory(tests/small)")
        (self.folder / "CMakeLists.txt").write_text("\n".join(self.lines) + "\n")

    def run(self, *words):
        """Exit status, what was run in this order, the lines before the sum, and the sum."""
        environment = {name: value for name, value in os.environ.items()
                       if not name.startswith(("CTEST_", "SWARMTALK_"))}
        self.log.write_text("")
        done = subprocess.run(
            [self.folder / "tools/test", *words], capture_output=True, text=True, timeout=200,
            stdin=subprocess.DEVNULL,
            env=environment | {"XDG_CACHE_HOME": str(self.folder / "cache")})
        lines = done.stdout.splitlines()
        sums = re.fullmatch(r"tools/test: (\d+) passed, (\d+) failed, (\d+) skipped in .*",
                            lines[-1])
        assert sums, done.stdout + done.stderr
        return (done.returncode, self.log.read_text().splitlines(), lines[:-1],
                tuple(map(int, sums.groups())))


@pytest.fixture
def project(tmp_path):
    return lambda is_private=False, **kinds: Project(tmp_path, kinds, is_private)


def test_each_test_runs_once_and_those_of_kind_clock_come_last_and_times_are_told(project):
    status, ran, lines, counts = project(
        logic={"Hub.Sends": PASSES, "suite.runner.y": PASSES},
        clock={ALONE: PASSES, "Loop.Turns": PASSES, "python.documents.x": SKIPS},
        field={"wifi.networks": FAILS}).run()
    assert status == 0 and counts == (4, 0, 1)
    assert lines[-2] == "tools/test: skipped 1, such as python.documents.x: no root"
    assert re.fullmatch(r"tools/test: took: packages \d+ s; checks \d+ s; build \d+ s \(.*\); "
                        r"tests of kind logic \d+ s; tests of kind clock, one at a time \d+ s",
                        lines[-1])
    assert sorted(ran[:2]) == ["Hub.Sends", "suite.runner.y"]
    assert sorted(ran[2:]) == ["Loop.Turns", ALONE, "python.documents.x"]


def test_what_fails_once_in_real_time_is_named_and_is_not_red(project):
    status, ran, lines, counts = project(
        logic={"Hub.Sends": PASSES},
        clock={ALONE: FAILS_ONCE, "integration.clock.tells": PASSES}).run()
    assert status == 0 and counts == (3, 0, 0)
    assert ran.count(ALONE) == 2 and ran[-1] == ALONE and len(ran) == 4
    assert lines[-1] == f"tools/test: passed at the second try: {ALONE}"


def test_a_skip_without_an_excuse_is_red_where_a_whole_kind_runs(project):
    made = project(logic={"Hub.Sends": SKIPS.replace("no root", "no avr-g++"),
                          "Hub.Takes": SKIPS.replace("no root", "no avr-g++")},
                   clock={ALONE: PASSES})
    reason = "2, such as Hub.Sends: no avr-g++"
    status, _, lines, counts = made.run()
    assert status == 1 and counts == (1, 1, 2)
    assert lines[-1] == f"tools/test: failed: skipped {reason}"
    status, _, lines, counts = made.run("-R", "Hub")
    assert status == 0 and counts == (0, 0, 2)
    assert lines[-2] == f"tools/test: skipped {reason}"


def test_what_fails_twice_is_red(project):
    status, ran, lines, counts = project(
        logic={"Hub.Sends": PASSES}, clock={ALONE: FAILS, "view.page.z": FAILS_ONCE}).run()
    assert status == 1 and counts == (2, 1, 0) and ran.count(ALONE) == 2
    again = re.fullmatch(r"  again: tools/test -R '(.*)'", lines[-2])[1]
    assert lines[-3:] == [f"tools/test: failed: {ALONE}", lines[-2],
                          "tools/test: passed at the second try: view.page.z"]
    assert re.fullmatch(again, ALONE) and not re.match(again, ALONE + "x")


def test_no_other_test_gets_a_second_try(project):
    status, ran, lines, counts = project(
        logic={"Hub.Sends": FAILS_ONCE}, clock={ALONE: PASSES}).run()
    assert status == 1 and counts == (1, 1, 0) and ran == ["Hub.Sends", ALONE]
    assert lines[-2:] == ["tools/test: failed: Hub.Sends",
                          "  again: tools/test -R '^(Hub\\.Sends)$'"]


def test_a_product_that_is_broken_is_not_tried_again(project):
    status, ran, _, counts = project(
        logic={"Hub.Sends": PASSES},
        clock={f"hostile.air.t{number}": FAILS for number in range(21)}).run()
    assert status == 1 and counts == (1, 21, 0) and len(ran) == 22


def test_more_than_three_that_pass_at_the_second_try_are_red(project):
    tests = {f"hostile.air.t{number}": FAILS_ONCE for number in range(3)}
    made = project(logic={"Hub.Sends": PASSES}, clock=tests)
    assert made.run()[0] == 0
    for number in range(3, 7):
        made.add("clock", f"hostile.air.t{number}", FAILS_ONCE)
    status, _, _, counts = made.run()
    assert status == 1 and counts == (8, 1, 0)


def test_a_name_that_comes_twice_in_ten_results_is_a_warning(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={ALONE: FAILS_ONCE})
    warning = f"tools/test: warning: at the second try in more than one of ten runs: {ALONE}"
    for again in range(2):
        shutil.rmtree(made.folder / "1.sh.d", ignore_errors=True)
        status, _, lines, _ = made.run()
        assert status == 0 and (warning in lines) == (again == 1)
    kept = made.folder / "cache/swarmtalk/second-tries"
    with kept.open("a") as file:
        file.write("2026-01-01\t\n" * 7)  # of runs in which nothing was tried again
    assert warning in made.run()[2]
    assert warning not in made.run()[2], kept.read_text()
    assert len(kept.read_text().splitlines()) == 10


PYTHON = """
    @pytest.mark.parametrize("text", ["a]", "b[;", "c d"])
    def test_each_has_its_name(text):
        log(text)

    def test_prints_what_a_skipped_one_prints():
        log("prints")
        print("\\n1 skipped in 0.01s")
        assert not os.path.exists("fails")

    @pytest.mark.clock
    def test_needs_time():
        log("time")
        os.rename("fails", "failed")

    @pytest.mark.field
    def test_waits_for_the_field():
        log("field")

    def test_is_skipped():
        pytest.skip("no root")
"""


def test_each_test_of_a_python_file_counts_and_runs_with_its_kind(project):
    made = project(logic={"Hub.Sends": PASSES})
    made.add_python("logic", one=PYTHON)
    (made.folder / "tests/small/fails").write_text("")
    status, ran, lines, counts = made.run()
    assert status == 1 and counts == (5, 1, 1)
    assert sorted(ran) == ["Hub.Sends", "a]", "b[;", "c d", "prints", "time"] and ran[-1] == "time"
    assert lines[-2] == "tools/test: failed: small.one.prints_what_a_skipped_one_prints"
    again = re.fullmatch(r"  again: tools/test -R '(.*)'", lines[-1])[1]
    status, ran, _, counts = made.run("-R", again)
    assert status == 0 and counts == (1, 0, 0) and ran == ["prints"]
    status, ran, _, counts = made.run("--field", "waits_for")
    assert status == 0 and counts == (1, 0, 0) and ran == ["field"]


def test_of_a_python_file_what_failed_runs_once_more_alone(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={ALONE: FAILS_ONCE})
    made.add_python("clock", one="""
        def test_fails_once():
            log("once")
            assert os.path.exists("second") or os.mkdir("second")

        def test_passes():
            log("passes")
        """)
    status, ran, lines, counts = made.run()
    assert status == 0 and counts == (4, 0, 0), lines
    assert ran.count("once") == 2 and ran.count("passes") == 1
    assert lines[-1] == f"tools/test: passed at the second try: {ALONE},small.one.fails_once"


def test_a_python_file_that_does_not_come_to_its_end_is_red_by_the_name_of_the_test(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={"Loop.Turns": PASSES})
    made.add_python("clock", one="""
        def test_passes():
            pass

        def test_ends_it_all():
            log("end")
            os._exit(3)

        def test_never_runs():
            pass
        """)
    status, ran, lines, counts = made.run()
    assert status == 1 and counts == (2, 1, 0) and ran.count("end") == 1
    assert lines[-2] == "tools/test: failed: small.one.ends_it_all"


def test_a_python_file_that_cannot_be_read_is_red(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={"Loop.Turns": PASSES})
    made.add_python("logic", one="import sys\nassert 'SWARMTALK_COLLECTING' in os.environ\n"
                    "def test_passes():\n    pass\n")
    status, _, lines, counts = made.run()
    assert status == 1 and counts == (2, 1, 0)
    assert lines[-2] == "tools/test: failed: small.one"


def test_a_test_in_cpp_is_found_by_its_name_and_built(project):
    made = project(logic={"Hub.Sends": PASSES})
    made.add_cpp(small_test=["One"], joined_test=["Two", "Three"])
    for name in ("One", "Two"):
        status, ran, lines, counts = made.run("-R", f"^{name}[.]H")
        assert (status, ran, counts) == (0, [], (1, 0, 0)), lines
    status, _, lines, counts = made.run("-R", "Three")
    assert status == 1 and counts == (1, 1, 0)
    again = next(line for line in lines if line.startswith("  again: tools/test -R "))
    status, _, _, counts = made.run("-R", again.split("'")[1])
    assert status == 1 and counts == (0, 1, 0)


def test_daemons_of_kind_clock_run_before_others(project, tmp_path):
    daemon = tmp_path / "swarmtalkd"
    daemon.symlink_to("/bin/cat")
    made = project(logic={"Hub.Sends": PASSES})
    made.add_python("clock", one=f"""
        import subprocess

        def test_is_first():
            for name in ("{daemon}", "cat"):
                with subprocess.Popen(["env", name], stdin=subprocess.PIPE) as process:
                    log(str(os.sched_getscheduler(process.pid)))
        """)
    first = subprocess.run(["chrt", "--rr", "1", "true"], stderr=subprocess.DEVNULL).returncode == 0
    status, ran, _, counts = made.run()
    assert status == 0 and counts == (2, 0, 0)
    assert ran[1:] == [str(os.SCHED_RR if first else os.SCHED_OTHER), str(os.SCHED_OTHER)]


def test_two_at_a_time_in_one_folder_are_refused(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={"Loop.Turns": PASSES})
    (made.folder / "build-test").mkdir()
    other = subprocess.Popen(["sh", "-c", "read x # tools/test"], stdin=subprocess.PIPE)
    try:
        (made.folder / "build-test/tools-test.pid").write_text(f"{other.pid}\n")
        done = subprocess.run([made.folder / "tools/test"], capture_output=True, text=True,
                              timeout=60)
        assert done.returncode == 2 and f"as process {other.pid}" in done.stderr
    finally:
        other.communicate(b"\n")
    assert made.run()[0] == 0


@pytest.mark.skipif(os.geteuid() != 0, reason="namespaces need root")
def test_when_it_is_killed_nothing_is_left(project, tmp_path):
    mark = f"600{os.getpid()}"
    made = project(is_private=True, logic={"Hub.Sends": PASSES}, clock={
        "Loop.Turns": f"mount -t tmpfs {mark} /mnt; ip link add left{mark} type veth; "
                      f"setsid sleep {mark} & echo begun >{tmp_path}/begun; wait"})

    def left():
        shown = [subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
                 for command in (["ps", "-eo", "args"], ["ip", "-o", "link"], ["mount"])]
        return [line for text in shown for line in text.splitlines() if mark in line]

    environment = {name: value for name, value in os.environ.items()
                   if not name.startswith(("CTEST_", "SWARMTALK_"))}
    with subprocess.Popen([made.folder / "tools/test"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL, env=environment) as started:
        try:
            wait_for((tmp_path / "begun").exists, 60, "the test")
            wait_for(left, 60, "its process")
        finally:
            started.kill()
    wait_for(lambda: not left(), 60, "the end of its process")


@pytest.mark.parametrize("words, why", [
    (["--field", ""], "an empty expression finds every test"),
    (["-R", "a("], "'a(' is not a regular expression"),
    (["-R", r"a\d"], "ctest knows neither"),
    (["--field", "a", "b"], "at most one"), (["--no"], "unknown argument '--no'")])
def test_what_cannot_be_meant_is_refused_at_once(words, why):
    done = subprocess.run([ROOT / "tools/test", *words], capture_output=True, text=True, timeout=60)
    assert done.returncode == 2 and done.stdout == ""
    assert why in done.stderr and done.stderr.count("\n") == 1
    done = subprocess.run([ROOT / "tools/test", *words, "--help"], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 0 and done.stdout.startswith("tools/test  ")


def test_a_test_of_no_kind_is_red(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={ALONE: PASSES})
    made.add("long", "Forgotten.Test", PASSES)
    status, ran, lines, counts = made.run()
    assert status == 1 and counts == (2, 1, 0) and "Forgotten.Test" not in ran


def test_sanitizers_get_the_logic_of_cpp_alone(project):
    status, ran, _, counts = project(
        logic={"Hub.Sends": PASSES, "All/Loops.Turn/0": PASSES, "fuzz_corpus.mcap": PASSES,
               "suite.runner.y": FAILS}, clock={"Loop.Turns": FAILS}).run("--sanitize")
    assert status == 0 and counts == (3, 0, 0) and "suite.runner.y" not in ran


def test_tests_in_cpp_are_counted_and_named_with_sanitizers_too(project):
    """Many run in one process there: one that ends it is named."""
    made = project(logic={"fuzz_corpus.mcap": PASSES})
    made.add_cpp(small_test=["One"])
    with (made.folder / "tests/small/One.cpp").open("a") as file:
        file.write("TEST(One, Skips) { GTEST_SKIP() << \"no root\"; }\n"
                   "TEST(One, Dies) { abort(); }\n"
                   "class Each : public testing::TestWithParam<int> {};\n"
                   "TEST_P(Each, Fails) { FAIL(); }\n"
                   "INSTANTIATE_TEST_SUITE_P(All, Each, testing::Values(7));\n"
                   "template <class T> class Of : public testing::Test {};\n"
                   "TYPED_TEST_SUITE(Of, testing::Types<int>);\n"
                   "TYPED_TEST(Of, Fails) { FAIL(); }\n")
    status, _, lines, counts = made.run("--sanitize")
    assert status == 1 and counts == (2, 4, 1)
    failed = {line.removeprefix("tools/test: failed: ") for line in lines if ": failed: " in line}
    assert failed == {"One.Fails", "One.Dies", "All/Each.Fails/7", "Of.Fails<int>"}


def test_what_came_of_field_tests_is_written_down(project):
    made = project(logic={"Hub.Sends": PASSES}, clock={ALONE: PASSES}, field={
        "wifi.networks": PASSES, "faults.soak.soak": SKIPS, "packages.arm.talks[a|b]": FAILS,
        "packages.arm.is_made": PASSES})
    page = made.folder / "docs/field-results.md"
    status, ran, _, counts = made.run("--field")
    assert status == 1 and counts == (2, 1, 1) and len(ran) == 4
    rows = [re.split(r" (?<!\\)\| ", line.strip("| ")) for line in page.read_text().splitlines()
            if line.startswith("| `")]
    assert [row[0] for row in rows] == ["`faults.soak`", "`packages.arm`", "`wifi.networks`"]
    assert [row[3:] for row in rows] == [
        ["0", "0", "1: no root"], ["1", "1: `talks[a\\|b]`", "0"], ["1", "0", "0"]]
    before = page.read_text()
    status, ran, _, counts = made.run("--field", "^wifi")
    assert status == 0 and counts == (1, 0, 0) and page.read_text() == before
    status, ran, lines, counts = made.run("--field", "nothing")
    assert status == 1 and counts == (0, 1, 0)


def test_a_part_of_a_file_leaves_what_had_failed_in_the_rest(project):
    made = project()
    made.add_python("field", one="""
        def test_good():
            pass

        def test_bad():
            assert os.path.exists("mended")
        """)
    page = made.folder / "docs/field-results.md"
    assert made.run("--field")[3] == (1, 1, 0)
    assert "| 1 | 1: `bad` | 0 |" in page.read_text()
    assert made.run("--field", "good")[3] == (1, 0, 0)
    assert "| 1 (1 of 2 ran) | 1: `bad` (before) | 0 |" in page.read_text()
    (made.folder / "tests/small/mended").write_text("")
    assert made.run("--field", "bad")[3] == (1, 0, 0)
    assert "| 1 (1 of 2 ran) | 0 | 0 |" in page.read_text()
    page.write_text("edited")
    status, _, lines, counts = made.run("--field")
    assert status == 1 and counts == (2, 1, 0)


def ci(folder, does, minutes="50"):
    """Exit status and lines of .ci/run with this in the place of tools/test."""
    text = (ROOT / ".ci/run").read_text().replace("part 50", f"part {minutes}")
    for name, text in ((".ci/run", text), ("tools/test", f"#!/bin/sh\n{does}\n")):
        (folder / name).parent.mkdir()
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    done = subprocess.run([folder / ".ci/run"], capture_output=True, text=True, timeout=60,
                          stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout.splitlines()


def test_ci_ends_with_the_sum_of_its_parts(tmp_path):
    status, lines = ci(tmp_path, "echo 'tools/test: 7 passed, 2 failed, 1 skipped in 3 s'; exit 1")
    assert status == 1 and lines[-1] == "7 passed, 2 failed, 1 skipped"


def test_ci_goes_on_with_sanitizers_after_tests_that_passed(tmp_path):
    status, lines = ci(tmp_path, textwrap.dedent("""
        [ $# = 0 ] && echo 'tools/test: 7 passed, 0 failed, 1 skipped in 3 s' && exit
        echo "tools/test: 3 passed, 1 failed, 0 skipped in 2 s"
        [ "$*" != --sanitize ]"""))
    assert status == 1 and lines[-1] == "10 passed, 1 failed, 1 skipped"


def test_ci_names_what_was_red_in_a_part_that_is_cut_off(tmp_path):
    status, lines = ci(tmp_path, textwrap.dedent("""
        echo 'Building preset test ...'
        echo 'Tests of kind logic:'
        echo '  1/12 Test #3: Hub.Sends[a] ......***Failed    0.10 sec'
        echo '  2/12 Test #4: Hub.Hears .........   Passed    0.10 sec'
        exec sleep 50"""), minutes="0.02")
    assert status == 1 and lines[-3:] == [
        ".ci/run: failed: Hub.Sends[a]",
        ".ci/run: failed: tools/test took more than 0.02 minutes, at: Tests of kind logic",
        "0 passed, 2 failed, 0 skipped"]


def test_ci_names_a_part_that_ends_without_a_sum(tmp_path):
    status, lines = ci(tmp_path, "exit 9")
    assert status == 1 and lines[-2:] == [
        ".ci/run: failed: tools/test ended with exit status 9", "0 passed, 1 failed, 0 skipped"]
