"""What the settings of a sweep do: effects and interactions, with confidence intervals.

Every one is a contrast of cells' means: a sum of them with weights. Cells have seeds of their own,
so their means are independent, and the contrast's interval is Student's with the degrees of freedom
of Welch and Satterthwaite. Shares (true or false) are taken with one success and one failure more
in each cell (Agresti and Caffo 2000), or cells in which all runs went well would seem certain.
"""
import dataclasses
import itertools
import math
import statistics

import students_t
from sweep import table

CONFIDENCE = 0.95


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A mean, or a contrast of some."""
    mean: float
    variance: float  # of the mean
    freedom: float

    def half(self, confidence: float = CONFIDENCE) -> float:
        """Half of the interval."""
        if self.variance == 0:
            return 0.0
        return students_t.quantile(0.5 + confidence / 2, self.freedom) * math.sqrt(self.variance)


@dataclasses.dataclass(frozen=True)
class Effect:
    """How much a metric changes from `since` to `to`, on average over all else that varies."""
    axes: tuple   # one, or two of an interaction
    since: tuple  # labels
    to: tuple
    estimate: Estimate
    before: Estimate  # the metric at `since`; of an interaction: one change without the other
    used: int     # combinations of the other axes that have values at all ends
    all: int

    def is_clear(self, tests: int) -> bool:
        """Whether it differs from 0, among so many that are looked at (Bonferroni)."""
        return abs(self.estimate.mean) > self.estimate.half(1 - (1 - CONFIDENCE) / tests)


def estimate(values: list) -> Estimate | None:
    """Of a cell's mean; None of fewer than two runs."""
    if len(values) < 2:
        return None
    if all(isinstance(v, bool) for v in values):
        n = len(values) + 2
        share = (sum(values) + 1) / n
        return Estimate(share, share * (1 - share) / n, n - 1)
    numbers = [float(v) for v in values]
    return Estimate(statistics.fmean(numbers), statistics.variance(numbers) / len(numbers),
                    len(numbers) - 1)


def contrast(parts: list[tuple[float, Estimate]]) -> Estimate:
    """Sum of weight times mean."""
    mean = math.fsum(w * e.mean for w, e in parts)
    variances = [(w * w * e.variance, e.freedom) for w, e in parts]
    total = math.fsum(v for v, _ in variances)
    below = math.fsum(v * v / freedom for v, freedom in variances)
    return Estimate(mean, total, total * total / below if below > 0 else math.inf)


class Analysis:
    """Of one metric of a sweep's results."""

    def __init__(self, plan, results: dict, metric: str):
        self.plan, self.metric = plan, metric
        self.cells = {tuple(cell.labels.values()):
                      estimate(table.values_of(plan, results, cell, metric))
                      for cell in plan.cells}
        self.axes = [axis for axis, labels in plan.axes.items() if len(labels) > 1]

    def others(self, axes: tuple) -> list[dict]:
        """Combinations of all other axes."""
        names = [axis for axis in self.plan.axes if axis not in axes]
        return [dict(zip(names, labels)) for labels in
                itertools.product(*(self.plan.axes[name] for name in names))]

    def combine(self, axes: tuple, corners: list[tuple[float, tuple]]) -> tuple:
        """Mean over all other axes of a weighted sum. @param corners  weight, labels of `axes`
        @return the contrast or None, how many combinations it has used, of how many"""
        sums, others = [], self.others(axes)
        for other in others:
            found = [(weight, self.cells[tuple((other | dict(zip(axes, labels)))[axis]
                                               for axis in self.plan.axes)])
                     for weight, labels in corners]
            if all(each is not None for _, each in found):
                sums.append(found)
        if not sums:
            return None, 0, len(others)
        return (contrast([(w / len(sums), e) for found in sums for w, e in found]), len(sums),
                len(others))

    def level(self, axis: str, label: str) -> Estimate | None:
        """The metric with this setting, on average over all else."""
        return self.combine((axis,), [(1.0, (label,))])[0]

    def corner(self, axes: tuple, labels: tuple) -> Estimate | None:
        return self.combine(axes, [(1.0, labels)])[0]

    def effects(self) -> list[Effect]:
        """Of each level beside its axis's first."""
        found = []
        for axis in self.axes:
            first, *rest = self.plan.axes[axis]
            for label in rest:
                value, used, count = self.combine((axis,), [(1.0, (label,)), (-1.0, (first,))])
                if value:  # by the same cells
                    before, _, _ = self.combine((axis,), [(0.0, (label,)), (1.0, (first,))])
                    found.append(Effect((axis,), (first,), (label,), value, before, used, count))
        return found

    def interactions(self) -> list[Effect]:
        """By how much one effect is greater with another setting changed as well."""
        found = []
        for axes in itertools.combinations(self.axes, 2):
            (a, *more_a), (b, *more_b) = (self.plan.axes[axis] for axis in axes)
            for to_a, to_b in itertools.product(more_a, more_b):
                corners = (to_a, to_b), (to_a, b), (a, to_b), (a, b)
                value, used, count = self.combine(axes, list(zip((1.0, -1.0, -1.0, 1.0), corners)))
                if value:
                    before, _, _ = self.combine(axes, list(zip((0.0, 1.0, 0.0, -1.0), corners)))
                    found.append(Effect(axes, (a, b), (to_a, to_b), value, before, used, count))
        return found
