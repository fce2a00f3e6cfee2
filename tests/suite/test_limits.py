"""Nonsense in a scenario is refused in one line that names it, and nothing is run."""
import json
import subprocess

import pytest

from test_runner import BUILD, suite

NO_RUN = [
    ("robots = 'ten'", "robots is 'ten'"), ("robots = 3.5", "a whole number"),
    ("robots = true", "a whole number"), ("robots = 100000000", "100000"),
    ("seed = 1.5", "seed is 1.5"), ("seed = 2020-01-01", "seed is"),
    ("seconds = 'x'", "seconds is 'x'"), ("runs = 2.5", "runs is 2.5"),
    ("spacing_mm = 0", "spacing_mm is 0"), ("spacing_mm = -5", "spacing_mm is -5"),
    ("random_ids = 1", "true or false"), ("radio = 5", "[radio] must be a table"),
    ("fault = [3]", "[[fault]]"), ("radio.loss = 2", "[radio] loss is 2"),
    ("radio.loss = nan", "[radio] loss is nan"), ("radio.range_mm = -5", "range_mm is -5"),
    ("radio.range_mm = 0", "range_mm is 0"), ("radio.range_mm = inf", "range_mm is inf"),
    ("radio.period_us = -1", "period_us is -1"), ("radio.period_us = 1e6", "a whole number"),
    ("radio.asymmetry = -0.5", "asymmetry is -0.5"),
    ("clock.drift_ppm = 3000000000", "drift_ppm is 3000000000"),
    ("clock.power_on_spread_us = 4294967295", "power_on_spread_us is 4294967295"),
    ("body.wheel_base_mm = 0", "wheel_base_mm is 0"),
]
NO_FAULT = [
    ("kind = 'explode'", "no fault 'explode'"), ("kind = 'death'", "death needs 'robot'"),
    ("kind = 'death'\nrobot = 36", "no robot 36; they are 0 to 35"),
    ("kind = 'death'\nrobot = -1", "robot is -1"),
    ("kind = 'death'\nrobot = 1\nat_s = -5", "at_s is -5"),
    ("kind = 'death'\nrobot = 1\nat_s = 12", "the run ends at 12 s"),
    ("kind = 'death'\nrobot = 1\nradius_mm = 2", "death has no key 'radius_mm'"),
    ("kind = 'clock_step'\nrobot = 1\nticks = 1e12", "ticks is 1000000000000.0"),
    ("kind = 'jam'\nx_mm = 1\ny_mm = 1", "jam needs 'radius_mm'"),
    ("kind = 'partition'\nx_mm = 1\nat_s = 3\nend_s = 2", "end_s must be after at_s"),
]


@pytest.mark.parametrize("text, says", NO_RUN + [("[[fault]]\n" + t, says) for t, says in NO_FAULT])
def test_nonsense_is_refused_in_one_line(tmp_path, text, says):
    (tmp_path / "s.toml").write_text("program = 'hop_count'\n" + text + "\n")
    done = suite(tmp_path, "run", "--scenario", "s.toml")
    assert done.returncode == 1 and says in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1 and done.stdout == ""


@pytest.mark.parametrize("program, robots", [
    ("hop_count", 1), ("hop_count_two_seeds", 2), ("firefly", 1), ("firefly_no_delay", 1)])
def test_a_swarm_too_small_to_show_anything_does_not_succeed(tmp_path, program, robots):
    """Two robots had the second seed in the place of the first, and one count was never judged."""
    done = suite(tmp_path, "run", program, "--robots", robots)
    assert done.returncode == 1 and f"use --robots {robots + 1}" in done.stderr
    assert suite(tmp_path, "run", program, "--robots", robots + 1).stdout


@pytest.mark.parametrize("seed", [2**63, 99999999999999999999999])
def test_a_seed_that_is_no_64_bits_is_refused(tmp_path, seed):
    done = suite(tmp_path, "run", "hop_count", "--seed", seed)
    assert done.returncode == 1 and "seed" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize("key, value", [
    ("seconds", -5), ("seconds", 1e12), ("seed", -1), ("seed", 1.5), ("program", "dance"),
    ("radio", {"period_us": -4}), ("radio", {"loss": "x"}),
    ("faults", [{"kind": "death", "robot": 7}])])
def test_a_log_that_was_changed_by_hand_does_not_run_for_ever(tmp_path, key, value):
    """The simulator itself reads what a replayed log says."""
    scenario = {"program": "hop_count", "platform": "sim-kilobot", "seed": 1, "seconds": 1,
                "robots": [{"x_mm": 0, "y_mm": 0}]}
    (tmp_path / "s.json").write_text(json.dumps(scenario | {key: value}) + "\n")
    done = subprocess.run([BUILD / "suite/swarmtalk-sim", tmp_path / "s.json", "-"], timeout=60,
                          capture_output=True, text=True)
    words = (key if key != "faults" else "fault", *(value if isinstance(value, dict) else ()))
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert all(word in done.stderr for word in words), done.stderr
