"""A sweep's file (TOML), read and checked: which cells there are, and how many runs of each.

A cell is one combination of all that varies. Keys are flat: "robots", "radio.loss",
"profile.mtu_bytes". Everything that a run would refuse later is refused here, before any has begun.
"""
import dataclasses
import hashlib
import itertools
import json
import math
import numbers

import limits
import metrics
import platforms
import report
import scenarios
from sweep import SweepError, profiles

MOST_RUNS = 1_000_000
MOST_PLACES = 5_000_000  # of robots, in all cells: they are held in memory
SEEDS_OF_A_CELL = 1_000_000  # each cell has seeds of its own: its runs stand for themselves
PLAIN = {"program", "platform", "robots", "seconds", "spacing_mm", "random_ids"}
SECTIONS = {**limits.SECTIONS, "profile": profiles.KEYS}
KNOWN = PLAIN | {f"{section}.{key}" for section, keys in SECTIONS.items() for key in keys}
FILE_KEYS = PLAIN | set(SECTIONS) | {"fault", "seed", "runs", "vary", "stop", "report"}
STOP_KEYS = {"metric", "below", "at_most", "step"}
USUAL_ROBOTS = 36
RANGE_KEYS = {"from", "to", "step", "factor"}


@dataclasses.dataclass(frozen=True)
class Cell:
    """One combination: what it is called, and what its runs are told."""
    number: int
    labels: dict    # axis: label
    settings: dict  # by flat keys, as the file has them
    scenario: dict  # resolved, with the cell's first seed
    profile: dict   # what differs from the compared profile

    @property
    def is_real_time(self) -> bool:
        return self.scenario["platform"] in platforms.REAL_TIME

    def seed(self, run: int) -> int:
        return self.scenario["seed"] + run

    def name(self) -> str:
        return ", ".join(f"{axis} = {label}" for axis, label in self.labels.items())


@dataclasses.dataclass(frozen=True)
class Stop:
    """Go on until half of the metric's 95 % interval is below a number."""
    metric: str
    below: float
    at_most: int
    step: int


@dataclasses.dataclass(frozen=True)
class Plan:
    axes: dict   # axis: its labels in order
    cells: list
    runs: int    # of each cell; with a stopping rule at least
    stop: Stop | None
    report: list  # metrics that the report is about; empty: all

    def identity(self) -> str:
        """Of the cells: how many runs each has may change, and finished runs stay good."""
        cells = [[c.labels, c.settings, c.scenario | {"robots": len(c.scenario["robots"])}]
                 for c in self.cells]
        text = json.dumps(cells, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def flatten(table: dict, is_leaf=lambda _: False, before: str = "") -> dict:
    """Nested tables as dotted keys."""
    found = {}
    for key, value in table.items():
        if isinstance(value, dict) and not is_leaf(value):
            found |= flatten(value, is_leaf, f"{before}{key}.")
        else:
            found[before + key] = value
    return found


def check_value(key: str, value, where: str):
    """Raises SweepError unless a scenario's or profile's key may have this value."""
    if key not in KNOWN:
        section = key.split(".")[0]
        there_is = sorted(f"{section}.{k}" for k in SECTIONS[section]) if section in SECTIONS \
            else sorted(PLAIN) + [f"{s}.*" for s in SECTIONS]
        raise SweepError(f"{where}: no key '{key}'; there is: " + " ".join(there_is))
    section, _, name = key.rpartition(".")
    try:
        if section == "profile":
            profiles.check_value(name, value)
        elif section:
            limits.check_number(value, limits.SECTIONS[section][name], key)
        elif key in limits.TOP:
            limits.check_number(value, limits.TOP[key], key)
        elif key == "random_ids" and not isinstance(value, bool):
            raise SweepError("random_ids must be true or false")
        elif key in ("program", "platform"):
            known = scenarios.PROGRAMS if key == "program" else scenarios.PLATFORMS
            if value not in known:
                raise SweepError(f"no {key} {value!r}; there is: " + " ".join(known))
    except (limits.ScenarioError, SweepError) as error:
        raise SweepError(f"{where}: {error}") from error


def expand(axis: str, table: dict) -> list:
    """The values of a range: { from, to, step } or { from, to, factor }."""
    where = f"vary: {axis}"
    if not {"from", "to"} <= set(table) <= RANGE_KEYS or len(table) != 3:
        raise SweepError(f"{where}: a range is {{ from = A, to = B, step = C }}, or factor = C")
    for key, value in table.items():
        if isinstance(value, bool) or not isinstance(value, numbers.Real) \
                or not math.isfinite(value):
            raise SweepError(f"{where}: {key} is {value!r}: must be a number")
    first, last = table["from"], table["to"]
    if first > last:
        raise SweepError(f"{where}: the range runs backwards, from {first} to {last}")
    step, factor = table.get("step"), table.get("factor")
    if step is not None and step <= 0 or factor is not None and (factor <= 1 or first <= 0):
        raise SweepError(f"{where}: the range never ends: step must be above 0, factor above 1 "
                         "and from above 0")
    values = []
    while len(values) <= MOST_RUNS:
        value = first + step * len(values) if step is not None else first * factor**len(values)
        if value > last + 1e-9 * max(abs(last), 1):
            return values
        values.append(round(value, 12) if isinstance(value, float) else value)
    raise SweepError(f"{where}: the range has more than {MOST_RUNS} values")


def read_axis(axis: str, given) -> list[tuple[str, dict]]:
    """Labels of an axis, and what each sets."""
    where = f"vary: {axis}"
    if isinstance(given, dict):
        given = expand(axis, given)
    if not isinstance(given, list):
        raise SweepError(f"{where}: is {given!r}: must be a list or a range")
    if not given:
        raise SweepError(f"{where}: the list is empty: give it values, or leave it out")
    choices = []
    for value in given:
        if isinstance(value, dict):
            settings = flatten(value)
            label = settings.pop("label", None)
            if not isinstance(label, str) or not settings:
                raise SweepError(f"{where}: each table needs a label and at least one key")
        else:
            label, settings = str(value).lower() if isinstance(value, bool) else str(value), \
                {axis: value}
        for key, each in settings.items():
            check_value(key, each, where)
        choices.append((label, settings))
    labels, values = {}, {}
    for label, settings in choices:
        if label in labels:
            raise SweepError(f"{where}: '{label}' stands there twice")
        labels[label] = settings
        other = values.setdefault(tuple(sorted(settings.items())), label)
        if other != label:
            raise SweepError(f"{where}: '{other}' and '{label}' are the same")
    return choices


def read_stop(table, runs: int) -> Stop | None:
    if table is None:
        return None
    if not isinstance(table, dict) or set(table) - STOP_KEYS or \
            not {"metric", "below", "at_most"} <= set(table):
        raise SweepError("[stop] needs metric, below and at_most, and may have step")
    if not isinstance(table["metric"], str):
        raise SweepError(f"[stop] metric is {table['metric']!r}: must be a metric's name")
    step = table.get("step", runs)
    try:
        limits.check_number(table["below"], (limits.REAL, 1e-12, 1e12), "[stop] below")
        limits.check_number(table["at_most"], (limits.WHOLE, runs, MOST_RUNS), "[stop] at_most")
        limits.check_number(step, (limits.WHOLE, 1, MOST_RUNS), "[stop] step")
        limits.check_number(runs, (limits.WHOLE, 2, MOST_RUNS), "runs, with [stop],")
    except limits.ScenarioError as error:
        raise SweepError(str(error)) from error
    known = sorted({*report.LABELS, "success"})
    if table["metric"] not in known:
        raise SweepError(f"[stop] no metric '{table['metric']}'; there is: " + " ".join(known))
    return Stop(table["metric"], table["below"], table["at_most"], step)


def resolve(number: int, labels: dict, settings: dict, faults: list, seed: int) -> Cell:
    """A cell's scenario. Raises SweepError with the cell in it when it cannot run."""
    options, profile = {}, {}
    for key, value in settings.items():
        section, _, name = key.rpartition(".")
        if section == "profile":
            profile[name] = value
        elif section:
            options.setdefault(section, {})[name] = value
        else:
            options[key] = value
    options.setdefault("platform", "sim-kilobot")
    if faults:
        options["fault"] = faults
    try:
        seed += number * SEEDS_OF_A_CELL
        limits.check_number(seed + SEEDS_OF_A_CELL, limits.TOP["seed"], "the last cell's seed")
        if "program" not in options:
            raise SweepError("name a program: " + " ".join(scenarios.PROGRAMS))
        scenario = scenarios.resolve(options | {"seed": seed})
        if profile and not scenario["platform"].startswith("sim-"):
            raise SweepError(f"{scenario['platform']} has a profile of its own: leave [profile] "
                             "out, or use sim-kilobot or sim-coachbot")
        platforms.check(scenario)
    except (limits.ScenarioError, platforms.PlatformError, SweepError) as error:
        name = ", ".join(f"{a} = {b}" for a, b in labels.items())
        raise SweepError(f"cell {number}{name and f' ({name})'}: {error}") from error
    return Cell(number, labels, settings, scenario, profile)


def check_size(axes: dict, fixed: dict, most: int):
    """Before any cell is made. @param most  runs of a cell. Raises SweepError"""
    count = math.prod(len(choices) for choices in axes.values())
    if count > MOST_RUNS:
        raise SweepError(f"vary: these are {count} cells; at most {MOST_RUNS}")
    if count * most > MOST_RUNS:
        raise SweepError(f"these are {count * most} runs; at most {MOST_RUNS}")
    robots = count * fixed.get("robots", USUAL_ROBOTS)
    for choices in axes.values():
        if any("robots" in settings for _, settings in choices):
            robots = sum(settings.get("robots", fixed.get("robots", USUAL_ROBOTS))
                         for _, settings in choices) * (count // len(choices))
    if robots > MOST_PLACES:
        raise SweepError(f"vary: these {count} cells have {robots} robots in all; at most "
                         f"{MOST_PLACES}: take fewer cells or smaller swarms")


def read_cells(table: dict, fixed: dict, most: int) -> tuple[dict, list[Cell]]:
    """Every combination, the last axis running fastest."""
    given = table.get("vary", {})
    if not isinstance(given, dict):
        raise SweepError("[vary] must be a table: a key, and the list or range of its values")
    given = flatten(given, lambda value: bool(RANGE_KEYS & set(value)))
    axes = {axis: read_axis(axis, values) for axis, values in given.items()}
    owner = {key: "the file's top" for key in fixed}
    for axis, choices in axes.items():
        for key in {key for _, settings in choices for key in settings}:
            if owner.get(key, axis) not in (axis, "the file's top"):
                raise SweepError(f"vary: {owner[key]} and {axis} both set {key}")
            owner[key] = axis
    check_size(axes, fixed, most)
    faults, seed = table.get("fault", []), table.get("seed", 1)
    cells = []
    for combination in itertools.product(*axes.values()):
        labels = {axis: label for axis, (label, _) in zip(axes, combination)}
        settings = dict(fixed)
        for _, each in combination:
            settings |= each
        cells.append(resolve(len(cells), labels, settings, faults, seed))
        if platforms.interrupted:
            raise platforms.Interrupted
    return {axis: [label for label, _ in choices] for axis, choices in axes.items()}, cells


def read(path: str) -> Plan:
    """Raises SweepError with one line that begins with the file's name."""
    try:
        table = scenarios.read_toml(path)
    except limits.ScenarioError as error:
        raise SweepError(str(error)) from error
    try:
        unknown = sorted(set(table) - FILE_KEYS)
        if unknown:
            raise SweepError(f"no key '{unknown[0]}'; there is: " + " ".join(sorted(FILE_KEYS)))
        limits.check_top(table)
        if not isinstance(table.get("profile", {}), dict):
            raise SweepError("[profile] must be a table of keys and numbers")
        fixed = flatten({k: v for k, v in table.items() if k in PLAIN | set(SECTIONS)})
        for key, value in fixed.items():
            check_value(key, value, "the file's top")
        runs = table.get("runs", 10)
        stop = read_stop(table.get("stop"), runs)
        axes, cells = read_cells(table, fixed, stop.at_most if stop else runs)
        metrics_ = table.get("report", [])
        if not isinstance(metrics_, list) or not all(isinstance(each, str) for each in metrics_):
            raise SweepError("report must be a list of metrics' names")
    except (SweepError, limits.ScenarioError) as error:
        raise SweepError(f"{path}: {error}") from error
    return Plan(axes, cells, runs, stop, metrics_)


def is_done(plan: Plan, values: list) -> bool:
    """Whether the stopping rule is content with the results so far. @param values  of its metric"""
    numbers_ = [float(v) for v in values if isinstance(v, (int, float))]
    return len(numbers_) >= 2 and metrics.interval(numbers_)[1] < plan.stop.below


def wanted(plan: Plan, results: dict) -> int:
    """How many runs a cell is to have, by the results that there are. Looked at only after `runs`
    and every `step` more, in the order of seeds: whoever has the same results wants the same.

    @param results  {run: result, or None for one that was cut off}
    """
    count = plan.runs
    while plan.stop and count < plan.stop.at_most and all(run in results for run in range(count)):
        values = [results[run].get(plan.stop.metric) for run in range(count) if results[run]]
        if is_done(plan, values):
            break
        count = min(count + plan.stop.step, plan.stop.at_most)
    return count
