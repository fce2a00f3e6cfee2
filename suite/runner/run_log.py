"""The log of a run: what its robots told, in order, and who could hear whom."""
import collections
import json
import math
import pathlib


class LogError(Exception):
    """A file that is not a log of a run: one line that says why."""


class Log:
    """One run's log, read: the scenario and the events by robot and kind."""

    def __init__(self, path: str):
        """Raises LogError when it is none."""
        self.path = pathlib.Path(path)
        try:
            with open(path, encoding="utf-8") as file:
                self.scenario = json.loads(file.readline())
                lines = file.readlines()
            if lines and not lines[-1].endswith("}\n"):
                lines.pop()  # what was being written when the run was cut off
            self.events = json.loads("[" + ",".join(lines) + "]")  # faster than one by one
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

    def times_of_programs(self) -> tuple[dict[int, int], dict[int, int]]:
        """When each robot's program started first, and when it ended, in us. Robots of a lab start
        one after the other, later where the machine is busy."""
        begins = {e["robot"]: e["t"] for e in reversed(self.of("start"))}
        return begins, {e["robot"]: e["t"] for e in self.of("end")}

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
        if logged and len(logged) < self.robots:
            raise LogError(f"{self.path} is not a whole log: it was cut off while it began")
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
