"""What a run is made of: programs, platforms, places of robots, scenario files.

A scenario is a dict of plain values; resolved, it is the first line of a run's log, and all that a
run needs. Lengths in mm, times in s unless the key says otherwise.
"""
import copy
import math
import tomllib

import limits
from limits import ScenarioError

BODY_MM = {"sim-kilobot": 33, "kilobot-emulated": 33, "sim-coachbot": 110,
           "coachbot-lab": 110, "coachbot-radio": 110, "argos-kilobot": 33, "argos-footbot": 170}
PLATFORMS = tuple(BODY_MM)
PROGRAMS = ("hop_count", "hop_count_two_seeds", "firefly", "firefly_no_delay", "edge_following",
            "news")
FOLLOWER, SEED_1, SEED_2 = 0, 1, 2  # roles of hop count
EDGE_SEED, EDGE_FOLLOWER = 0, 1
TELLER = 1  # role of news
TELLERS = 4  # if the scenario does not say how many
# What is there to be compared with, and need not succeed.
CONTROLS = {"firefly_no_delay": "lacks the correction of delays, to be compared with firefly: it "
                                "need not succeed"}
# Where a program runs that does not run everywhere.
ONLY_ON = {"news": ("sim-kilobot", "sim-coachbot", "coachbot-lab", "coachbot-radio")}

# Two seeds are the upper left and the lower left robot.
LEAST_ROBOTS = {"hop_count": 2, "hop_count_two_seeds": 3, "firefly": 2, "firefly_no_delay": 2,
                "news": 2}

# Between robots of the grid, and how far the radio reaches: eight neighbours.
# Foot-bots stand in each other's sight and reach as far over their grid as the paper's Kilobots.
SPACING_MM = {"sim-kilobot": 50, "sim-coachbot": 500, "kilobot-emulated": 50,
              "coachbot-lab": 500, "coachbot-radio": 500, "argos-kilobot": 50, "argos-footbot": 300}
RANGE_MM = {"sim-kilobot": 75, "sim-coachbot": 750, "kilobot-emulated": 75, "coachbot-lab": 750,
            "coachbot-radio": 750, "argos-kilobot": 75, "argos-footbot": 860}

# Virtual seconds of a run. Hop counts are judged 10 s after the start, as in the paper.
SECONDS = {
    "hop_count": dict.fromkeys(PLATFORMS, 12),
    "hop_count_two_seeds": dict.fromkeys(PLATFORMS, 12),
    "firefly": {"sim-kilobot": 600, "sim-coachbot": 400, "kilobot-emulated": 600,
                "coachbot-lab": 300, "coachbot-radio": 300, "argos-kilobot": 600,
                "argos-footbot": 400},
    "edge_following": {"sim-kilobot": 1500, "sim-coachbot": 400, "kilobot-emulated": 1500,
                       "coachbot-lab": 200, "coachbot-radio": 200, "argos-kilobot": 600,
                       "argos-footbot": 600},
}
SECONDS["firefly_no_delay"] = SECONDS["firefly"]
SECONDS["news"] = dict.fromkeys(ONLY_ON["news"], 90)

KEYS = {"program", "platform", "robots", "runs", "seed", "seconds", "spacing_mm", "random_ids",
        "radio", "body", "clock", "message", "fault"}


def wide_encoding(data: bytes) -> str:
    """UTF-16 or UTF-32, if a file is in that; else nothing. As text/encoding.cpp has it."""
    zeros = [byte == 0 for byte in data[:4]]
    if (zeros in ([False, True, True, True], [True, True, True, False])
            or data[:4] in (b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "UTF-32"
    if (zeros in ([False, True] * 2, [True, False] * 2)
            or data[:2] in (b"\xff\xfe", b"\xfe\xff")):
        return "UTF-16"
    return ""


def read_toml(path: str) -> dict:
    """A file's table. Raises ScenarioError with one line that begins with the file's name."""
    try:
        with open(path, "rb") as file:
            data = file.read()
        if encoding := wide_encoding(data):
            raise ScenarioError(f"{path}: is {encoding}; save it as UTF-8")
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ScenarioError(f"{path}:{line}: bytes that are not UTF-8; save the file as "
                            "UTF-8") from error
    except (OSError, ValueError, RecursionError) as error:
        raise ScenarioError(f"{path}: {error}") from error


def read_file(path: str) -> dict:
    """A scenario file (TOML) as it stands; keys are checked."""
    scenario = read_toml(path)
    unknown = set(scenario) - KEYS
    if unknown:
        raise ScenarioError(f"{path}: no key '{sorted(unknown)[0]}'; there is: "
                            + " ".join(sorted(KEYS)))
    try:
        limits.check_top(scenario)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error
    return scenario


def grid(robots: int, spacing_mm: float) -> list[dict]:
    """Places of `robots` in a compact square, row by row from (0, 0)."""
    columns = math.ceil(math.sqrt(robots))
    return [{"x_mm": spacing_mm * (i % columns), "y_mm": spacing_mm * (i // columns),
             "role": FOLLOWER} for i in range(robots)]


def edge_places(body_mm: float) -> list[dict]:
    """Four seeds in a square, two followers at the set distance on either side of them."""
    unit = body_mm / 33
    side, away = 35 * unit, 60 * unit
    places = [{"x_mm": x, "y_mm": y, "role": EDGE_SEED} for y in (0, side) for x in (0, side)]
    places.append({"x_mm": side, "y_mm": side + away, "theta_rad": 0.0, "role": EDGE_FOLLOWER})
    places.append({"x_mm": 0, "y_mm": -away, "theta_rad": math.pi, "role": EDGE_FOLLOWER})
    return places


def places_of(program: str, platform: str, robots: int, spacing_mm: float | None,
              tellers: int | None = None) -> list[dict]:
    """Where the robots stand and what they are."""
    if program == "edge_following":
        if robots != 6:
            raise ScenarioError("edge_following has four seeds and two followers: use --robots 6")
        if spacing_mm is not None:
            raise ScenarioError("edge_following has places of its own: leave spacing_mm out")
        return edge_places(BODY_MM[platform])
    if robots < LEAST_ROBOTS[program]:
        raise ScenarioError(f"{program} has nothing to show with so few robots: use --robots "
                            f"{LEAST_ROBOTS[program]} or more")
    places = grid(robots, spacing_mm or SPACING_MM[platform])
    if program.startswith("hop_count"):
        columns = math.ceil(math.sqrt(robots))
        places[0]["role"] = SEED_1
        if program == "hop_count_two_seeds":
            places[(robots - 1) // columns * columns]["role"] = SEED_2
    if program == "news":
        for place in spread_out(places, tellers or min(TELLERS, robots - 1)):
            place["role"] = TELLER
    return places


def spread_out(places: list[dict], tellers: int) -> list[dict]:
    """Those that tell news, evenly over the grid."""
    if tellers >= len(places):
        raise ScenarioError(f"[message] tellers is {tellers}: fewer than the {len(places)} robots, "
                            "or nobody listens")
    return [places[(2 * i + 1) * len(places) // (2 * tellers)] for i in range(tellers)]


def resolve(options: dict) -> dict:
    """Fills in what `options` (a scenario file's keys) leave open."""
    scenario = copy.deepcopy(options)
    program, platform = scenario.get("program"), scenario.get("platform")
    if program not in PROGRAMS:
        raise ScenarioError(f"no program '{program}'; there is: " + " ".join(PROGRAMS))
    if platform not in PLATFORMS:
        raise ScenarioError(f"no platform '{platform}'; there is: " + " ".join(PLATFORMS))
    if platform not in ONLY_ON.get(program, PLATFORMS):
        raise ScenarioError(f"{program} does not run on {platform}; it runs on: "
                            + " ".join(ONLY_ON[program]))
    message = scenario.get("message", {})
    if message and program != "news":
        raise ScenarioError(f"{program} has no [message]: leave it out, or use program news")
    robots = scenario.pop("robots", None) or (6 if program == "edge_following" else 36)
    scenario["robots"] = places_of(program, platform, robots, scenario.pop("spacing_mm", None),
                                   message.get("tellers"))
    scenario.setdefault("seconds", SECONDS[program][platform])
    scenario.setdefault("seed", 1)
    scenario["faults"] = scenario.pop("fault", [])
    scenario.pop("runs", None)
    radio = scenario.setdefault("radio", {})
    if program == "edge_following":  # the way around is longer than a side: 6 robot radii
        radio.setdefault("range_mm", 100 * BODY_MM[platform] / 33)
    radio.setdefault("range_mm", RANGE_MM[platform])
    return scenario
