"""Effects and interactions: right intervals, none where there is nothing, and what a report says.
"""
import importlib.util
import itertools
import random
import re
import sys

import pytest

from test_runner import ROOT, suite

sys.path.insert(0, str(ROOT / "suite/runner"))
import students_t  # noqa: E402
from sweep import effects, page, plan as plans  # noqa: E402


def made(levels: dict, runs: int, value) -> tuple:
    """A sweep's plan and results. @param value  of labels and run"""
    cells = [plans.Cell(i, dict(zip(levels, labels)), {}, {}, {})
             for i, labels in enumerate(itertools.product(*levels.values()))]
    results = {c.number: {run: {"x": value(*c.labels.values(), run)} for run in range(runs)}
               for c in cells}
    return plans.Plan(levels, cells, runs, None, []), results


def test_students_quantiles_are_those_of_the_tables():
    for probability, freedom, t in ((0.975, 1, 12.7062), (0.975, 9, 2.2622), (0.975, 30, 2.0423),
                                    (0.9995, 4, 8.6103), (0.975, 1e7, 1.9600)):
        assert students_t.quantile(probability, freedom) == pytest.approx(t, abs=6e-5)


def test_students_quantiles_are_scipys():
    if importlib.util.find_spec("scipy") is None:
        pytest.skip("no scipy to compare with (python3-scipy)")
    from scipy import stats
    for freedom in (1, 2.7, 12, 400):
        for probability in (0.6, 0.975, 0.99999):
            assert students_t.quantile(probability, freedom) == pytest.approx(
                stats.t.ppf(probability, freedom), rel=1e-7)


def test_effects_and_interactions_are_the_changes_that_were_put_in():
    draw = random.Random(4)
    plan, results = made(
        {"a": ["1", "2"], "b": ["u", "v", "w"]}, 40,
        lambda a, b, run: 10 + 3 * (a == "2") + (b == "w") * (2 + 5 * (a == "2"))
        + draw.gauss(0, 0.5))
    analysis = effects.Analysis(plan, results, "x")
    found = {(e.axes, e.to): e for e in analysis.effects() + analysis.interactions()}
    for key, is_ in {(("a",), ("2",)): 3 + 5 / 3, (("b",), ("v",)): 0, (("b",), ("w",)): 4.5,
                     (("a", "b"), ("2", "v")): 0, (("a", "b"), ("2", "w")): 5}.items():
        value = found[key].estimate
        assert abs(value.mean - is_) < 2 * value.half() and value.half() < 0.5, key
        assert found[key].is_clear(5) == (is_ != 0), key


def test_intervals_hold_what_they_should_as_often_as_they_say():
    """Of unlike cells with few runs: 95 in 100, and shares as well."""
    held = {"number": 0, "share": 0}
    draw = random.Random(11)
    for _ in range(400):
        plan, results = made({"a": ["1", "2"]}, 5, lambda a, run: draw.gauss(0, 1 + 4 * (a == "2")))
        value = effects.Analysis(plan, results, "x").effects()[0].estimate
        held["number"] += abs(value.mean) <= value.half()
        plan, results = made({"a": ["1", "2"]}, 12, lambda a, run: draw.random() < 0.9)
        value = effects.Analysis(plan, results, "x").effects()[0].estimate
        held["share"] += abs(value.mean) <= value.half()
    assert 0.92 * 400 <= held["number"] <= 0.985 * 400 and held["share"] >= 0.92 * 400, held


def test_cells_in_which_all_went_well_are_not_certain():
    plan, results = made({"a": ["1", "2"]}, 4, lambda a, run: True)
    assert effects.Analysis(plan, results, "x").effects()[0].estimate.half() > 0.3


def test_cells_without_the_figure_are_left_out_and_counted():
    plan, results = made({"a": ["1", "2"], "b": ["u", "v"]}, 3,
                         lambda a, b, run: None if b == "v" and a == "2" else run)
    effect = effects.Analysis(plan, results, "x").effects()[0]
    assert (effect.used, effect.all) == (1, 2)


def test_the_report_says_where_the_rule_was_not_content(tmp_path):
    """In one cell nobody hears anything, in the other the figure is another one in each run."""
    pytest.importorskip("matplotlib")
    for below in ("1e-09", "2e-09"):  # the table is the same, the report is not
        (tmp_path / "s.toml").write_text(
            "program = 'hop_count'\nrobots = 4\nseconds = 12\nruns = 2\nreport = ['delivery']\n"
            f"[stop]\nmetric = 'delivery'\nbelow = {below}\nat_most = 3\n"
            "[vary]\nradio.loss = [1.0, 0.3]\n")
        assert suite(tmp_path, "sweep", "s.toml").returncode == 0
        text = (tmp_path / "sweep-s/report.html").read_text()
        assert f"is below {below}, at most 3 runs. 0 of 2 cells came below it" in text
        assert "Cells 0, 1 did not" in text


def test_the_report_tells_effects_and_interactions_in_numbers_and_pictures(tmp_path):
    pytest.importorskip("matplotlib")
    levels = {"load": ["low", "high"], "memory": ["10", "20"], "robots": ["4", "9"]}
    cells = [plans.Cell(i, dict(zip(levels, labels)), {},
                        {"program": "news", "platform": "sim-kilobot", "robots": [0] * 4,
                         "seconds": 1, "seed": i}, {})
             for i, labels in enumerate(itertools.product(*levels.values()))]

    def value(cell, run):  # more memory helps under a high load, and only there
        labels = cell.labels
        return 0.9 - (0.4 if labels["load"] == "high" and labels["memory"] == "10" else 0) \
            + (run - 1.5) / 1000
    results = {c.number: {run: {"converged_s": value(c, run)} for run in range(4)} for c in cells}
    plan = plans.Plan(levels, cells, 4, None, [])
    page.write(plan, results, tmp_path / "r.html", "Test", lambda cell: "x")
    text = (tmp_path / "r.html").read_text()
    assert "<h2>until 95 % have heard / s</h2>" in text, "hop counts' words"
    assert "What changes it most, on average: load low &rarr; high (0.9 becomes 0.7)" in text
    found = re.search(r"<td>load: low &rarr; high</td><td>memory: 10 &rarr; 20</td><td>(.*?)</td>"
                      r"<td>(.*?)</td><td><b>(.*?)</b>", text)
    assert found[1] == "-0.4" and abs(float(found[2])) < 1e-9 and found[3].startswith("0.4")
    assert text.count("<svg") == 2 and "1 of 3 interactions differ from 0" in text
