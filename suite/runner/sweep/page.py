"""One HTML page of a sweep: figures of effects, tables of effects and interactions, all cells."""
import html
import pathlib
import re

import metrics
import report
from sweep import effects, store as stores, table

MOST_INTERACTIONS = 20  # are shown of each metric, the clearest
MOST_LINES = 4          # in a panel: levels of the first axis
MOST_CELLS = 2000       # are on the page; cells.csv has all
HIDDEN = {"interrupted", "too_short"}
EXPLAINED = (
    "A figure has a panel for each setting, and a colour for each value of the first one if those "
    "are few: the mean over all cells with this value, with its 95 % interval. An effect is the "
    "change from a setting's first value to another, on average over everything else that varies; "
    "an interaction is by how much that change differs when a second setting is changed, too. "
    "Intervals are of 95 % each. Effects in bold differ from 0 even among as many as are looked at "
    "here (Bonferroni); of a hundred others, five would seem to differ where nothing does.")


def label_of(metric: str) -> str:
    return "share of runs that succeeded" if metric == "success" else \
        report.LABELS.get(metric, metric)


def is_number(text: str) -> bool:
    try:
        return float(text) == float(text)
    except ValueError:
        return False


def draw(axes, estimates: list, labels: list[str], name: str | None):
    """Means with intervals; joined by a line where the labels are numbers."""
    points = [(i, e) for i, e in enumerate(estimates) if e is not None]
    axes.errorbar([i for i, _ in points], [e.mean for _, e in points],
                  yerr=[e.half() for _, e in points], markersize=3, linewidth=0.9, capsize=2,
                  fmt="o-" if all(map(is_number, labels)) else "o", label=name)


def figure(analysis: effects.Analysis, title: str) -> str:
    """An SVG with a panel for each axis, in the colours of the first one's levels."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": title, "svg.fonttype": "none", "font.size": 8,
                                "font.family": "sans-serif", "axes.linewidth": 0.6})
    from matplotlib import pyplot
    first, levels = analysis.axes[0], analysis.plan.axes[analysis.axes[0]]
    shown = analysis.axes[1:] if 1 < len(analysis.axes) and len(levels) <= MOST_LINES \
        else analysis.axes
    widths = [max(2.5, len(analysis.plan.axes[axis])) for axis in shown]
    drawn, panels = pyplot.subplots(1, len(shown), squeeze=False, sharey=True,
                                    layout="constrained", width_ratios=widths,
                                    figsize=(max(3.4, 1.4 + 0.5 * sum(widths)), 2.6))
    for axes, axis in zip(panels[0], shown):
        labels = analysis.plan.axes[axis]
        if shown is analysis.axes:
            draw(axes, [analysis.level(axis, label) for label in labels], labels, None)
        else:
            for level in levels:
                draw(axes, [analysis.corner((first, axis), (level, label)) for label in labels],
                     labels, level)
        long = max(map(len, labels)) > 6
        axes.set_xticks(range(len(labels)), labels, rotation=45 if long else 0,
                        ha="right" if long else "center")
        axes.set_xlim(-0.5, len(labels) - 0.5)
        axes.set_xlabel(axis)
        axes.grid(axis="y", linewidth=0.3)
    if shown is not analysis.axes:
        panels[0][-1].legend(title=first, fontsize=7, title_fontsize=7, frameon=False,
                             loc="center left", bbox_to_anchor=(1, 0.5))
    panels[0][0].set_ylabel(title)
    text = report.figure_text(drawn)
    pyplot.close(drawn)
    return re.sub(r"<dc:date>.*?</dc:date>", "", text)


def row(effect: effects.Effect, tests: int) -> str:
    words = "; ".join(f"{html.escape(axis)}: {html.escape(since)} &rarr; {html.escape(to)}"
                      for axis, since, to in zip(effect.axes, effect.since, effect.to))
    value = report.number(effect.estimate.mean, effect.estimate.half())
    if effect.is_clear(tests):
        value = f"<b>{value}</b>"
    part = "" if effect.used == effect.all else f"{effect.used} of {effect.all} combinations"
    return f"<tr><td>{words}</td><td>{value}</td><td>{part}</td></tr>"


def section(plan, results: dict, metric: str, pictures: pathlib.Path | None) -> str:
    """One metric."""
    analysis = effects.Analysis(plan, results, metric)
    title = label_of(metric)
    parts = [f"<h2>{html.escape(title)}</h2>"]
    main, crossed = analysis.effects(), analysis.interactions()
    if not main:
        return parts[0] + "<p>Nothing varies, or no cell has two runs with this figure.</p>"
    drawn = figure(analysis, title)
    parts.append(f"<figure>{drawn}</figure>")
    if pictures:
        stores.write_whole(pictures / f"{metric}.svg", drawn.encode())
    tests = len(main) + len(crossed)
    parts += ["<table><tr><th>effect</th><th>change</th><th></th></tr>",
              *(row(each, tests) for each in main), "</table>"]
    if crossed:
        clear = [e for e in crossed if e.is_clear(tests)]
        clear.sort(key=lambda e: -abs(e.estimate.mean) / (e.estimate.half() or 1e-300))
        parts.append(f"<p>{len(clear)} of {len(crossed)} interactions differ from 0"
                     + (f"; the {MOST_INTERACTIONS} clearest:" if len(clear) > MOST_INTERACTIONS
                        else ":" if clear else ".") + "</p>")
        if clear:
            parts += ["<table><tr><th>interaction</th><th>change of the change</th><th></th></tr>",
                      *(row(each, tests) for each in clear[:MOST_INTERACTIONS]), "</table>"]
    return "\n".join(parts)


def cells_table(plan, results: dict, names: list[str], repeat) -> str:
    heads = "".join(f"<th>{html.escape(h)}</th>" for h in
                    ["cell", *plan.axes, "runs", *map(label_of, names), "repeat it with"])
    lines = [f"<h2>Cells</h2><table><tr>{heads}</tr>"]
    for cell in plan.cells[:MOST_CELLS]:
        runs = table.counted(plan, results, cell)
        cut = sum(result is None for _, result in runs)
        values = [str(cell.number), *cell.labels.values(),
                  f"{len(runs)}" + (" in real time" if cell.is_real_time else "")
                  + (f", {cut} cut off" if cut else "")]
        line = "".join(f"<td>{html.escape(value)}</td>" for value in values)
        for name in names:
            found = [float(v) for v in table.values_of(plan, results, cell, name)]
            mean, half = metrics.interval(found) if found else (0, 0)
            few = f" ({len(found)} runs)" if len(found) < len(runs) else ""
            line += (f"<td>{report.number(mean, half if len(found) > 1 else None)}{few}</td>"
                     if found else "<td>&ndash;</td>")
        lines.append(f"<tr>{line}<td><code>{html.escape(repeat(cell))}</code></td></tr>")
    if len(plan.cells) > MOST_CELLS:
        lines.append(f"<tr><td>{len(plan.cells) - MOST_CELLS} more in cells.csv</td></tr>")
    return "\n".join(lines + ["</table>"])


def mark_of(report_: pathlib.Path) -> str | None:
    """What write() was told that a page is made of; None without a page."""
    try:
        with open(report_, encoding="utf-8") as file:
            found = re.search(r'<meta name=made-of content="(\w*)">', file.read(300))
    except (OSError, ValueError):
        return None
    return found[1] if found else None


def write(plan, results: dict, output: pathlib.Path, title: str, repeat,
          pictures: pathlib.Path | None = None, mark: str = ""):
    """Raises ImportError without matplotlib, SweepError when it does not fit on the disk."""
    import matplotlib  # noqa: F401
    there_is = [n for n in table.metric_names(plan, results) if n not in HIDDEN]
    names = [n for n in plan.report if n in there_is] or there_is
    missing = [n for n in plan.report if n not in there_is]
    runs = sum(len(table.counted(plan, results, cell)) for cell in plan.cells)
    notes = f"<p>No run has the figure {html.escape(', '.join(missing))}.</p>" if missing else ""
    page = ("<!DOCTYPE html><html lang=en><head><meta charset=utf-8>"
            f'<meta name=made-of content="{mark}">'
            f"<title>{html.escape(title)}</title><style>{report.STYLE}</style></head><body>"
            f"<h1>{html.escape(title)}</h1><p>{len(plan.cells)} cells, {runs} runs. {EXPLAINED}</p>"
            + notes + "".join(section(plan, results, name, pictures) for name in names)
            + cells_table(plan, results, names, repeat) + "</body></html>\n")
    stores.write_whole(output, page.encode())
