"""A sweep's file: what it asks for, and one clear line for what makes no sense."""
import sys

import pytest

from test_runner import ROOT, suite

sys.path.insert(0, str(ROOT / "suite/runner"))
import limits  # noqa: E402
import scenarios  # noqa: E402
from sweep import SweepError, plan as plans, profiles  # noqa: E402

GOOD = "program = 'hop_count'\n"


def read(folder, text: str) -> plans.Plan:
    (folder / "s.toml").write_text(text)
    return plans.read(str(folder / "s.toml"))


def test_every_combination_is_a_cell_with_seeds_of_its_own(tmp_path):
    plan = read(tmp_path, GOOD + """
runs = 3
seed = 5
radio.loss = 0.1
[vary]
robots = { from = 4, to = 16, factor = 2 }
radio.range_mm = { from = 60, to = 80, step = 10 }
place = [{ label = "near", spacing_mm = 40 }, { label = "far", spacing_mm = 50, radio.loss = 0 }]
""")
    assert [len(labels) for labels in plan.axes.values()] == [3, 3, 2]
    assert len(plan.cells) == 18
    last = plan.cells[-1]
    assert last.labels == {"robots": "16", "radio.range_mm": "80", "place": "far"}
    assert last.scenario["radio"] == {"loss": 0, "range_mm": 80}
    assert plan.cells[0].scenario["radio"] == {"loss": 0.1, "range_mm": 60}
    seeds = {cell.seed(run) for cell in plan.cells for run in range(plan.runs)}
    assert len(seeds) == 54 and min(seeds) == 5


def test_more_runs_are_the_same_sweep_and_other_values_are_not(tmp_path):
    text = GOOD + "runs = {}\n[vary]\nrobots = [4, {}]\n"
    first = read(tmp_path, text.format(3, 9)).identity()
    assert read(tmp_path, text.format(8, 9)).identity() == first
    assert read(tmp_path, text.format(3, 16)).identity() != first


NONSENSE = [
    ("hop = 1", "no key 'hop'"), ("[vary]\nrobots = []", "the list is empty"),
    ("[vary]\nradio.rnage_mm = [1]", "no key 'radio.rnage_mm'"),
    ("[vary]\nrobots = ['x']", "robots is 'x'"), ("[vary]\nrobots = [3.5]", "a whole number"),
    ("[vary]\nrobots = 4", "must be a list or a range"),
    ("[vary]\nrobots = [4, 4]", "'4' stands there twice"),
    ("[vary]\nrobots = {from = 9, to = 4, step = 1}", "runs backwards, from 9 to 4"),
    ("[vary]\nrobots = {from = 4, to = 9, step = 0}", "never ends"),
    ("[vary]\nrobots = {from = 4, to = 9}", "a range is"),
    ("[vary]\nrobots = {from = 'a', to = 9, step = 1}", "from is 'a'"),
    ("[vary]\nradio.loss = {from = 0, to = 1, step = 1e-9}", "more than"),
    ("[vary]\nprogram = ['dance']", "no program 'dance'"),
    ("[vary]\nplatform = ['mars']", "no platform 'mars'"),
    ("[vary]\nprofile.mtu_bytes = [3]", "profile.mtu_bytes is 3"),
    ("[vary]\nprofile.base = ['lora']", "profile.base is 'lora'"),
    ("[vary]\na = [{robots = 4}]", "needs a label"),
    ("[vary]\na = [{label = 'x', robots = 4}]\nrobots = [4]", "both set robots"),
    ("vary = 3", "[vary] must be a table"), ("profile = 3", "[profile] must be a table"),
    ("platform = 'argos-footbot'\nprofile.mtu_bytes = 12", "has a profile of its own"),
    ("[vary]\nrobots = [1, 4]", "cell 0 (robots = 1): hop_count has nothing to show"),
    ("runs = 2000000", "runs is 2000000"), ("[vary]\nseconds = [1, -1]", "seconds is -1"),
    ("[vary]\nmessage.ttl = [1]", "hop_count has no [message]"),
    ("report = 'delivery'", "report must be a list"),
    ("[stop]\nmetric = 'delivery'", "[stop] needs"), ("stop = 1", "[stop] needs"),
    ("[stop]\nmetric = 'x'\nbelow = 0\nat_most = 99", "[stop] below is 0"),
    ("runs = 1\n[stop]\nmetric = 'x'\nbelow = 1\nat_most = 99", "from 2"),
    ("[[fault]]\nkind = 'death'\nrobot = 99", "no robot 99"), ("x = ", "Invalid value"),
    ("[vary]\nradio.loss = [0, 0.0]", "'0' and '0.0' are the same"),
    ("[vary]\na = [{label = 'x', robots = 4}, {label = 'y', robots = 4}]",
     "'x' and 'y' are the same"),
    ("[stop]\nmetric = 'deliveri'\nbelow = 1\nat_most = 99", "no metric 'deliveri'; there is: "),
    ("[vary]\nrobots = {from = 4, to = 100000, step = 1}", "5000049994 robots in all"),
    ("seed = -1", "seed is -1"), ("[vary]\nradio = [0.1]", "no key 'radio'"),
    ("[vary]\nradio.loss = {from = 0, to = 0.999, step = 0.001}\nrobots = {from = 4, to = 1003, "
     "step = 1}\nseconds = {from = 1, to = 1000, step = 1}", "these are 1000000000 cells"),
    # What a platform would refuse, hours later, when it is its turn.
    ("radio.air_us = 300\n[vary]\nplatform = ['sim-kilobot', 'argos-footbot']",
     "cell 1 (platform = argos-footbot): argos-footbot: [radio] has no key 'air_us'"),
    ("seed = 4294967296\nplatform = 'argos-kilobot'", "argos-kilobot: seed is 4294967296"),
    ("radio.loss = 0.1\nplatform = 'coachbot-lab'", "coachbot-lab: [radio] has no key 'loss'"),
    ("random_ids = true\nplatform = 'coachbot-radio'", "coachbot-radio numbers its robots"),
    ("robots = 300\nplatform = 'coachbot-lab'", "at most 247 robots"),
    ("radio.air_us = 300\nplatform = 'kilobot-emulated'",
     "kilobot-emulated: [radio] has no key 'air_us'"),
    ("platform = 'kilobot-emulated'\n[[fault]]\nkind = 'death'\nrobot = 1",
     "kilobot-emulated knows no faults"),
]


def test_a_file_without_sense_is_one_clear_line(tmp_path):
    for text, says in NONSENSE:
        with pytest.raises(SweepError) as refused:
            read(tmp_path, GOOD + text + "\n")
            pytest.fail(f"not refused: {text}")
        line = str(refused.value)
        assert says in line and line.startswith(str(tmp_path / "s.toml")), (text, line)
        assert "\n" not in line, (text, line)


def test_a_refused_file_leaves_nothing_behind(tmp_path):
    (tmp_path / "s.toml").write_text(GOOD + "[vary]\nrobots = []\n")
    for file in ("s.toml", "none.toml"):
        done = suite(tmp_path, "sweep", file)
        assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_the_rule_goes_on_until_the_interval_is_small_and_looks_by_steps(tmp_path):
    plan = read(tmp_path, GOOD + "runs = 4\n[stop]\nmetric = 'delivery'\nbelow = 0.5\n"
                "at_most = 10\nstep = 3\n")
    wide = [0.0, 9.0, 0.0, 9.0, 0.0, 9.0, 0.0, 9.0, 0.0, 9.0]
    assert plans.wanted(plan, {}) == 4
    assert plans.wanted(plan, {run: {"delivery": wide[run]} for run in range(4)}) == 7
    assert plans.wanted(plan, {run: {"delivery": wide[run]} for run in range(6)}) == 7
    assert plans.wanted(plan, {run: {"delivery": wide[run]} for run in range(7)}) == 10
    assert plans.wanted(plan, {run: {"delivery": wide[run]} for run in range(10)}) == 10
    narrow = {run: {"delivery": 1 + 0.1 * (run % 2)} for run in range(4)}
    assert plans.wanted(plan, narrow) == 4
    # One of two that have the figure is no interval; a run that was cut off is looked over.
    assert plans.wanted(plan, {0: {"delivery": 1}, 1: {"delivery": None}, 2: {}, 3: None}) == 7


def test_interrupt_ends_the_reading_of_a_large_file(tmp_path, monkeypatch):
    monkeypatch.setattr(plans.platforms, "interrupted", True)
    with pytest.raises(plans.platforms.Interrupted):
        read(tmp_path, GOOD + "[vary]\nrobots = {from = 4, to = 900, step = 1}\n")


def test_check_tells_what_would_be_run_and_runs_nothing(tmp_path):
    (tmp_path / "s.toml").write_text(GOOD + "[vary]\nrobots = [4, 9]\nplatform = ['sim-kilobot', "
                                     "'coachbot-lab']\n")
    done = suite(tmp_path, "sweep", "s.toml", "--check")
    assert "4 cells, 2 of them in real time, 10 runs of each" in done.stdout and not done.returncode
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_a_sweep_knows_all_programs_and_only_numbers_that_profiles_have():
    assert set(profiles.PROGRAMS) == set(scenarios.PROGRAMS)
    text = (ROOT / "core/include/swarmtalk/profile.hpp").read_text()
    for constant, kind, _, _ in profiles.NUMBERS.values():
        assert f"static constexpr {kind} {constant} =" in text, constant


def test_the_shipped_sweeps_are_sound():
    files = sorted((ROOT / "suite/sweeps").glob("*.toml"))
    assert len(files) >= 6
    for file in files:
        assert plans.read(str(file)).cells, file


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le"])
def test_a_file_in_another_encoding_is_refused_with_the_remedy(tmp_path, encoding):
    path = tmp_path / "s.toml"
    path.write_bytes(GOOD.encode(encoding))
    for read_file, error in ((scenarios.read_file, limits.ScenarioError), (plans.read, SweepError)):
        with pytest.raises(error) as refused:
            read_file(str(path))
        assert str(refused.value) == f"{path}: is {encoding[:6].upper()}; save it as UTF-8"


def test_a_file_with_bytes_that_are_not_utf_8_is_refused_with_the_line(tmp_path):
    path = tmp_path / "s.toml"
    path.write_bytes((GOOD + "# Größe\nrobots = 4\n").encode("latin-1"))
    for read_file, error in ((scenarios.read_file, limits.ScenarioError), (plans.read, SweepError)):
        with pytest.raises(error) as refused:
            read_file(str(path))
        assert str(refused.value).startswith(f"{path}:2: ")
    done = suite(tmp_path, "run", "--scenario", "s.toml")
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "s.toml:2: " in done.stderr


def test_a_byte_order_mark_and_line_ends_of_windows_are_taken(tmp_path):
    path = tmp_path / "s.toml"
    text = GOOD + "# Größe\nrobots = 4\n"
    path.write_bytes(text.replace("\n", "\r\n").encode("utf-8-sig"))
    assert scenarios.read_file(str(path)) == {"program": "hop_count", "robots": 4}
    assert plans.read(str(path)).cells
