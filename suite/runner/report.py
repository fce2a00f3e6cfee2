"""One self-contained HTML page of a folder's logs: the paper's figures, with numbers under them."""
import collections
import html
import io
import json
import math
import os
import pathlib
import sys
import urllib.parse

import judges
import metrics
import paper
import platforms
import run_log
import scenarios


def figure_text(figure) -> str:
    """A figure as SVG to put into the page."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", bbox_inches="tight")
    text = buffer.getvalue()
    return text[text.index("<svg"):]


def borders(axes, counts: dict[int, tuple[float, float, int]], colour: str):
    """Lines between the hop counts of robots: x and y in mm, count."""
    if len({x for x, _, _ in counts.values()}) < 2 or len({y for _, y, _ in counts.values()}) < 2:
        return  # on one line there is nothing to draw a border through
    xs, ys, hops = zip(*counts.values())
    if max(hops) > min(hops) and len(counts) > 3:
        axes.tricontour(xs, ys, hops, levels=[h + 0.5 for h in range(min(hops), max(hops))],
                        colors=colour, linewidths=0.8)


def gradient_map(axes, log: run_log.Log):
    """Robots in the colours they showed at the judged time, with the borders between hop counts;
    crosses on those that heard of no seed, grey ones had died."""
    until = log.start_s() + judges.JUDGED_AT_S
    shown = {e["robot"]: e["rgb"] for e in log.of("led") if e["t"] <= until * 1e6}
    for robot in log.dead(until):
        shown.pop(robot, None)
    places = log.scenario["robots"]
    xs, ys = [p["x_mm"] for p in places], [p["y_mm"] for p in places]
    colours = [tuple(c / 255 for c in shown.get(i, (128, 128, 128))) for i in range(len(places))]
    size = 70 * min(1, 36 / len(places))
    for number, colour in ((1, "0.2"), (2, "darkcyan")):
        hops = log.values(f"hops_{number}", until)
        lost = [i for i, count in hops.items() if count >= judges.UNREACHED]
        axes.scatter([xs[i] for i in lost], [ys[i] for i in lost], marker="x", c="white",
                     s=size / 3, linewidths=0.8, zorder=4)
        borders(axes, {i: (xs[i], ys[i], h) for i, h in hops.items() if h < judges.UNREACHED},
                colour)
    axes.scatter(xs, ys, c=colours, s=size, edgecolors="black", linewidths=0.5 * size / 70,
                 zorder=3, rasterized=len(places) > 1000)
    seeds = [p for p in places if p["role"]]
    axes.scatter([p["x_mm"] for p in seeds], [p["y_mm"] for p in seeds], marker="*", c="white",
                 s=size / 2, zorder=5)
    axes.set_aspect("equal")
    edge = 0.1 * (max(xs) - min(xs)) or 10  # contours would cut the outer robots in half
    axes.set_xlim(min(xs) - edge, max(xs) + edge)
    axes.set_ylim(max(ys) + edge, min(ys) - edge)  # row by row from the upper left
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")


def flash_series(axes, log: run_log.Log):
    """Robots flashing at the same time, over the time since the last robot's start."""
    start = log.start_s()
    changes = collections.Counter()
    for each in judges.flashes(log).values():
        for time in each:
            changes[round(time - start, 4)] += 1
            changes[round(time - start + judges.FLASH_S, 4)] -= 1
    times, counts, now = [0.0], [0], 0
    for time in sorted(changes):
        now += changes[time]
        times.append(time)
        counts.append(now)
    axes.step(times, counts, where="post", linewidth=0.4, color="C0")
    axes.axhline(log.robots, color="0.4", linewidth=0.6, linestyle="--")
    axes.set_ylabel("robots flashing")
    axes.set_xlim(0, max(times))
    axes.set_ylim(0, log.robots * 1.08)
    axes.tick_params(labelbottom=False)


def flash_phases(axes, log: run_log.Log):
    """When in a period each robot flashes: a band is order, a cloud is none."""
    start = log.start_s()
    marks = [t - start for each in judges.flashes(log).values() for t in each if t >= start]
    axes.plot(marks, [t % judges.PERIOD_S for t in marks], ".", markersize=1.2, color="C0",
              rasterized=True)
    axes.set_xlim(0, max(marks, default=1))
    axes.set_ylim(0, judges.PERIOD_S)
    axes.set_xlabel("time / s")
    axes.set_ylabel("time in period / s")


def paths(axes, log: run_log.Log):
    """Where the middles of the followers went; seeds as large as they are."""
    from matplotlib.patches import Circle
    places = log.scenario["robots"]
    seeds = [p for p in places if p["role"] == scenarios.EDGE_SEED]
    radius = scenarios.BODY_MM[log.platform] / 2
    for seed in seeds:
        axes.add_patch(Circle((seed["x_mm"], seed["y_mm"]), radius, color="0.6", linewidth=0))
    colours = iter(("tab:red", "tab:blue"))
    for robot, place in enumerate(places):
        if place["role"] == scenarios.EDGE_FOLLOWER:
            poses = [e for e in log.of("pose") if e["robot"] == robot]
            axes.plot([e["x_mm"] for e in poses], [e["y_mm"] for e in poses], linewidth=0.5,
                      color=next(colours, "0.3"))
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")


def news_spread(axes, log: run_log.Log):
    """Share of all other robots that has heard each of the news, over the time since it was told;
    judged ones only."""
    told, heard = judges.news_told_and_heard(log)
    for key, time in told.items():
        if time > log.start_s() + judges.NEWS_JUDGED * (log.end_s() - log.start_s()):
            continue
        times = sorted(t - time for robot, t in heard[key].items() if robot != key[0])
        axes.step([0, *times], [i / (log.robots - 1) for i in range(len(times) + 1)],
                  where="post", linewidth=0.5, color="C0", alpha=0.6)
    axes.set_ylim(0, 1.05)
    axes.set_xlim(left=0)
    axes.set_xlabel("time since it was told / s")
    axes.set_ylabel("share that has heard")


# Title, what draws each row of panels, size of a column in inches, caption.
FIREFLY = ([flash_series, flash_phases], (3.6, 3.2))
FIGURES = {
    "hop_count": ("Gradient from one seed", [gradient_map], (3.2, 3.2),
                  "Colour after 10 s: red is an odd hop count, blue an even one. The star is the "
                  "seed; lines are the borders between hop counts. A cross is a robot that hears "
                  "of no seed; a grey robot is dead."),
    "hop_count_two_seeds": ("Gradients from two seeds", [gradient_map], (3.2, 3.2),
                            "Four colours for two parities: red and green are odd counts from seed "
                            "1 and 2, yellow is both, blue none. Dark lines are borders of the "
                            "counts from seed 1, cyan ones from seed 2; stars are the seeds."),
    "firefly": ("Firefly synchronisation with delay mitigation", *FIREFLY,
                "Above: robots flashing at the same time; the dashed line is all of them. Below: "
                "each flash by its time and its time in the period; a level band is a swarm that "
                "flashes together."),
    "firefly_no_delay": ("Firefly synchronisation without delay mitigation", *FIREFLY,
                         "As in the figure before, but the program takes the arrival of a message "
                         "for the time of the flash."),
    "edge_following": ("Edge following", [paths], (3.2, 3.2), "Paths of the two followers (red, "
                       "blue) around four seeds (grey, to scale)."),
    "news": ("News for the whole swarm", [news_spread], (3.2, 2.6),
             "Each line is a message: the share of the other robots that has heard it."),
}
LABELS = {
    "wrong_hops": "wrong hop counts after 10 s", "converged_s": "last right count first there / s",
    "order": "order parameter at the end", "together": "largest share in one flash",
    "synchronised_s": "90 % in one flash after / s", "spread_s": "spread of flashes / s",
    "revolutions": "revolutions", "distance_error": "mean distance error / Kilobot mm",
    "contacts": "contacts", "times_waited": "stops for a taken seed",
    "times_asked": "stops for a seed's answer", "delivery": "delivery ratio",
    "latency_p50_s": "latency, median / s", "latency_p99_s": "latency, 99 % / s",
    "peak_age_s": "mean peak age / s", "channel_load": "channel load",
    "collided": "packets lost to collisions", "lost_kernel": "messages lost in the kernel",
    "lost_daemon": "messages lost in the daemon", "lost_client": "messages lost in the program",
    "whole": "share of news that all in reach heard",
    "heard": "share of the other robots that heard",
    "spliced": "messages put together from two", "packets_per_s": "packets of a robot / s",
    "stood_still_s": "bodies stood still for want of a processor / s",
}
LABELS_OF_NEWS = {
    "converged_s": "until 95 % have heard / s",
    "delivery": "share of the robots in reach of the TTL that heard",
}
MOST_ACROSS = 4  # panels, or their text is too small to read
HIDDEN = {"program", "platform", "robots", "seed", "seconds", "success", "interrupted",
          "too_short"}
STYLE = """body{font:15px/1.5 serif;max-width:70em;margin:2em auto;padding:0 1em;color:#111}
h1,h2{font-family:sans-serif}figure{margin:1em 0}svg{max-width:100%;height:auto}
table{border-collapse:collapse;font-size:13px}td,th{padding:.15em .8em;text-align:right;
border-bottom:1px solid #ccc;white-space:nowrap}
th:first-child,td:first-child{text-align:left}figcaption{color:#444}"""


def settings(scenario: dict) -> dict[str, str]:
    """All that a run was told but its seed, by flat names: what makes runs comparable."""
    found = {}
    for key, value in scenario.items():
        if key in ("seed", "program"):
            continue
        if key == "robots":
            found["robots"] = str(len(value))
            found["places"] = json.dumps(value)
        elif isinstance(value, dict):
            found |= {f"{key}.{k}": f"{v:g}" for k, v in value.items()}
        elif key == "faults":
            found[key] = ", ".join(f"{f['kind']} at {f.get('at_s', 0):g} s" for f in value) or "no"
            found["each fault"] = json.dumps(value)
        else:
            found[key] = f"{value:g}" if isinstance(value, (int, float)) else str(value)
    return found


def columns(logs: list[run_log.Log]) -> dict[str, list[run_log.Log]]:
    """Runs that differ by nothing but their seed stand together; a column's title tells what makes
    it different from the platform's others."""
    groups = collections.defaultdict(list)
    for log in logs:
        groups[json.dumps(log.scenario | {"seed": 0}, sort_keys=True)].append(log)
    order = {p: i for i, p in enumerate(scenarios.PLATFORMS)}
    found = {}
    for runs in sorted(groups.values(), key=lambda g: (order.get(g[0].platform, 99), g[0].robots)):
        runs.sort(key=lambda log: log.scenario["seed"])
        own = settings(runs[0].scenario)
        others = [settings(g[0].scenario) for g in groups.values()
                  if g[0].platform == runs[0].platform]
        differs = [k for k in dict.fromkeys(k for o in others for k in o)
                   if len({o.get(k) for o in others}) > 1
                   and k not in ("robots", "places", "each fault")]
        title = f"{runs[0].platform}\n{runs[0].robots} robots" + "".join(
            f"\n{k}: {own.get(k, 'as usual')}" for k in differs)
        while title in found:  # differs by places, or by what its faults say
            title += " (other)"
        found[title] = runs
    return found


def label_of(key: str, program: str | None = None) -> str:
    """What a figure is called; some mean something of their own in a program."""
    own = LABELS_OF_NEWS if program == "news" else {}
    return own.get(key) or LABELS.get(key, key)


def number(mean: float, half: float | None) -> str:
    """A mean and half its interval, rounded to two digits of that."""
    if not half:
        return f"{mean:.3g}" + ("" if half is None else " &plusmn; 0")
    digits = min(6, max(0, 1 - math.floor(math.log10(half))))
    return f"{mean:.{digits}f} &plusmn; {half:.{digits}f}"


def table(program: str, runs: dict[str, list[dict]]) -> str:
    """Rows of figures, columns of platforms: mean and 95 % confidence interval. First what the
    paper prints of the program, if it is one of its own."""
    printed = paper.PRINTED.get(program)

    def in_paper(key: str) -> str:
        return "" if printed is None else f"<td>{printed.get(key, '&ndash;')}</td>"

    keys = [k for k in dict.fromkeys(k for rs in runs.values() for r in rs for k in r)
            if k not in HIDDEN]
    heads = "".join(f"<th>{html.escape(p).replace(chr(10), '<br>')}</th>" for p in runs)
    first = "" if printed is None else "<th>the paper</th>"
    lines = [f"<table><tr><th></th>{first}{heads}</tr>",
             "<tr><td>robot of the paper</td>" + ("" if printed is None else "<td>all four</td>")
             + "".join(f"<td>{paper.ROBOTS.get(rs[0]['platform'], '&ndash;')}</td>"
                       for rs in runs.values()) + "</tr>",
             f"<tr><td>robots</td>{in_paper('robots')}" + "".join(
                 f"<td>{rs[0]['robots']}</td>" for rs in runs.values()) + "</tr>",
             f"<tr><td>runs that succeeded</td>{in_paper('success')}" + "".join(
                 f"<td>{sum(r['success'] for r in rs)} of {len(rs)}</td>" for rs in runs.values())
             + "</tr>"]
    for key in keys:
        cells = []
        for rs in runs.values():
            values = [r[key] for r in rs if isinstance(r.get(key), (int, float))]
            mean, half = metrics.interval(values) if values else (0, 0)
            few = f" ({len(values)} runs)" if len(values) < len(rs) else ""
            cells.append(f"<td>{number(mean, half if len(values) > 1 else None)}{few}</td>"
                         if values else "<td>&ndash;</td>")
        lines.append(f"<tr><td>{html.escape(label_of(key, program))}</td>{in_paper(key)}"
                     + "".join(cells) + "</tr>")
    return "\n".join(lines + ["</table>"])


def section(program: str, logs: dict[str, list[run_log.Log]]) -> str:
    """One program: panels for each column (its first run) and the table of all runs."""
    import matplotlib
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": program, "font.family": "sans-serif",
                                "font.size": 8, "axes.linewidth": 0.6, "figure.dpi": 200})
    from matplotlib import pyplot
    title, draws, (width, height), caption = FIGURES[program]
    across = min(max(len(logs), 2), MOST_ACROSS)
    columns_left, text = list(logs.items()), ""
    while columns_left:
        row, columns_left = columns_left[:across], columns_left[across:]
        figure, panels = pyplot.subplots(len(draws), across, squeeze=False, layout="constrained",
                                         figsize=(width * across, height))
        for line, draw in zip(panels, draws):
            for axes, (_, runs) in zip(line, row):
                draw(axes, runs[0])
            for axes in line[len(row):]:
                axes.set_axis_off()
        for axes, (title_above, runs) in zip(panels[0], row):
            axes.set_title(f"{title_above}, seed {runs[0].scenario['seed']}", fontsize=9)
        text += figure_text(figure)
        pyplot.close(figure)
    name = (f"Figure {paper.FIGURES[program]} of the paper." if program in paper.FIGURES else
            "Not in the paper.")
    numbers = {p: [metrics.evaluate(log) for log in runs] for p, runs in logs.items()}
    return (f"<h2>{title}</h2><figure>{text}<figcaption><b>{name}</b> {caption}"
            f"</figcaption></figure>" + table(program, numbers))


def recordings(logs: list[run_log.Log], output: pathlib.Path) -> str:
    """A list of links to the runs' recordings; those that are missing or older than their log are
    made."""
    lines = []
    for log in logs:
        path = log.path.with_suffix(".mcap")
        if not path.exists() or path.stat().st_mtime < log.path.stat().st_mtime:
            platforms.record(log.path)
        link = urllib.parse.quote(os.path.relpath(path, output.parent))
        lines.append(f'<li><a href="{link}">{html.escape(path.name)}</a></li>')
    return ("<h2>Recordings</h2><p>Open one with <code>swarmtalk-view FILE</code>, Foxglove or "
            "Lichtblick.</p><ul>" + "".join(lines) + "</ul>")


def write(folder: str, output: str, with_recordings: bool = False) -> int:
    """Writes the page. Raises ScenarioError when there is nothing to show, PlatformError when a
    recording cannot be made."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise scenarios.ScenarioError(
            "figures need matplotlib: apt-get install python3-matplotlib") from error
    logs = collections.defaultdict(list)
    for path in sorted(pathlib.Path(folder).glob("*.jsonl")):
        try:
            log = run_log.Log(str(path))
            if log.program not in FIGURES:
                raise run_log.LogError(f"{path}: no program {log.program!r}")
            log.links()  # refuses one that was cut off among them
            logs[log.program].append(log)
        except run_log.LogError as error:
            print(f"swarmtalk-suite: {error}; left out", file=sys.stderr)
    if not logs:
        raise scenarios.ScenarioError(f"no logs in {folder}; make some with swarmtalk-suite run")
    sections = []
    for program in FIGURES:
        if program in logs:
            sections.append(section(program, columns(logs[program])))
    recorded = recordings([log for program in FIGURES for log in logs[program]],
                          pathlib.Path(output)) if with_recordings else ""
    page = ("<!DOCTYPE html><html lang=en><head><meta charset=utf-8><title>SwarmTalk benchmark "
            f"suite</title><style>{STYLE}</style></head><body><h1>SwarmTalk benchmark suite</h1>"
            "<p>Programs, each from one source for all platforms. A column is of runs that "
            "differ by nothing but their seed; figures show the first of them, tables give means "
            "of all, and their 95 % confidence intervals if there are several. &quot;The "
            "paper&quot; is Zhang et al., AAMAS 2020, with what it prints in numbers.</p>"
            + "".join(sections) + recorded + "</body></html>\n")
    pathlib.Path(output).write_text(page, encoding="utf-8")
    print(f"{output}: {sum(map(len, logs.values()))} runs")
    return 0
