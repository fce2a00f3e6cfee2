"""The runner with its simulated platforms, as a user calls it."""
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import statistics
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
SUITE = ROOT / "suite/swarmtalk-suite"

sys.path.insert(0, str(ROOT / "tests/support"))

from commands import wait_for  # noqa: E402

# Compiled once, and not in the tree: that is a fifth of the time of a start.
ENVIRONMENT = os.environ | {"SWARMTALK_BUILD": str(BUILD), "PYTHONDONTWRITEBYTECODE": "",
                            "PYTHONPYCACHEPREFIX": str(BUILD / "pycache")}


def suite(folder, *arguments, timeout=250):
    """Runs swarmtalk-suite in a folder."""
    return subprocess.run([SUITE, *map(str, arguments)], cwd=folder, env=ENVIRONMENT,
                          capture_output=True, text=True, timeout=timeout)


def results(process) -> list[dict]:
    return [json.loads(line) for line in process.stdout.splitlines()]


@pytest.mark.parametrize("program, platform, runs", [
    ("hop_count", "sim-kilobot", 10), ("hop_count", "sim-coachbot", 3),
    ("hop_count_two_seeds", "sim-kilobot", 10), ("firefly", "sim-coachbot", 2),
    ("edge_following", "sim-coachbot", 1)])
def test_runs_succeed(tmp_path, program, platform, runs):
    done = suite(tmp_path, "run", program, "--platform", platform, "--runs", runs)
    assert done.returncode == 0, done.stderr
    assert [r["success"] for r in results(done)] == [True] * runs
    assert f"{runs} of {runs} runs succeeded" in done.stderr


def test_one_run_has_no_interval(tmp_path):
    one = suite(tmp_path, "run", "hop_count", "--robots", 9).stderr
    assert re.search(r"^  converged_s +[\d.]+, one run$", one, re.M) and "+-" not in one, one
    two = suite(tmp_path, "run", "hop_count", "--robots", 9, "--runs", 2).stderr
    assert re.search(r"^  converged_s +[\d.]+ \+- [\d.e-]+$", two, re.M), two


@pytest.mark.parametrize("program, said", [
    ("firefly", "seed 1: not yet after 12 s, which may be too short: firefly on sim-kilobot is "
                "given 600 s: use --seconds 600"),
    ("firefly_no_delay", "seed 1: firefly_no_delay lacks the correction of delays, to be compared "
                         "with firefly: it need not succeed")],
    ids=["short", "to_compare_with"])
def test_a_short_run_and_one_to_compare_with_have_not_failed(tmp_path, program, said):
    done = suite(tmp_path, "run", program, "--robots", 36, "--seconds", 12)
    assert done.returncode == 1
    assert f"swarmtalk-suite: {said}\n" in done.stderr and "run failed" not in done.stderr


def test_programs_are_found_in_path_too(tmp_path):
    programs = {**ENVIRONMENT, "SWARMTALK_BUILD": str(tmp_path),
                "PATH": f"{BUILD / 'suite'}:{os.environ['PATH']}"}
    done = subprocess.run([SUITE, "run", "hop_count", "--robots", "9"], cwd=tmp_path, env=programs,
                          capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr


def test_a_count_is_told_when_the_other_has_left(tmp_path):
    """Two channels share the air: a count that waited for two turns would be 2.1 s old."""
    done = results(suite(tmp_path, "run", "hop_count_two_seeds", "--runs", 3))
    assert all(r["latency_p99_s"] < 0.6 and r["peak_age_s"] < 1.8 for r in done), done


def intervals(runs: list[dict], key: str) -> tuple[float, float]:
    """Ends of the 95 % interval of four or eight runs' mean."""
    values = [r[key] for r in runs]
    half = {4: 3.19, 8: 2.37}[len(values)] * statistics.stdev(values) / len(values) ** 0.5
    return statistics.mean(values) - half, statistics.mean(values) + half


def test_delay_mitigation_synchronises_tighter_and_sooner(tmp_path):
    """Figure 7, with seeds that nothing was tuned on. Coachbots, whose messages wait for a fifth of
    a second, synchronise without it, too, but not so well; Kilobots, with two seconds, never."""
    found = {}
    for platform, runs in (("sim-coachbot", 8), ("sim-kilobot", 4)):
        for program in ("firefly", "firefly_no_delay"):
            done = suite(tmp_path, "run", program, "--platform", platform, "--runs", runs,
                         "--seed", 9001)
            found[program, platform] = results(done)
        spreads = [intervals(found[program, platform], "spread_s")
                   for program in ("firefly", "firefly_no_delay")]
        assert spreads[0][1] < spreads[1][0], (platform, spreads)
        assert all(r["success"] for r in found["firefly", platform])
    assert all(r["synchronised_s"] is None for r in found["firefly_no_delay", "sim-kilobot"])


@pytest.mark.parametrize("robots", [2, 3, 16])
def test_fireflies_of_small_and_thin_swarms_synchronise(tmp_path, robots):
    """Each corrects itself towards the other: together not beyond the middle."""
    (tmp_path / "thin.toml").write_text("program = 'firefly'\nradio.range_mm = 60\n")
    done = suite(tmp_path, "run", "--scenario", "thin.toml", "--robots", robots, "--runs", 5)
    assert done.returncode == 0, done.stderr


def test_a_log_replays_its_run_to_the_byte(tmp_path):
    assert suite(tmp_path, "run", "hop_count", "--robots", 9).returncode == 0
    log = tmp_path / "suite-logs/hop_count-sim-kilobot-9-1.jsonl"
    assert suite(tmp_path, "replay", log).stdout == "same bytes\n"
    log.write_text(log.read_text().replace('"hops_1","value":1', '"hops_1","value":2', 1))
    changed = suite(tmp_path, "replay", log)
    assert changed.returncode == 1 and changed.stdout.startswith("differs")


def test_a_failing_run_prints_the_command_that_repeats_it(tmp_path):
    (tmp_path / "deaf.toml").write_text("program = 'hop_count'\nrobots = 4\nradio.loss = 1.0\n")
    done = suite(tmp_path, "run", "--scenario", "deaf.toml", "--seed", 7)
    assert done.returncode == 1
    command = done.stderr.split("repeat it with: ")[1].splitlines()[0]
    again = subprocess.run(command, shell=True, cwd=tmp_path, env=ENVIRONMENT, capture_output=True,
                           text=True, timeout=100)  # as it is pasted
    assert results(again) == results(done)


@pytest.mark.parametrize("arguments, says", [
    (["run", "dance"], "no program 'dance'"), (["run", "firefly", "--platform", "x"], "platform"),
    (["run", "hop_count", "--robots", "0"], "robots is 0"), (["run"], "name a program"),
    (["run", "edge_following", "--robots", "36"], "--robots 6")])
def test_bad_input_is_one_clear_line(tmp_path, arguments, says):
    done = suite(tmp_path, *arguments)
    assert done.returncode == 1 and says in done.stderr and done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir()), "it leaves nothing behind"


@pytest.mark.parametrize("words,says", [
    ([], "swarmtalk-suite: the following arguments are required: command; see swarmtalk-suite "),
    (["rnu"], "did you mean 'run'? See swarmtalk-suite --help"),
    (["run", "firefly", "--sconds", "3"], "did you mean '--seconds'? See swarmtalk-suite --help"),
    (["run", "--robots", "x"], "invalid int value: 'x'; see swarmtalk-suite run --help")],
    ids=["nothing", "command", "option", "number"])
def test_a_wrong_command_line_is_told_in_one_line(tmp_path, words, says):
    done = suite(tmp_path, *words)
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("arguments", [["-V"], ["run", "--version"], ["sweep", "-V"]])
def test_its_version_is_that_of_the_tree(tmp_path, arguments):
    done = suite(tmp_path, *arguments)
    (version,) = re.findall(r"^project\(swarmtalk VERSION (\S+) ",
                            (ROOT / "CMakeLists.txt").read_text(), re.M)
    assert (done.returncode, done.stdout) == (0, version + "\n"), done.stderr


def test_unknown_keys_of_the_radio_are_named(tmp_path):
    (tmp_path / "s.toml").write_text("program = 'hop_count'\nradio.rnage_mm = 5\n")
    done = suite(tmp_path, "run", "--scenario", "s.toml")
    assert done.returncode == 1 and "no key 'rnage_mm'" in done.stderr


def is_logging(folder):
    """Whether a simulator is in the middle of its run."""
    return any(part.stat().st_size > 100000 for part in folder.glob("suite-logs/.*jsonl*"))


@pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
@pytest.mark.parametrize("lacks, media, lines", [
    ("", ["bridge", "radio"], 0), ("sys_admin", ["udp", "radio-udp"], 1),
    ("net_admin", ["udp", "radio-udp"], 1), ("net_raw", ["udp", "radio-udp"], 1)])
def test_a_lab_of_a_root_without_capabilities_is_one_without_namespaces(lacks, media, lines):
    """As in a container; and it is said once."""
    script = ("import lab\nfor platform in 'coachbot-lab', 'coachbot-radio':\n"
              "    print(lab.medium({'platform': platform, 'radio': {'range_mm': 1}})[1])")
    less = ["setpriv", f"--bounding-set=-{lacks}", "--inh-caps=-all"] if lacks else []
    done = subprocess.run([*less, sys.executable, "-c", script], cwd=ROOT / "suite/runner",
                          env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == media, done.stderr
    assert done.stderr.count("\n") == lines


def test_interrupt_ends_with_what_there_is(tmp_path):
    process = subprocess.Popen(
        [SUITE, "run", "hop_count", "--platform", "sim-coachbot", "--seconds", "50000"],
        cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: is_logging(tmp_path), timeout=60, what="a simulator at work")
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=200)
    assert process.returncode == 130, errors
    assert json.loads(output)["interrupted"]
    # What there is replays as far as it went, and nothing else is left behind.
    assert suite(tmp_path, "replay", json.loads(output)["log"]).stdout == "same bytes\n"
    assert [p.name for p in (tmp_path / "suite-logs").iterdir()] == [
        "hop_count-sim-coachbot-36-1.jsonl"]


def test_a_killed_runner_leaves_no_simulator_running(tmp_path):
    """It would fill the disk with the rest of its log."""
    process = subprocess.Popen([SUITE, "run", "hop_count", "--seconds", "500000"], cwd=tmp_path,
                               env=ENVIRONMENT)
    children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children")
    wait_for(lambda: is_logging(tmp_path), timeout=60, what="a simulator at work")
    simulator, = children.read_text().split()
    process.kill()
    process.wait()
    state = pathlib.Path(f"/proc/{simulator}/stat")
    wait_for(lambda: not state.exists() or " Z " in state.read_text(), timeout=60, what="its end")
    assert not list((tmp_path / "suite-logs").glob("*.jsonl"))


def test_two_at_once_in_one_folder_do_not_meet(tmp_path):
    """They write the same logs: each has to see whole ones only."""
    both = [subprocess.Popen([SUITE, "run", "hop_count", "--runs", "6", "--seconds", "30"],
                             cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True) for _ in range(2)]
    outputs = [each.communicate(timeout=100) for each in both]
    assert [each.returncode for each in both] == [0, 0], outputs
    assert outputs[0][0] == outputs[1][0] and outputs[0][0].count("\n") == 6


@pytest.mark.parametrize("text", ["", "hi\n", "{}\n", "[1]\n", '{"robots": 36}\n'])
def test_what_is_no_log_is_not_replayed(tmp_path, text):
    (tmp_path / "x.jsonl").write_text(text)
    done = suite(tmp_path, "replay", "x.jsonl")
    assert done.returncode == 1 and "not a log of a run" in done.stderr
    assert done.stderr.count("\n") == 1


def test_programs_have_one_source_without_platforms_in_it():
    """No conditional compilation, no macros: each platform compiles the same text."""
    programs = sorted((ROOT / "suite/programs").glob("*.hpp"))
    assert len(programs) >= 4
    for program in programs:
        lines = program.read_text().splitlines()
        directives = {line.split()[0] for line in lines if line.startswith("#")}
        assert directives == {"#pragma", "#include"}, program


OTHER_BUILDS = {"clang++": ("clang++", "-O0"), "clang++ release": ("clang++", "-O2", "-DNDEBUG"),
                "g++ debug": ("g++", "-O0", "-g"), "g++ release": ("g++", "-O3", "-DNDEBUG")}

# Where it is, it compiles a simulator once for all days.
CCACHE = ["ccache"] if shutil.which("ccache") else []


def libraries_of_the_simulator():
    """What swarmtalk-sim is linked with, as built: what puts ghosts on an air of others."""
    commands = subprocess.run(["ninja", "-C", str(BUILD), "-t", "commands", "suite/swarmtalk-sim"],
                              capture_output=True, text=True, check=True, timeout=60).stdout
    words = shlex.split(commands.splitlines()[-1])
    return [BUILD / word for word in words if word.endswith((".a", ".so"))]


@pytest.mark.parametrize("kind", [
    "clang++", *(pytest.param(kind, marks=pytest.mark.field) for kind in list(OTHER_BUILDS)[1:])])
def test_another_compiler_and_level_give_the_same_bytes(tmp_path, kind):
    """g++ as built, against others: clang++ without optimisation, and in the field all."""
    compiler, *options = OTHER_BUILDS[kind]
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    other = tmp_path / "swarmtalk-sim"
    parts = [tmp_path / "main.o", tmp_path / "scenario.o"]
    for part in parts:
        subprocess.run([*CCACHE, compiler, "-std=c++20", *options, "-ffp-contract=off",
                        f"-I{ROOT}", f"-I{ROOT}/core/include", "-c",
                        ROOT / f"suite/sim/{part.stem}.cpp", "-o", part], check=True, timeout=250)
    subprocess.run([compiler, *parts, "-o", other, *libraries_of_the_simulator()], check=True,
                   timeout=250)
    for program, platform, robots in (("hop_count_two_seeds", "sim-kilobot", 36),
                                      ("firefly", "sim-coachbot", 36),
                                      ("edge_following", "sim-kilobot", 6)):
        suite(tmp_path, "run", program, "--platform", platform, "--seconds", 40)
        log = tmp_path / f"suite-logs/{program}-{platform}-{robots}-1.jsonl"
        copy = tmp_path / "copy.jsonl"
        subprocess.run([other, log, copy], check=True, timeout=100)
        assert log.read_bytes() == copy.read_bytes(), program


def test_a_log_that_does_not_fit_is_an_error(tmp_path):
    assert suite(tmp_path, "run", "hop_count", "--robots", 2).returncode == 0
    done = subprocess.run([BUILD / "suite/swarmtalk-sim",
                           tmp_path / "suite-logs/hop_count-sim-kilobot-2-1.jsonl", "/dev/full"],
                          capture_output=True, text=True, timeout=100)
    assert done.returncode == 1 and "is the disk full?" in done.stderr
