"""What a run's log says, in numbers, and whether the run has succeeded.

The criteria (docs/suite.md): hop counts equal the breadth-first distance 10 s after the last start,
over the links and between the robots that work then;
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
UNREACHED = 100       # hops of a robot that hears of no seed
NEWS_JUDGED = 2 / 3   # of a run: what is told later may still be on its way at the end
NEWS_ALL = 0.95       # of the robots in reach have heard: as good as all
NEWS_TTL = 15         # if the scenario does not say
MESSAGE_NUMBERS = 16  # of the compared packets
AIR_US = {"sim-kilobot": 4600, "kilobot-emulated": 4371, "sim-coachbot": 300}  # of one packet


class LogError(Exception):
    """A file that is not a log of a run: one line that says why."""


class Log:
    """One run's log, read: the scenario and the events by robot and kind."""

    def __init__(self, path: str):
        """Raises LogError when it is none."""
        try:
            with open(path, encoding="utf-8") as file:
                self.scenario = json.loads(file.readline())
                lines = file.readlines()
            if lines and not lines[-1].endswith("}\n"):
                lines.pop()  # what was being written when the run was cut off
            self.events = [json.loads(line) for line in lines]
            self.robots = len(self.scenario["robots"])
            self.air = next((e for e in self.events if e["event"] == "air"), None)
            self.program, self.platform = self.scenario["program"], self.scenario["platform"]
        except (ValueError, KeyError, TypeError, IndexError) as error:
            raise LogError(f"{path} is not a log of a run") from error

    def of(self, kind: str) -> list[dict]:
        """Events of a kind, in the order of the log."""
        return [e for e in self.events if e["event"] == kind]

    def starts(self) -> dict[int, float]:
        """When each robot's program started, for the last time, in s."""
        return {e["robot"]: e["t"] / 1e6 for e in self.of("start")}

    def start_s(self) -> float:
        """When the last robot's program started."""
        return max(self.starts().values(), default=0)

    def end_s(self) -> float:
        """How far the run went; without a last line that says so, as far as it tells."""
        if self.air:
            return self.air["seconds"]
        return max((e["t"] for e in self.events), default=0) / 1e6

    def is_whole(self) -> bool:
        """Whether it went to the scenario's end."""
        return self.air is not None and self.end_s() >= self.scenario["seconds"] - 1e-3

    def faults(self, at_s: float) -> list[dict]:
        """Those that have begun by a time and are not over, in their order."""
        faults = sorted(self.scenario.get("faults", []), key=lambda f: f.get("at_s", 0))
        return [f for f in faults if f.get("at_s", 0) <= at_s < f.get("end_s", math.inf)]

    def dead(self, at_s: float) -> set[int]:
        """Robots that have died by a time and not been started again."""
        dead = set()
        for fault in self.faults(at_s):
            if fault["kind"] == "death":
                dead.add(fault["robot"])
            elif fault["kind"] == "restart":
                dead.discard(fault["robot"])
        return dead

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

    def links_at(self, at_s: float) -> dict[int, list[int]]:
        """The links that work at a time, of robots that stand where they began."""
        dead, links = self.dead(at_s), self.links()
        for fault in self.faults(at_s):
            links = {i: [j for j in to if not self.breaks(fault, i, j)] for i, to in links.items()}
        return {i: [] if i in dead else [j for j in to if j not in dead]
                for i, to in links.items()}

    def breaks(self, fault: dict, sender: int, receiver: int) -> bool:
        """Whether a fault takes the link between two robots."""
        a, b = self.scenario["robots"][sender], self.scenario["robots"][receiver]
        if fault["kind"] == "partition":
            return (a["x_mm"] < fault["x_mm"]) != (b["x_mm"] < fault["x_mm"])
        return fault["kind"] == "jam" and math.hypot(
            b["x_mm"] - fault["x_mm"], b["y_mm"] - fault["y_mm"]) <= fault["radius_mm"]


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
    contacts = (sum(e["contacts"] for e in ends) if all("contacts" in e for e in ends)
                else overlaps(log))
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


class Sent:
    """What each robot has sent on each channel; who starts anew numbers anew.

    A robot's first number is drawn. Where the log does not tell the numbers of what is sent: what
    is received is nearly always what its sender has sent last, so the first number is the one by
    which that holds most often. So `learn` what was received, then begin again (`rewind`) and ask
    for its `place`.
    """

    def __init__(self):
        self.times = collections.defaultdict(list)   # (robot, channel): us
        self.before = collections.Counter()          # the same: how many in earlier lives
        self.lives = collections.Counter()           # robot: how often it has started
        self.ahead = collections.defaultdict(collections.Counter)  # by how much numbers run ahead
        self.told = {}                               # the same, where the log tells it

    def rewind(self):
        self.times.clear()
        self.before.clear()
        self.lives.clear()

    def restart(self, robot: int):
        """From now on the robot's messages have other numbers."""
        self.lives[robot] += 1
        for key, times in self.times.items():
            if key[0] == robot:
                self.before[key] = len(times)

    def count(self, key: tuple) -> int:
        """Messages of a channel in this life."""
        return len(self.times[key]) - self.before[key]

    def add(self, event: dict):
        key = event["robot"], event["channel"]
        self.times[key].append(event["t"])
        if "message" in event:
            self.told[*key, self.lives[key[0]]] = (
                event["message"] - self.count(key)) % MESSAGE_NUMBERS

    def learn(self, key: tuple, number: int):
        if self.count(key) > 0:
            self.ahead[*key, self.lives[key[0]]][(number - self.count(key)) % MESSAGE_NUMBERS] += 1

    def place(self, key: tuple, number: int) -> int | None:
        """Which of a channel's messages, from 0, has a number: the latest such."""
        count = self.count(key)
        life = *key, self.lives[key[0]]
        learnt = self.ahead[life].most_common(1)
        ahead = self.told.get(life, learnt[0][0] if learnt else 0)
        k = count - (count + ahead - number) % MESSAGE_NUMBERS
        return self.before[key] + k - 1 if k >= 1 else None


def senders_and_links(log: Log) -> tuple[dict, dict]:
    """Who (node id, receiver) is, and who is known to hear each robot.

    Ids drawn at random may be the same of two robots with a common neighbour. Whose messages it
    gets cannot be told, so these links count neither as heard nor as lost.
    """
    links = log.links()
    found = collections.defaultdict(set)
    for e in log.of("start") + log.of("end"):
        if "node" in e:
            for receiver in links[e["robot"]]:
                found[e["node"], receiver].add(e["robot"])
    unclear = {(robot, receiver) for (_, receiver), robots in found.items() if len(robots) > 1
               for robot in robots}
    return ({key: next(iter(robots)) for key, robots in found.items() if len(robots) == 1},
            {robot: [r for r in to if (robot, r) not in unclear] for robot, to in links.items()})


def messages(log: Log) -> dict:
    """delivery ratio, latency quantiles and age of information, from sent and received messages.

    A received message names its number modulo MESSAGE_NUMBERS: it is the sender's latest such.
    """
    senders, links = senders_and_links(log)
    sent = Sent()
    latency, ages, delivered, last = [], [], set(), {}
    order = {"start": 0, "sent": 1, "received": 2}
    events = sorted((e for e in log.events if e["event"] in order),
                    key=lambda e: (e["t"], order[e["event"]]))
    for e in events:
        if e["event"] == "start":
            sent.restart(e["robot"])
        elif e["event"] == "sent":
            sent.add(e)
        elif (e["node"], e["robot"]) in senders:
            sent.learn((senders[e["node"], e["robot"]], e["channel"]), e["message"])
    sent.rewind()
    for e in events:
        if e["event"] == "start":
            sent.restart(e["robot"])
            continue
        if e["event"] == "sent":
            sent.add(e)
            continue
        sender = senders.get((e["node"], e["robot"]))
        if sender is None:
            continue
        key = sender, e["channel"]
        place = sent.place(key, e["message"])
        if place is None:
            continue
        time = sent.times[key][place]
        latency.append((e["t"] - time) / 1e6)
        delivered.add((*key, place, e["robot"]))
        if (*key, e["robot"]) in last:
            ages.append((e["t"] - last[*key, e["robot"]]) / 1e6)
        last[*key, e["robot"]] = time
    if not delivered:
        return {"delivery": None}
    latency.sort()
    return {"delivery": delivery(log, links, sent.times, delivered),
            "latency_p50_s": latency[len(latency) // 2],
            "latency_p99_s": latency[int(len(latency) * 0.99)],
            "peak_age_s": statistics.mean(ages) if ages else None}


def delivery(log: Log, links: dict, sent: dict, delivered: set) -> float | None:
    """Messages received, of those sent times the living robots in range; None if robots move."""
    if log.program == "edge_following":
        return None
    has_deaths = any(f["kind"] == "death" for f in log.scenario.get("faults", []))
    expected = received = 0
    for (robot, channel), times in sent.items():
        # The message that is still being sent at the end is nobody's loss.
        for place, time in enumerate(times[:-1]):
            dead = log.dead(time / 1e6) if has_deaths else ()
            for other in links[robot]:
                if other not in dead:
                    expected += 1
                    received += (robot, channel, place, other) in delivered
    return received / expected if expected else None


def channel_load(log: Log) -> dict:
    """Share of time in which a robot's air is taken, on average (packets that overlap count each),
    and packets lost to collisions."""
    air_us = log.scenario["radio"].get("air_us", AIR_US.get(log.platform))
    if not log.air or not log.air.get("expected") or air_us is None:
        return {}
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
             firefly if program.startswith("firefly") else
             news if program == "news" else edge_following)
    result = {"program": program, "platform": log.scenario["platform"], "robots": log.robots,
              "seed": log.scenario["seed"], "seconds": log.scenario["seconds"]}
    result |= judge(log) | channel_load(log) | losses(log)
    if program != "news":  # which counts for itself: its messages go many hops
        result |= messages(log)
    if log.air and "stood_still_s" in log.air:
        result["stood_still_s"] = log.air["stood_still_s"]
    if not log.is_whole():
        result |= {"success": False, "interrupted": True}
    return result


# Two-sided 95 % quantiles of Student's t by degrees of freedom.
T_95 = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228]


def quantile_95(freedom: int) -> float:
    """Of Student's t; beyond the table by its expansion around the normal's (Abramowitz and Stegun
    26.7.5), good to 0.003."""
    if freedom <= len(T_95):
        return T_95[freedom - 1]
    z = 1.95996
    return z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)


def interval(values: list[float]) -> tuple[float, float]:
    """Mean and half width of its 95 % confidence interval (0 of a single value)."""
    mean = statistics.mean(values)
    if len(values) < 2:
        return mean, 0.0
    return mean, quantile_95(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))
