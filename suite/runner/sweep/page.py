"""One HTML page of a sweep: figures of effects, tables of effects and interactions, all cells."""
import html
import pathlib
import re

import metrics
import report
from sweep import effects, plan as plans, store as stores, table

MOST_INTERACTIONS = 20  # are shown of each metric, the clearest
MOST_LETTERS = 6        # of a label that is not turned
MOST_OPEN = 20          # cells that are named which the stopping rule is not content with
MOST_LINES = 4          # in a panel: levels of the first axis
MOST_CELLS = 2000       # are on the page; cells.csv has all
HIDDEN = {"interrupted", "too_short"}
MOST_NAMED = 3          # effects in words
MOST_CROSSED = 3        # pictures of interactions of each metric
MOST_CROSSED_LINES = 6
STYLE = "\n.crossed{display:inline-block;margin:1em 1em 0 0}td:nth-child(2){white-space:normal}"
EXPLAINED = """<h2>How to read this</h2><ul>
<li>A <b>cell</b> is one combination of settings. Its runs differ by nothing but their seed.</li>
<li>An <b>effect</b> is by how much a figure changes when one setting goes from its first value to
another, on average over everything else that varies.</li>
<li>An <b>interaction</b> says that this change is not the same everywhere: it depends on a second
setting. Look at those before you believe an effect.</li>
<li><b>&plusmn;</b> is half of the 95 % interval, also in the figures (bars). If the interval holds
0, this sweep does not show that the setting matters; more runs might.</li>
<li><b>Bold</b> changes differ from 0 even among as many as are looked at here (Bonferroni). Of a
hundred others, five would seem to differ where nothing does.</li></ul>"""


def label_of(metric: str, program: str | None = None) -> str:
    return "share of runs that succeeded" if metric == "success" else \
        report.label_of(metric, program)


def program_of(plan) -> str | None:
    """Of all cells; None if they have several."""
    programs = {cell.scenario["program"] for cell in plan.cells}
    return programs.pop() if len(programs) == 1 else None


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


def begin_figure(title: str, labels: list[list[str]]) -> tuple:
    """A figure with a panel for each list of labels, as wide as they need; and its panels."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": title, "svg.fonttype": "none", "font.size": 8,
                                "font.family": "sans-serif", "axes.linewidth": 0.6})
    from matplotlib import pyplot
    widths = [max(2.5, len(each)) for each in labels]
    longest = max((len(label) for each in labels for label in each), default=0)
    height = 2.4 + (0.065 * longest if longest > MOST_LETTERS else 0.2)
    drawn, panels = pyplot.subplots(1, len(labels), squeeze=False, sharey=True,
                                    layout="constrained", width_ratios=widths,
                                    figsize=(max(3.6, 1.6 + 0.5 * sum(widths)), height))
    panels[0][0].set_ylabel(title if len(title) < 36 else title.replace(" that ", "\nthat "))
    return drawn, panels[0]


def name_ticks(axes, axis: str, labels: list[str]):
    is_long = max(map(len, labels)) > MOST_LETTERS
    axes.set_xticks(range(len(labels)), labels, rotation=90 if is_long else 0)
    axes.set_xlim(-0.5, len(labels) - 0.5)
    axes.set_xlabel(axis)
    axes.grid(axis="y", linewidth=0.3)


def end_figure(drawn) -> str:
    from matplotlib import pyplot
    text = report.figure_text(drawn)
    pyplot.close(drawn)
    return re.sub(r"<dc:date>.*?</dc:date>", "", text)


def figure(analysis: effects.Analysis, title: str) -> str:
    """An SVG with a panel for each axis, in the colours of the first one's levels."""
    first, levels = analysis.axes[0], analysis.plan.axes[analysis.axes[0]]
    shown = analysis.axes[1:] if 1 < len(analysis.axes) and len(levels) <= MOST_LINES \
        else analysis.axes
    drawn, panels = begin_figure(title, [analysis.plan.axes[axis] for axis in shown])
    for axes, axis in zip(panels, shown):
        labels = analysis.plan.axes[axis]
        if shown is analysis.axes:
            draw(axes, [analysis.level(axis, label) for label in labels], labels, None)
        else:
            for level in levels:
                draw(axes, [analysis.corner((first, axis), (level, label)) for label in labels],
                     labels, level)
        name_ticks(axes, axis, labels)
    if shown is not analysis.axes:
        legend(panels[-1], first)
    return end_figure(drawn)


def legend(axes, title: str):
    axes.legend(title=title, fontsize=7, title_fontsize=7, frameon=False, loc="center left",
                bbox_to_anchor=(1, 0.5))


def crossed_figure(analysis: effects.Analysis, title: str, pair: tuple) -> str:
    """An SVG of how a metric goes by one axis, with a line for each level of another."""
    axis, lines = sorted(pair, key=lambda each: -len(analysis.plan.axes[each]))
    labels = analysis.plan.axes[axis]
    drawn, panels = begin_figure(title, [labels])
    for level in analysis.plan.axes[lines]:
        draw(panels[0], [analysis.corner((lines, axis), (level, label)) for label in labels],
             labels, level)
    name_ticks(panels[0], axis, labels)
    legend(panels[0], lines)
    return end_figure(drawn)


def row(effect: effects.Effect, tests: int) -> str:
    value = report.number(effect.estimate.mean, effect.estimate.half())
    if effect.is_clear(tests):
        value = f"<b>{value}</b>"
    before, after = effect.before.mean, effect.before.mean + effect.estimate.mean
    words = [f"{html.escape(axis)}: {html.escape(since)} &rarr; {html.escape(to)}"
             for axis, since, to in zip(effect.axes, effect.since, effect.to)]
    if len(words) == 1:
        told = f"<td>{report.number(before, None)}</td><td>{report.number(after, None)}</td>"
    else:
        told = (f"<td>{words[1]}</td><td>{before:+.3g}</td><td>{after:+.3g}</td>")
    part = "" if effect.used == effect.all else f"{effect.used} of {effect.all} combinations"
    return f"<tr><td>{words[0]}</td>{told}<td>{value}</td><td>{part}</td></tr>"


def in_words(main: list, tests: int) -> str:
    """What changes the figure most."""
    clear = sorted((e for e in main if e.is_clear(tests)), key=lambda e: -abs(e.estimate.mean))
    if not clear:
        return "<p>No setting changes it clearly on average.</p>"
    named = [f"{html.escape(e.axes[0])} {html.escape(e.since[0])} &rarr; {html.escape(e.to[0])} "
             f"({report.number(e.before.mean, None)} becomes "
             f"{report.number(e.before.mean + e.estimate.mean, None)})"
             for e in clear[:MOST_NAMED]]
    return f"<p>What changes it most, on average: {'; '.join(named)}.</p>"


def interactions(analysis: effects.Analysis, title: str, crossed: list, tests: int) -> list[str]:
    """In words, a table and pictures of the clearest."""
    if not crossed:
        return []
    clear = [e for e in crossed if e.is_clear(tests)]
    clear.sort(key=lambda e: -abs(e.estimate.mean) / (e.estimate.half() or 1e-300))
    shown = clear[:MOST_INTERACTIONS]
    parts = [f"<p>{len(clear)} of {len(crossed)} interactions differ from 0"
             + (f"; the {MOST_INTERACTIONS} clearest:" if len(clear) > len(shown)
                else ":" if clear else ".") + "</p>"]
    if not clear:
        return parts
    parts += ["<table><tr><th>this change</th><th>depends on</th><th>with the first value</th>"
              "<th>with the second</th><th>difference</th><th></th></tr>",
              *(row(each, tests) for each in shown), "</table>"]
    pairs = [p for p in dict.fromkeys(e.axes for e in shown)
             if min(len(analysis.plan.axes[axis]) for axis in p) <= MOST_CROSSED_LINES]
    return [*parts, *(f"<figure class=crossed>{crossed_figure(analysis, title, p)}</figure>"
                      for p in pairs[:MOST_CROSSED])]


def section(plan, results: dict, metric: str, pictures: pathlib.Path | None) -> str:
    """One metric."""
    analysis = effects.Analysis(plan, results, metric)
    title = label_of(metric, program_of(plan))
    parts = [f"<h2>{html.escape(title)}</h2>"]
    main, crossed = analysis.effects(), analysis.interactions()
    if not main:
        return parts[0] + "<p>Nothing varies, or no cell has two runs with this figure.</p>"
    drawn = figure(analysis, title)
    tests = len(main) + len(crossed)
    parts += [in_words(main, tests), f"<figure>{drawn}</figure>"]
    if pictures:
        stores.write_whole(pictures / f"{metric}.svg", drawn.encode())
    parts += ["<table><tr><th>effect</th><th>before</th><th>after</th><th>change</th><th></th>"
              "</tr>", *(row(each, tests) for each in main), "</table>"]
    return "\n".join(parts + interactions(analysis, title, crossed, tests))


def stopping(plan, results: dict) -> str:
    """Where the stopping rule was content, and where it was not when the runs were used up."""
    if plan.stop is None:
        return ""
    stop, done, open_ = plan.stop, [], []
    for cell in plan.cells:
        values = table.values_of(plan, results, cell, stop.metric)
        (done if plans.is_done(plan, values) else open_).append(cell)
    name = html.escape(label_of(stop.metric, program_of(plan)))
    text = (f"<p>Stopping rule: until half of the 95 % interval of \N{LEFT DOUBLE QUOTATION MARK}"
            f"{name}\N{RIGHT DOUBLE QUOTATION MARK} is below {stop.below:g}, at most "
            f"{stop.at_most} runs. {len(done)} of {len(plan.cells)} cells came below it.")
    if open_:
        few = ", ".join(str(cell.number) for cell in open_[:MOST_OPEN])
        more = f" and {len(open_) - MOST_OPEN} more" if len(open_) > MOST_OPEN else ""
        text += (f" <b>Cells {few}{more} did not</b>: their intervals are wider than was asked "
                 "for; a higher at_most goes on with them.")
    return text + "</p>"


def cells_table(plan, results: dict, names: list[str], repeat) -> str:
    labels = [label_of(name, program_of(plan)) for name in names]
    heads = "".join(f"<th>{html.escape(h)}</th>" for h in
                    ["cell", *plan.axes, "runs", *labels, "repeat it with"])
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
            f"<title>{html.escape(title)}</title><style>{report.STYLE}{STYLE}</style></head><body>"
            f"<h1>{html.escape(title)}</h1><p>{len(plan.cells)} cells, {runs} runs.</p>"
            + stopping(plan, results) + EXPLAINED + notes
            + "".join(section(plan, results, name, pictures) for name in names)
            + cells_table(plan, results, names, repeat) + "</body></html>\n")
    stores.write_whole(output, page.encode())
