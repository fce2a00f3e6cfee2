"""What a sweep has found, as CSV: a row for each run, and a row for each cell.

The same results give the same bytes, whoever made them and in which order: rows go by cell and
seed, columns by the first row that has them, numbers as Python prints them.
"""
import csv
import io

import metrics
from sweep import plan as plans

OWN = ("program", "platform", "robots", "seconds")  # a run's own words, told once for each cell


def cell_columns(plan) -> list[str]:
    """What tells cells apart: all axes, and what a run always says of itself."""
    return [*plan.axes, *(key for key in OWN if key not in plan.axes)]


def cell_values(plan, cell) -> list:
    scenario = cell.scenario | {"robots": len(cell.scenario["robots"])}
    return [cell.labels[c] if c in cell.labels else scenario[c] for c in cell_columns(plan)]


def counted(plan, results: dict, cell) -> list[tuple[int, dict | None]]:
    """A cell's runs that count, by their seeds: the stopping rule may want fewer than there are."""
    of_cell = results.get(cell.number, {})
    wanted = plans.wanted(plan, of_cell)
    return [(run, of_cell[run]) for run in sorted(of_cell) if run < wanted]


def metric_names(plan, results: dict) -> list[str]:
    """In the order in which runs name them."""
    found = dict.fromkeys(key for cell in plan.cells
                          for _, result in counted(plan, results, cell) if result
                          for key in result)
    return [key for key in found if key not in (*OWN, "seed")]


def plain(value) -> str:
    if value is None:
        return ""
    return str(int(value)) if isinstance(value, bool) else str(value)


def text(rows: list) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def runs_csv(plan, results: dict) -> str:
    """A row for each run. `real_time`: no two runs alike, so this one is not repeated; `cut_off`:
    it was ended before it was done, and says nothing."""
    names = metric_names(plan, results)
    rows = [["cell", *cell_columns(plan), "real_time", "seed", "cut_off", *names]]
    for cell in plan.cells:
        for run, result in counted(plan, results, cell):
            rows.append([cell.number, *map(plain, cell_values(plan, cell)),
                         plain(cell.is_real_time), cell.seed(run), plain(result is None),
                         *(plain((result or {}).get(name)) for name in names)])
    return text(rows)


def values_of(plan, results: dict, cell, metric: str) -> list:
    """Numbers of a metric, of the runs that have it."""
    return [result[metric] for _, result in counted(plan, results, cell)
            if result and isinstance(result.get(metric), (int, float))]


def cells_csv(plan, results: dict, repeat) -> str:
    """A row for each cell: mean, half of its 95 % interval and number of runs, of each metric.
    @param repeat  the command that repeats a cell"""
    names = metric_names(plan, results)
    rows = [["cell", *cell_columns(plan), "runs",
             *(f"{name}{part}" for name in names for part in ("", "_half", "_runs")), "repeat"]]
    for cell in plan.cells:
        row = [cell.number, *map(plain, cell_values(plan, cell)),
               len(counted(plan, results, cell))]
        for name in names:
            values = [float(v) for v in values_of(plan, results, cell, name)]
            mean, half = metrics.interval(values) if values else (None, None)
            row += [plain(mean), plain(half if len(values) > 1 else None), len(values)]
        rows.append([*row, repeat(cell)])
    return text(rows)
