"""Platform kilobot-emulated: firmware images in kilobot-emulator, whose log becomes a suite's log.

What programs on a Kilobot cannot write down is read off the air and out of their memory: a message
counts as received when all its packets have arrived undamaged at the robot's comparator, and as
sent when the one before it had left (hop counts, edge following) or with the flash (fireflies).
Bodies move as the image drives the motors' pins.
"""
import collections
import json
import math
import pathlib
import re
import shutil
import subprocess
import tempfile

import limits
from scenarios import EDGE_SEED

RUN_AT_S = 0.5    # by then all robots are switched on and listen
SAMPLE_US = 1000  # the emulator looks at memory so often
SETUP_US = 10000  # after RUN; a robot's setup() is over
FRAME_US = 4371   # a message in the air, and its first to its last pulse
RUN = 0x88  # types of infrared messages
PACKETS = {2, *range(0x60, 0x80)}  # with a report of its sender or not
LED_LEVELS = 3
COUNTS_PER_MM = 6  # of a signal's strength, as the emulator has it

# By program: the image, the variables that it tells the place of (and whether the first value
# counts), and the uids that make its robots' roles (role: first uid).
IMAGES = {
    "hop_count": ("hop_count_one_seed", {"hops_1": True}, {1: 1}),
    "hop_count_two_seeds": ("hop_count", {"hops_1": True, "hops_2": True}, {1: 1, 2: 2}),
    "firefly": ("firefly", {"flash": False}, {}),
    "firefly_no_delay": ("firefly_no_delay", {"flash": False}, {}),
    "edge_following": ("edge_following", {}, {EDGE_SEED: 1}),
}
FIRST_FREE_UID = 10

# What a scenario file may say here, and what it is for the emulator: (section, key), factor.
SETTINGS = {
    ("radio", "range_mm"): ("medium", "range_mm", 1),
    ("radio", "loss"): ("medium", "loss", 1),
    ("clock", "drift_ppm"): ("", "drift_ppm", 1),
    ("clock", "power_on_spread_us"): ("", "power_on_spread_ms", 0.001),
    ("body", "speed_bias"): ("", "motor_bias", 1),
    ("body", "motion_noise"): ("", "motor_noise", 1),
}


class EmulationError(Exception):
    """One line for the user: what cannot be emulated, and what to do."""


def symbols_of(image: pathlib.Path) -> list[tuple[int, int, str]]:
    """Value, size and name of the symbols of an image that have a size."""
    tool = shutil.which("avr-nm")
    if tool is None:
        raise EmulationError("no avr-nm: apt-get install gcc-avr avr-libc")
    table = subprocess.run([tool, "-S", image], capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in table.splitlines()]
    return [(int(line[0], 16), int(line[1], 16), line[3]) for line in lines if len(line) == 4]


def variables_of(image: pathlib.Path) -> dict[str, str]:
    """What to watch for each variable that an image names (SWARMTALK_KILOBOT_OFFSET): by name."""
    symbols = symbols_of(image)
    rooms = [name for _, _, name in symbols if "Joined" in name and name.endswith("room_E")]
    if len(rooms) != 1:
        raise EmulationError(f"{image}: is not an image of the suite")
    return {name.removeprefix("offset_"): f"{rooms[0]}+{offset}:{size}"
            for offset, size, name in symbols if name.startswith("offset_")}


def fields_of(image: pathlib.Path) -> dict[str, tuple[int, int]]:
    """The fields of a packet as an image sends it: first bit and how many, by name."""
    return {name.removeprefix("field_"): (at, bits)
            for at, bits, name in symbols_of(image) if name.startswith("field_")}


def watched_of(program: str, image: pathlib.Path) -> dict[str, str]:
    """The variables of a program's runs: name by what the emulator calls it."""
    variables = variables_of(image)
    missing = [name for name in IMAGES[program][1] if name not in variables]
    if missing:
        raise EmulationError(f"{image}: does not tell where {' and '.join(missing)} lies; build "
                             "the target kilobot_images again")
    return {variables[name]: name for name in IMAGES[program][1]}


def settings_of(scenario: dict) -> dict[str, dict]:
    """The emulator's own settings by section ("" is the file's top)."""
    result = {"": {"drift_ppm": 5000, "power_on_spread_ms": 250}, "medium": {}}
    if scenario["program"] == "edge_following":  # bodies as imperfect as the simulator's
        result[""] |= {"motor_bias": 0.05, "motor_noise": 0.1, "noise_counts": COUNTS_PER_MM}
    for section in ("radio", "clock", "body"):
        for key, value in scenario.get(section, {}).items():
            if (section, key) not in SETTINGS:
                raise EmulationError(f"kilobot-emulated: [{section}] has no key '{key}'; there is: "
                                     + " ".join(".".join(k) for k in SETTINGS))
            limits.check_number(value, limits.SECTIONS[section][key], f"[{section}] {key}")
            table, name, factor = SETTINGS[section, key]
            result[table][name] = value * factor
    if scenario["faults"]:
        raise EmulationError("kilobot-emulated knows no faults: leave [[fault]] out, or use "
                             "sim-kilobot")
    return result


def uids_of(scenario: dict) -> list[int]:
    """A uid for each robot: the images find their roles by it. Robots of one role count on."""
    roles = dict(IMAGES[scenario["program"]][2])
    uids = []
    for i, place in enumerate(scenario["robots"]):
        uids.append(roles.get(place["role"], FIRST_FREE_UID + i))
        if place["role"] in roles:
            roles[place["role"]] += 1
    return uids


def emulator_file(scenario: dict, image: pathlib.Path, watched: list[str]) -> str:
    """The scenario as the emulator reads it (TOML)."""
    settings = settings_of(scenario)
    root = settings[""] | {
        "seconds": scenario["seconds"], "seed": scenario["seed"], "log_heard": True,
        "lamp": [f"run@{RUN_AT_S}"], "watch": watched}
    tables = [("", root), ("[medium]", settings["medium"])]
    for place, uid in zip(scenario["robots"], uids_of(scenario)):
        tables.append(("[[robot]]", {
            "image": str(image), "uid": uid, "x_mm": place["x_mm"], "y_mm": place["y_mm"],
            "theta_rad": place.get("theta_rad", 0.0)}))
    return "".join(header + "\n" + "".join(f"{key} = {json.dumps(value)}\n"
                                           for key, value in table.items())
                   for header, table in tables)


def find_image(scenario: dict, images: pathlib.Path) -> pathlib.Path:
    """The program's firmware. Raises EmulationError."""
    image = images / (IMAGES[scenario["program"]][0] + ".elf")
    if not image.exists():
        raise EmulationError(f"no {image}: build the target kilobot_images (apt-get install "
                             "gcc-avr avr-libc)")
    return image


def run(scenario: dict, log: pathlib.Path, emulator: str, images: pathlib.Path, call):
    """One run. @param call  runs a command to its end; raises if that fails"""
    image = find_image(scenario, images)
    with tempfile.TemporaryDirectory(prefix="swarmtalk-suite-") as folder:
        file, raw = pathlib.Path(folder, "scenario.toml"), pathlib.Path(folder, "log.jsonl")
        watched = watched_of(scenario["program"], image)
        file.write_text(emulator_file(scenario, image, list(watched)), encoding="utf-8")
        call([emulator, "--scenario", file, "--log", raw])
        events = Conversion(scenario, raw, watched, fields_of(image)).events()
    with open(log, "w", encoding="utf-8") as output:
        for event in [scenario] + events:
            output.write(json.dumps(event, separators=(",", ":")) + "\n")


class Packet:
    """A SwarmTalk packet's header. @param fields  as the image tells them"""

    def __init__(self, text: str, fields: dict[str, tuple[int, int]]):
        def value(name: str) -> int:
            at, bits = fields[name]
            return int(text, 16) >> (4 * len(text) - at - bits) & (1 << bits) - 1
        self.node = value("node")
        self.message = value("message")
        self.sequence = value("sequence")
        self.end = bool(value("end"))
        self.channel = value("channel")


class Conversion:
    """One run of the emulator, read."""

    def __init__(self, scenario: dict, raw: pathlib.Path, watched: dict[str, str],
                 fields: dict[str, tuple[int, int]]):
        self.scenario = scenario
        self.watched = watched
        self.fields = fields
        self.by_kind = collections.defaultdict(list)
        with open(raw, encoding="utf-8") as file:
            for line in file:
                event = json.loads(line)
                name = re.fullmatch(r"k(\d+)", event["node"])
                if name:
                    self.by_kind[event["event"]].append(event | {"robot": int(name[1])})
        self.starts = {}
        for e in self.by_kind["heard"]:
            if e["type"] == RUN and e["crc_ok"]:
                self.starts.setdefault(e["robot"], e["time_us"])

    def frames(self, kind: str) -> list[tuple[int, int, Packet, str]]:
        """Packets "sent" or "heard" undamaged: time, robot, packet, bytes."""
        return [(e["time_us"], e["robot"], Packet(e["data"], self.fields), e["data"])
                for e in self.by_kind[kind] if e["type"] in PACKETS and e["crc_ok"]]

    def events(self) -> list[dict]:
        """The suite's events, in order of time, and the air's figures."""
        sent = self.frames("sent")
        found = self.shown() + self.sent_messages(sent) + self.received_messages()
        ids = collections.defaultdict(list)
        for _, robot, packet, _ in sent:
            ids[robot].append(packet.node)
        for robot, time in self.starts.items():
            found.append({"t": time, "robot": robot, "event": "start"}
                         | ({"node": ids[robot][0]} if ids[robot] else {}))
        for e in self.by_kind["pose"]:
            found.append({"t": e["time_us"], "robot": e["robot"], "event": "pose",
                          "x_mm": round(e["x_mm"], 1), "y_mm": round(e["y_mm"], 1),
                          "theta": round(e["theta_rad"], 3)})
        found.sort(key=lambda e: e["t"])
        ends = self.by_kind["end"]
        for e in ends:
            robot = e["robot"]
            found.append({"t": e["time_us"], "robot": robot, "event": "end"}
                         | ({"node": ids[robot][-1]} if ids[robot] else {})
                         | {"packets_sent": len(ids[robot]), "resets": e["resets"],
                            "stack_free_bytes": e.get("stack_free_bytes")})
        seconds = max((e["time_us"] for e in ends), default=0) / 1e6
        return found + [{"event": "air", "seconds": seconds} | self.air(sent)]

    def shown(self) -> list[dict]:
        """LEDs and watched values from the start of a robot's program on."""
        series = collections.defaultdict(list)  # (robot, event, name, first counts): (t, fields)
        for e in self.by_kind["led"]:
            rgb = [255 * e[colour] // LED_LEVELS for colour in ("red", "green", "blue")]
            series[e["robot"], "led", "", True].append((e["time_us"], {"rgb": rgb}))
        counts_first = IMAGES[self.scenario["program"]][1]
        for e in self.by_kind["variable"]:
            name = self.watched[e["name"]]
            series[e["robot"], "value", name, counts_first[name]].append(
                (e["time_us"], {"name": name, "value": e["value"]}))
        found = []
        for (robot, kind, _, first), changes in series.items():
            if robot not in self.starts:
                continue
            start = self.starts[robot]
            before = [fields for t, fields in changes if t <= start + SETUP_US]
            if first and before:
                found.append({"t": start, "robot": robot, "event": kind} | before[-1])
            found += [{"t": t, "robot": robot, "event": kind} | fields
                      for t, fields in changes if t > start + SETUP_US]
        return found

    def sent_messages(self, sent) -> list[dict]:
        """A message is sent when its publisher is given it."""
        flashes = collections.defaultdict(list)
        if self.scenario["program"].startswith("firefly"):
            for e in self.by_kind["variable"]:
                flashes[e["robot"]].append(e["time_us"])
        found, number, given = [], {}, {}
        for time, robot, packet, _ in sent:
            key = robot, packet.channel
            if number.get(key) != packet.message:
                number[key] = packet.message
                at = given.get(key, self.starts.get(robot, time))
                at = max((t for t in flashes[robot] if t <= time + SAMPLE_US), default=at)
                found.append({"t": min(at, time), "robot": robot, "event": "sent",
                              "channel": packet.channel, "message": packet.message})
            given[key] = time
        return found

    def received_messages(self) -> list[dict]:
        """A message is received when the last of its packets arrives."""
        found = []
        parts = {}  # (robot, node, channel): number, sequences, how many there are
        own = {}    # a robot's own light reaches its comparator, too
        for _, robot, packet, text in self.frames("sent"):
            own.setdefault(robot, set()).add(packet.node)
        for time, robot, packet, _ in self.frames("heard"):
            if packet.node in own.get(robot, ()):
                continue
            key = robot, packet.node, packet.channel
            if key not in parts or parts[key][0] != packet.message:
                parts[key] = [packet.message, set(), None]
            part = parts[key]
            part[1].add(packet.sequence)
            if packet.end:
                part[2] = packet.sequence + 1
            if part[2] == len(part[1]):
                part[1].add(None)  # once only
                found.append({"t": time, "robot": robot, "event": "received",
                              "channel": packet.channel, "node": packet.node,
                              "message": packet.message})
        return found

    def air(self, sent) -> dict:
        """What became of packets: sent, expected (by robots in range), received, lost."""
        places, reach = self.scenario["robots"], self.scenario["radio"]["range_mm"]
        near = [[j for j, b in enumerate(places) if j != i and
                 math.hypot(a["x_mm"] - b["x_mm"], a["y_mm"] - b["y_mm"]) <= reach]
                for i, a in enumerate(places)]
        heard = collections.defaultdict(list)
        for time, robot, _, text in self.frames("heard"):
            heard[robot, text].append(time)
        times = collections.defaultdict(list)
        for e in self.by_kind["sent"]:
            times[e["robot"]].append(e["time_us"])
        counts = collections.Counter()
        for time, robot, _, text in sent:
            for other in near[robot]:
                counts["expected"] += 1
                if any(abs(t - time) <= 2 * FRAME_US for t in heard[other, text]):
                    counts["received"] += 1
                elif any(abs(t - time) <= FRAME_US for t in times[other]):
                    counts["lost_while_sending"] += 1
                elif any(abs(t - time) <= FRAME_US for third in near[other] if third != robot
                         for t in times[third]):
                    counts["lost_collision"] += 1
                else:
                    counts["lost_noise"] += 1
        return {"sent": len(sent)} | {key: counts[key] for key in (
            "expected", "received", "lost_collision", "lost_while_sending", "lost_noise")}
