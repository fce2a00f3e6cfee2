"""What became of the messages of a run: delivered, late, or lost, and where."""
import collections
import math
import statistics

from platforms import REAL_TIME
from run_log import Log

MESSAGE_NUMBERS = 16  # of the compared packets
EARLY = 3  # messages; in real time a program may tell that it has sent after another has heard it
AIR_US = {"sim-kilobot": 4600, "kilobot-emulated": 4371, "sim-coachbot": 300}  # of one packet


class Sent:
    """What each robot has sent on each channel; who starts anew numbers anew.

    A robot's first number is drawn. Where the log does not tell the numbers of what is sent: what
    is received is nearly always what its sender has sent last, so the first number is the one by
    which that holds most often. So `learn` what was received, then begin again (`rewind`) and ask
    for its `place`.

    early: by how many messages the log may tell of what was sent too late.
    """

    def __init__(self, early: int = 0):
        self.early = early
        self.times = collections.defaultdict(list)   # (robot, channel): us
        self.all_times = {}                          # the same, of the whole log, after rewind()
        self.before = collections.Counter()          # the same: how many in earlier lives
        self.lives = collections.Counter()           # robot: how often it has started
        self.ahead = collections.defaultdict(collections.Counter)  # by how much numbers run ahead
        self.told = {}                               # the same, where the log tells it

    def rewind(self):
        self.all_times = {key: list(times) for key, times in self.times.items()}
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
        """Which of a channel's messages, from 0, has a number: the latest such, or one that is
        about to be told of."""
        count = self.count(key)
        life = *key, self.lives[key[0]]
        learnt = self.ahead[life]
        ahead = self.told.get(life, max(learnt, key=learnt.get, default=0))
        k = count - (count + ahead - number) % MESSAGE_NUMBERS
        if k <= count - MESSAGE_NUMBERS + self.early:
            k += MESSAGE_NUMBERS
        place = self.before[key] + k - 1
        return place if k >= 1 and place < len(self.all_times.get(key, ())) else None


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
    sent = Sent(EARLY if log.platform in REAL_TIME else 0)
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
        time = sent.all_times[key][place]
        latency.append(max(e["t"] - time, 0) / 1e6)
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
    """Messages received, of those sent times the living robots in range whose programs ran then;
    None if robots move."""
    if log.program == "edge_following":
        return None
    has_deaths = any(f["kind"] == "death" for f in log.scenario.get("faults", []))
    begins, ends = log.times_of_programs()
    expected = received = 0
    for (robot, channel), times in sent.items():
        # The message that is still being sent at the end is nobody's loss.
        for place, time in enumerate(times[:-1]):
            dead = log.dead(time / 1e6) if has_deaths else ()
            for other in links[robot]:
                runs = begins.get(other, 0) <= time < ends.get(other, math.inf)
                if runs and other not in dead:
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
