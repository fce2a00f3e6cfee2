"""The report opens offline and shows figures, as a browser draws it."""
import html.parser
import importlib.util
import re
import shutil
import subprocess
import sys

import pytest

from test_runner import ROOT, results, suite

sys.path.insert(0, str(ROOT / "suite/runner"))
import run_log  # noqa: E402
import report  # noqa: E402

if importlib.util.find_spec("matplotlib") is None:
    pytest.skip("no matplotlib (python3-matplotlib)", allow_module_level=True)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    tmp_path = tmp_path_factory.mktemp("report")
    for program in ("hop_count", "hop_count_two_seeds"):
        for platform in ("sim-kilobot", "sim-coachbot"):
            suite(tmp_path, "run", program, "--platform", platform, "--runs", 1)
    suite(tmp_path, "run", "firefly", "--runs", 1, "--seconds", 100)
    suite(tmp_path, "run", "edge_following", "--runs", 1, "--seconds", 100)
    done = suite(tmp_path, "report")
    assert done.returncode == 0, done.stderr
    return tmp_path / "suite-report.html"


def test_the_page_needs_nothing_but_itself(page):
    text = page.read_text()
    assert text.count("<svg") == 4
    assert not re.search(r"(src|href)=\"(https?:)?//|url\(http|@import", text)
    assert re.findall("<b>(.*?)</b>", text) == [f"Figure {i} of the paper." for i in (4, 5, 6, 8)]
    assert "1 of 1" in text and "delivery ratio" in text
    html.parser.HTMLParser().feed(text)


def test_a_browser_draws_it(tmp_path):
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("no chromium (apt-get install chromium)")
    suite(tmp_path, "run", "hop_count")
    assert suite(tmp_path, "report").returncode == 0
    page = tmp_path / "suite-report.html"
    picture = tmp_path / "report.png"
    subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu",
                    f"--user-data-dir={tmp_path}/profile", f"--screenshot={picture}",
                    "--window-size=1200,2400", page.as_uri()], check=True, timeout=120,
                   capture_output=True)
    from matplotlib import image
    pixels = image.imread(picture)[:, :, :3]
    red = (pixels[:, :, 0] > 0.9) & (pixels[:, :, 1:].max(axis=2) < 0.1)
    blue = (pixels[:, :, 2] > 0.9) & (pixels[:, :, :2].max(axis=2) < 0.1)
    assert red.sum() > 1000 and blue.sum() > 1000, "no robots in the picture"


def test_several_runs_have_an_interval(tmp_path):
    assert suite(tmp_path, "run", "hop_count", "--robots", 4, "--runs", 3).returncode == 0
    assert suite(tmp_path, "report").returncode == 0
    assert "&plusmn;" in (tmp_path / "suite-report.html").read_text()


def test_what_the_paper_prints_stands_beside_what_was_measured(page):
    """In the first column; and each platform is told which of the paper's robots it stands for."""
    tables = re.findall("<table>.*?</table>", page.read_text(), re.DOTALL)
    rows = [dict(re.findall("<tr><td>(.*?)</td>(.*?)</tr>", each)) for each in tables]
    assert all(row["runs that succeeded"].startswith("<td>10 of 10</td><td>") for row in rows)
    assert rows[0]["robot of the paper"] == ("<td>all four</td><td>Kilobot</td><td>Coachbot</td>")
    assert rows[0]["last right count first there / s"].startswith("<td>&le; 10</td>")
    assert rows[3]["revolutions"].startswith("<td>&ge; 5</td>")
    assert rows[3]["robots"] == "<td>6</td><td>6</td>"
    columns = [len(re.findall("<t[hd]>", line)) for each in tables
               for line in re.findall("<tr>.*?</tr>", each)]
    assert len(set(columns[:len(rows[0]) + 1])) == 1, "a row has another number of cells"


def test_an_empty_folder_is_told(tmp_path):
    done = suite(tmp_path, "report", "--logs", ".")
    assert done.returncode == 1 and "no logs" in done.stderr


def test_runs_that_are_not_alike_are_not_averaged(tmp_path):
    """9 robots are not 36, and air that loses is not air that does not; the last is what it says
    on the column."""
    (tmp_path / "lossy.toml").write_text("program = 'hop_count'\nradio.loss = 0.3\n")
    suite(tmp_path, "run", "hop_count", "--robots", 9, "--runs", 2)
    suite(tmp_path, "run", "hop_count", "--robots", 16)
    suite(tmp_path, "run", "--scenario", "lossy.toml", "--robots", 16)
    assert "4 runs" in suite(tmp_path, "report").stdout
    text = (tmp_path / "suite-report.html").read_text()
    heads = re.findall("<th>sim-kilobot<br>(.*?)</th>", text)
    assert heads == ["9 robots<br>radio.loss: as usual", "16 robots<br>radio.loss: as usual",
                     "16 robots<br>radio.loss: 0.3"]
    assert re.findall(r"<td>(\d of \d)</td>", text)[0] == "2 of 2"


def test_files_that_are_no_logs_are_named_and_left_out(tmp_path):
    logs = tmp_path / "suite-logs"
    logs.mkdir()
    suite(tmp_path, "run", "hop_count", "--output", logs / "results.jsonl", "--logs", logs)
    (logs / "empty.jsonl").write_text("")
    scenario, *events = next(logs.glob("hop_count-*.jsonl")).read_text().splitlines(keepends=True)
    links = '{"t":0,"robot":0,"event":"links","to":[1]}\n'  # of all robots, where they are told
    (logs / "cut.jsonl").write_text(scenario + links + events[0])
    done = suite(tmp_path, "report")
    assert done.returncode == 0 and "1 runs" in done.stdout
    assert "cut.jsonl is not a whole log" in done.stderr
    assert "empty.jsonl is not a log" in done.stderr and "results.jsonl is not a log" in done.stderr


def test_many_columns_are_drawn_in_several_rows(tmp_path):
    """Seven in one row were too small to read."""
    for robots in range(4, 11):
        suite(tmp_path, "run", "hop_count", "--robots", robots)
    assert suite(tmp_path, "report").returncode == 0
    text = (tmp_path / "suite-report.html").read_text()
    assert text.count("<svg") == 2 and text.count("<b>Figure ") == 1


@pytest.mark.parametrize("fault, levels", [
    ("kind = 'death'\nrobot = 7", [0.5, 1.5, 2.5, 3.5, 4.5, 5.5]),
    ("kind = 'partition'\nx_mm = 120", [0.5, 1.5, 2.5, 3.5, 4.5]),
    ("kind = 'partition'\nx_mm = 20", [])])
def test_borders_are_drawn_between_robots_that_have_counts(tmp_path, monkeypatch, fault, levels):
    """A dead robot took them all away, those out of reach had a hundred; one column has none."""
    (tmp_path / "s.toml").write_text("program = 'hop_count'\n[[fault]]\n" + fault + "\n")
    result = results(suite(tmp_path, "run", "--scenario", "s.toml"))[0]
    drawn = []
    _, axes = report_figure()
    monkeypatch.setattr(axes, "tricontour", lambda *_, levels, **__: drawn.extend(levels))
    report.gradient_map(axes, run_log.Log(str(tmp_path / result["log"])))
    assert drawn == levels


def report_figure():
    """One pair of axes that no window shows."""
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot
    return pyplot.subplots()
