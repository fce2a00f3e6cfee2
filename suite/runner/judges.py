"""What a program's log says of the program, and whether the run has succeeded.

The criteria (docs/suite.md): hop counts equal the breadth-first distance 10 s after the last start,
over the links and between the robots that work then;
fireflies have an order parameter of 0.95 or more at the end, and 90 % of them flash within one
flash length; followers go round five times, keep their distance, and touch nobody.
"""
import bisect
import cmath
import collections
import math
import statistics

import scenarios
from run_log import Log, breadth_first

TICK_S = 0.032768
PERIOD_S = 120 * TICK_S
FLASH_S = 8 * TICK_S
JUDGED_AT_S = 10
ORDER_LIMIT = 0.95
REVOLUTIONS = 5
UNREACHED = 100       # hops of a robot that hears of no seed
NEWS_JUDGED = 2 / 3   # of a run: what is told later may still be on its way at the end
NEWS_ALL = 0.95       # of the robots in reach have heard: as good as all
NEWS_TTL = 15         # if the scenario does not say


def hop_count(log: Log) -> dict:
    """wrong_hops at the judged time; converged_s after the start, or None; too_short if the run
    ended before it could be judged."""
    starts, start = log.starts(), log.start_s()
    judged = start + JUDGED_AT_S
    links, dead = log.links_at(judged), log.dead(judged)
    wrong, converged, seeds_heard = 0, 0.0, True
    for number in range(1, 3 if log.program == "hop_count_two_seeds" else 2):
        seed = next(i for i, r in enumerate(log.scenario["robots"]) if r.get("role") == number)
        right = {} if seed in dead else breadth_first(links, seed)
        seeds_heard &= len(right) > 1
        name = f"hops_{number}"
        found = log.values(name, judged)
        changes = collections.defaultdict(list)
        for e in log.of("value"):
            if e["name"] == name:
                changes[e["robot"]].append((e["t"] / 1e6, e["value"]))
        for robot in set(range(log.robots)) - dead:
            hops = right.get(robot, UNREACHED)
            wrong += found.get(robot) != hops
            first = next((t for t, value in changes[robot]
                          if value == hops and t >= starts.get(robot, 0)), math.inf)
            converged = max(converged, first - start)
    short = log.end_s() < judged
    return {"wrong_hops": wrong, "converged_s": converged if converged < math.inf else None,
            "success": wrong == 0 and seeds_heard and not short} | (
                {"too_short": True} if short else {})


def flashes(log: Log) -> dict[int, list[float]]:
    """Times in s of each robot's flashes."""
    result = collections.defaultdict(list)
    for e in log.of("value"):
        if e["name"] == "flash":
            result[e["robot"]].append(e["t"] / 1e6)
    return result


def order_parameter(times: dict[int, list[float]], at_s: float) -> float:
    """|mean of exp(i phase)|, 1 when all flash together; each phase runs from flash to flash."""
    total, count = 0j, 0
    for each in times.values():
        i = bisect.bisect_right(each, at_s)
        if 0 < i < len(each):
            phase = (at_s - each[i - 1]) / (each[i] - each[i - 1])
            total += cmath.exp(2j * math.pi * phase)
            count += 1
    return abs(total) / count if count else 0.0


def most_in_window(times: dict[int, list[float]], begin_s: float, end_s: float) -> int:
    """Most robots that flash within FLASH_S of each other, between two times."""
    marks = sorted((t, robot) for robot, each in times.items() for t in each
                   if begin_s <= t < end_s)
    best, first = 0, 0
    for last, (time, _) in enumerate(marks):
        while time - marks[first][0] > FLASH_S:
            first += 1
        best = max(best, len({robot for _, robot in marks[first:last + 1]}))
    return best


def firefly(log: Log) -> dict:
    """order, together (share of robots in one flash window at the end), synchronised_s or None."""
    times = flashes(log)
    start, end = log.start_s(), log.end_s()
    living = log.robots - len(log.dead(end))
    order = order_parameter(times, end - 1.5 * PERIOD_S)
    share = most_in_window(times, end - 2.5 * PERIOD_S, end) / max(1, living)
    synchronised = None
    at = start
    while at + PERIOD_S < end:
        if most_in_window(times, at, at + 1.5 * PERIOD_S) >= 0.9 * living:
            synchronised = at + PERIOD_S - start
            break
        at += PERIOD_S
    spread = None
    last = sorted(each[-2] for each in times.values() if len(each) > 2)
    if len(last) > 2:  # modulo the period, around the mean direction
        mean = cmath.phase(sum(cmath.exp(2j * math.pi * t / PERIOD_S) for t in last))
        offsets = [(t / PERIOD_S - mean / (2 * math.pi) + 0.5) % 1 - 0.5 for t in last]
        spread = statistics.pstdev(offsets) * PERIOD_S
    return {"order": order, "together": share, "synchronised_s": synchronised,
            "spread_s": spread, "success": order >= ORDER_LIMIT and share >= 0.9}


def overlaps(log: Log) -> int:
    """Poses at which a body stands in another's, where no simulated world counts contacts."""
    body_mm = scenarios.BODY_MM[log.scenario["platform"]]
    at = {i: (p["x_mm"], p["y_mm"]) for i, p in enumerate(log.scenario["robots"])}
    found = 0
    for e in log.of("pose"):
        here = at[e["robot"]] = e["x_mm"], e["y_mm"]
        found += any(math.dist(here, there) < body_mm
                     for robot, there in at.items() if robot != e["robot"])
    return found


def edge_following(log: Log) -> dict:
    """revolutions (fewest), distance_error (mean, in Kilobot mm), contacts; times_waited for a seed
    that was another's, and times_asked of one that had not answered yet."""
    places = log.scenario["robots"]
    unit = scenarios.BODY_MM[log.scenario["platform"]] / 33
    seeds = [p for p in places if p["role"] == scenarios.EDGE_SEED]
    x0 = statistics.mean(p["x_mm"] for p in seeds)
    y0 = statistics.mean(p["y_mm"] for p in seeds)
    turned, errors = [], []
    for robot, place in enumerate(places):
        if place["role"] != scenarios.EDGE_FOLLOWER:
            continue
        angle, last = 0.0, math.atan2(place["y_mm"] - y0, place["x_mm"] - x0)
        for e in log.of("pose"):
            if e["robot"] != robot:
                continue
            now = math.atan2(e["y_mm"] - y0, e["x_mm"] - x0)
            angle -= (now - last + math.pi) % (2 * math.pi) - math.pi
            last = now
            nearest = min(math.hypot(e["x_mm"] - s["x_mm"], e["y_mm"] - s["y_mm"]) for s in seeds)
            errors.append(abs(nearest / unit - 60))
        turned.append(angle / (2 * math.pi))
    waits = [e["value"] for e in log.of("value") if e["name"] == "waits"]
    ends = log.of("end")
    is_counted = bool(ends) and all("contacts" in e for e in ends)
    contacts = sum(e["contacts"] for e in ends) if is_counted else overlaps(log)
    revolutions = min(turned, default=0)
    error = statistics.mean(errors) if errors else None
    return {"revolutions": revolutions, "distance_error": error, "contacts": contacts,
            "times_waited": waits.count(2), "times_asked": waits.count(1),
            "success": revolutions >= REVOLUTIONS and contacts == 0 and error < 10}


def news_told_and_heard(log: Log) -> tuple[dict, dict]:
    """(teller, story): time it was told; (teller, story): {robot: when it first heard}. In s."""
    told, heard = {}, collections.defaultdict(dict)
    for e in log.of("value"):
        if e["name"] == "told":
            told[e["robot"], e["value"] % 256] = e["t"] / 1e6
        elif e["name"] == "heard":
            heard[divmod(e["value"], 256)].setdefault(e["robot"], e["t"] / 1e6)
    return told, heard


def news(log: Log) -> dict:
    """delivery (share of the robots that the TTL reaches who heard, over the news told in the first
    NEWS_JUDGED of the run), heard (share of all other robots), latency of the first copy,
    converged_s (until NEWS_ALL of them have heard, on average over the news that came so far),
    whole (share of news that all in reach heard), packets each robot sends a second, spliced
    (messages put together from two)."""
    told, heard = news_told_and_heard(log)
    ttl = log.scenario.get("message", {}).get("ttl", NEWS_TTL)
    reached, delays, last, expected, all_heard, by = {}, [], [], 0, 0, 0
    judged = [key for key, time in told.items()
              if time <= log.start_s() + NEWS_JUDGED * (log.end_s() - log.start_s())]
    links = log.links()
    for teller, story in judged:
        if teller not in reached:
            reached[teller] = {r for r, hops in breadth_first(links, teller).items()
                               if 0 < hops <= ttl + 1}
        times = sorted(time - told[teller, story] for robot, time in heard[teller, story].items()
                       if robot in reached[teller])
        expected += len(reached[teller])
        by += len(heard[teller, story])
        delays += times
        wanted = math.ceil(NEWS_ALL * len(reached[teller]))
        if wanted and len(times) >= wanted:
            last.append(times[wanted - 1])
        all_heard += len(times) == len(reached[teller])
    delays.sort()
    spliced = sum(log.values("spliced").values())
    delivery_ratio = len(delays) / expected if expected else None
    others = len(judged) * (log.robots - 1)
    result = {"delivery": delivery_ratio, "heard": by / others if others else None,
              "whole": all_heard / len(judged) if judged else None,
              "latency_p50_s": delays[len(delays) // 2] if delays else None,
              "latency_p99_s": delays[int(len(delays) * 0.99)] if delays else None,
              "converged_s": statistics.mean(last) if last else None, "spliced": spliced,
              "success": bool(expected) and delivery_ratio >= NEWS_ALL and spliced == 0}
    if log.air and log.air.get("sent") is not None and log.end_s() > 0:
        result["packets_per_s"] = log.air["sent"] / log.robots / log.end_s()
    return result
