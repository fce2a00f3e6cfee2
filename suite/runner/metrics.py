"""What a run's log says, in numbers, and whether the run has succeeded.

The criteria (docs/suite.md): hop counts equal the breadth-first distance 10 s after the start;
fireflies have an order parameter of 0.95 or more at the end, and 90 % of them flash within one
flash length; followers go round five times, keep their distance, and touch nobody.
"""
import bisect
import cmath
import collections
import json
import math
import statistics

import scenarios

TICK_S = 0.032768
PERIOD_S = 120 * TICK_S
FLASH_S = 8 * TICK_S
JUDGED_AT_S = 10
ORDER_LIMIT = 0.95
REVOLUTIONS = 5
MESSAGE_NUMBERS = 16  # of the compared packets


class Log:
    """One run's log, read: the scenario and the events by robot and kind."""

    def __init__(self, path: str):
        with open(path, encoding="utf-8") as file:
            self.scenario = json.loads(file.readline())
            self.events = [json.loads(line) for line in file if line.endswith("}\n")]
        self.air = next((e for e in self.events if e["event"] == "air"), None)
        self.robots = len(self.scenario["robots"])

    def of(self, kind: str) -> list[dict]:
        """Events of a kind, in the order of the log."""
        return [e for e in self.events if e["event"] == kind]

    def start_s(self) -> float:
        """When the last robot's program started."""
        return max((e["t"] for e in self.of("start")), default=0) / 1e6

    def values(self, name: str, until_s: float = math.inf) -> dict[int, int]:
        """Last logged value of each robot until a time."""
        return {e["robot"]: e["value"] for e in self.of("value")
                if e["name"] == name and e["t"] <= until_s * 1e6}

    def links(self) -> dict[int, list[int]]:
        """Who hears each robot, at the start."""
        logged = {e["robot"]: e["to"] for e in self.of("links")}
        if logged:
            return logged
        places = self.scenario["robots"]
        reach = self.scenario["radio"]["range_mm"]
        return {i: [j for j, b in enumerate(places) if j != i and
                    math.hypot(a["x_mm"] - b["x_mm"], a["y_mm"] - b["y_mm"]) <= reach]
                for i, a in enumerate(places)}


def breadth_first(links: dict[int, list[int]], seed: int) -> dict[int, int]:
    """Hops from `seed` over the links; robots out of reach are not in it."""
    hops = {seed: 0}
    queue = collections.deque([seed])
    while queue:
        robot = queue.popleft()
        for other in links[robot]:
            if other not in hops:
                hops[other] = hops[robot] + 1
                queue.append(other)
    return hops


def hop_count(log: Log) -> dict:
    """wrong_hops at the judged time; converged_s after the start, or None."""
    links = log.links()
    start = log.start_s()
    wrong, converged = 0, 0.0
    for number in (1, 2):
        seeds = [i for i, r in enumerate(log.scenario["robots"]) if r.get("role") == number]
        if not seeds:
            continue
        right = breadth_first(links, seeds[0])
        name = f"hops_{number}"
        found = log.values(name, start + JUDGED_AT_S)
        wrong += sum(found.get(i) != hops for i, hops in right.items())
        changes = collections.defaultdict(list)
        for e in log.of("value"):
            if e["name"] == name:
                changes[e["robot"]].append((e["t"] / 1e6, e["value"]))
        for robot, hops in right.items():
            first = next((t for t, value in changes[robot] if value == hops), math.inf)
            converged = max(converged, first - start)
    return {"wrong_hops": wrong, "converged_s": converged if converged < math.inf else None,
            "success": wrong == 0}


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
    end = log.air["seconds"] if log.air else log.scenario["seconds"]
    start = log.start_s()
    order = order_parameter(times, end - 1.5 * PERIOD_S)
    share = most_in_window(times, end - 2.5 * PERIOD_S, end) / log.robots
    synchronised = None
    at = start
    while at + PERIOD_S < end:
        if most_in_window(times, at, at + 1.5 * PERIOD_S) >= 0.9 * log.robots:
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
    """revolutions (fewest), distance_error (mean, in Kilobot mm), contacts, waited_s."""
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
    waits = sum(e["value"] for e in log.of("value") if e["name"] == "waits")
    ends = log.of("end")
    contacts = (sum(e["contacts"] for e in ends) if all("contacts" in e for e in ends)
                else overlaps(log))
    revolutions = min(turned, default=0)
    error = statistics.mean(errors) if errors else None
    return {"revolutions": revolutions, "distance_error": error, "contacts": contacts,
            "times_waited": waits,
            "success": revolutions >= REVOLUTIONS and contacts == 0 and error < 10}


def messages(log: Log) -> dict:
    """delivery ratio, latency quantiles and age of information, from sent and received messages.

    A received message names its number modulo MESSAGE_NUMBERS: it is the sender's latest such.
    """
    links = log.links()
    nodes = collections.defaultdict(set)  # ids are unique among neighbours only
    for e in log.of("start") + log.of("end"):
        if "node" in e:
            nodes[e["node"]].add(e["robot"])
    sent = collections.defaultdict(list)  # (robot, channel): times
    latency, ages, delivered, last = [], [], set(), {}
    for e in sorted(log.of("sent") + log.of("received"), key=lambda e: e["t"]):
        if e["event"] == "sent":
            sent[e["robot"], e["channel"]].append(e["t"])
            continue
        near = [robot for robot in nodes[e["node"]] if e["robot"] in links[robot]]
        if len(near) != 1:
            continue
        sender = near[0]
        times = sent.get((sender, e["channel"]))
        if not times:
            continue
        # Numbers begin with 1: the k-th message has number k modulo 16.
        k = len(times) - (len(times) - e["message"]) % MESSAGE_NUMBERS
        if k < 1:
            continue
        latency.append((e["t"] - times[k - 1]) / 1e6)
        delivered.add((sender, e["robot"], e["channel"], k))
        key = (sender, e["robot"], e["channel"])
        if key in last:
            ages.append((e["t"] - last[key]) / 1e6)
        last[key] = times[k - 1]
    if not delivered:
        return {"delivery": None}
    static = log.scenario["program"] != "edge_following"
    # The message that is still being sent at the end is nobody's loss.
    expected = sum(max(0, len(times) - 1) * len(links[robot])
                   for (robot, _), times in sent.items())
    latency.sort()
    return {"delivery": min(1.0, len(delivered) / expected) if static and expected else None,
            "latency_p50_s": latency[len(latency) // 2],
            "latency_p99_s": latency[int(len(latency) * 0.99)],
            "peak_age_s": statistics.mean(ages) if ages else None}


def channel_load(log: Log) -> dict:
    """Share of time in which a robot's air is taken, on average, and packets lost to collisions."""
    if not log.air or not log.air.get("expected"):
        return {}
    air_us = log.scenario["radio"].get(
        "air_us", 300 if "coachbot" in log.scenario["platform"] else 4600)
    heard = log.air["expected"] + log.air["sent"]
    return {"channel_load": heard * air_us / 1e6 / log.air["seconds"] / log.robots,
            "collided": log.air["lost_collision"] / log.air["expected"]}


def losses(log: Log) -> dict:
    """lost_kernel, lost_daemon, lost_client: messages that did not reach a program, by place, where
    there are daemons that tell."""
    ends = [e for e in log.of("end") if "lost_kernel" in e]
    return {key: sum(e[key] for e in ends)
            for key in ("lost_kernel", "lost_daemon", "lost_client")} if ends else {}


def evaluate(log: Log) -> dict:
    """All figures of a run."""
    program = log.scenario["program"]
    judge = (hop_count if program.startswith("hop_count") else
             firefly if program.startswith("firefly") else edge_following)
    result = {"program": program, "platform": log.scenario["platform"], "robots": log.robots,
              "seed": log.scenario["seed"], "seconds": log.scenario["seconds"]}
    result |= judge(log) | messages(log) | channel_load(log) | losses(log)
    if log.air and log.air["seconds"] < log.scenario["seconds"] - 1e-3:
        result |= {"success": False, "interrupted": True}
    return result


# Two-sided 95 % quantiles of Student's t by degrees of freedom; beyond, the normal's.
T_95 = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23, 2.20, 2.18, 2.16, 2.14, 2.13,
        2.12, 2.11, 2.10, 2.09, 2.09, 2.08, 2.07, 2.07, 2.06, 2.06, 2.06, 2.05, 2.05, 2.05, 2.04]


def interval(values: list[float]) -> tuple[float, float]:
    """Mean and half width of its 95 % confidence interval (0 of a single value)."""
    mean = statistics.mean(values)
    if len(values) < 2:
        return mean, 0.0
    t = T_95[len(values) - 2] if len(values) <= 31 else 1.96
    return mean, t * statistics.stdev(values) / math.sqrt(len(values))
