"""Scenarios for `swarmtalk-sim --join`, as files, and what its logs say."""
import json
import pathlib


def write(path: pathlib.Path, places_mm, seconds: float, program: str = "hop_count",
          platform: str = "sim-coachbot", **more) -> pathlib.Path:
    """Ghosts at these places; the first is the program's first role (a seed, a teller)."""
    robots = [{"x_mm": x, "y_mm": y, "role": int(number == 0)}
              for number, (x, y) in enumerate(places_mm)]
    scenario = {"program": program, "platform": platform, "seed": 1, "seconds": seconds,
                "robots": robots, **more}
    path.write_text(json.dumps(scenario) + "\n")
    return path


def received(log: pathlib.Path) -> list[dict]:
    """What ghosts received: `robot` (from 0) heard a message of `node`."""
    events = [json.loads(line) for line in log.read_text().splitlines()[1:]]
    return [event for event in events if event.get("event") == "received"]
