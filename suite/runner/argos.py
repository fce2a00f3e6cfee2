"""Platforms argos-kilobot and argos-footbot: fills in the experiment file of a scenario and runs
ARGoS on it, headless. The log is written by loop functions (platforms/argos/swarm_log.hpp), in
virtual time: same seed, same bytes.
"""
import json
import math
import os
import pathlib

import limits

STEPS_PER_SECOND = 31
MOST_SEED = 2**32 - 1  # ARGoS takes 0 for "draw one by the clock"
MARGIN_MM = {"kilobot": 1000, "footbot": 3000}  # around the places, for robots that move
HEIGHT_M = {"kilobot": 1, "footbot": 2}
ELEMENT = {"kilobot": "kilobot", "footbot": "foot-bot"}
# What a scenario file may say here, and what holds without it.
CLOCK = {"kilobot": {"drift_ppm": 5000, "power_on_spread_us": 250000},
         "footbot": {"drift_ppm": 50, "power_on_spread_us": 250000}}
RADIO = {"kilobot": {"loss": 0, "distance_noise_mm": 1},
         "footbot": {"loss": 0, "distance_noise_mm": 0}}


class ArgosError(Exception):
    """One line for the user: why ARGoS cannot run this, and what to do."""


def read_installation(build: pathlib.Path) -> dict:
    """What CMake has found: `program`, `libraries`, `kilobot`. Raises ArgosError."""
    path = build / "argos/argos.json"
    if not path.exists():
        raise ArgosError(f"no {path}; configure with ARGoS installed, and name the build with "
                         "SWARMTALK_BUILD=DIR")
    found = json.loads(path.read_text(encoding="utf-8"))
    if "missing" in found:
        raise ArgosError(f"{build} has no modules for ARGoS: {found['missing']}")
    return found


def check(scenario: dict, robot: str):
    """Raises ArgosError or ScenarioError where the scenario asks for what ARGoS cannot do."""
    platform = scenario["platform"]
    known = {"radio": {"range_mm", *RADIO[robot]}, "clock": set(CLOCK[robot]), "body": set()}
    for section, keys in known.items():
        for key, value in scenario.get(section, {}).items():
            if key not in keys:
                has = " ".join(f"{s}.{k}" for s in known for k in sorted(known[s]))
                raise ArgosError(f"{platform}: [{section}] has no key '{key}'; there is: {has}")
            limits.check_number(value, limits.SECTIONS[section][key], f"[{section}] {key}")
    if scenario["faults"]:
        raise ArgosError(f"{platform} knows no faults: leave [[fault]] out, or use sim-kilobot")
    if not 1 <= scenario["seed"] <= MOST_SEED:
        raise ArgosError(f"{platform}: seed is {scenario['seed']}: must be a whole number from 1 "
                         f"to {MOST_SEED}")


def robot_element(robot: str, index: int, place: dict, scenario: dict) -> str:
    """One robot of the <arena>."""
    metres = scenario["radio"]["range_mm"] / 1000
    attributes = (f'communication_range="{metres:.9g}"' if robot == "kilobot" else
                  f'rab_range="{metres:.9g}" rab_data_size="10"')
    clock = CLOCK[robot] | scenario.get("clock", {})
    params = {"index": index, "role": place.get("role", 0),
              "drift_ppm": clock["drift_ppm"], "power_on_spread_us": clock["power_on_spread_us"]}
    if scenario.get("random_ids"):
        params["random_id"] = "true"
    text = " ".join(f'{key}="{value}"' for key, value in params.items())
    degrees = math.degrees(place.get("theta_rad", 0))
    return (f'    <{ELEMENT[robot]} id="robot{index}" {attributes}>\n'
            f'      <body position="{place["x_mm"] / 1000:.9g},{place["y_mm"] / 1000:.9g},0" '
            f'orientation="{degrees:.9g},0,0" />\n'
            f'      <controller config="program"><params {text} /></controller>\n'
            f'    </{ELEMENT[robot]}>\n')


def window(places: list[dict], robot: str) -> str:
    """ARGoS's own window, playing at once, its camera above the middle of the robots."""
    middle, widest = [], 0
    for key in ("x_mm", "y_mm"):
        values = [p[key] for p in places]
        middle.append((max(values) + min(values)) / 2000)
        widest = max(widest, max(values) - min(values))
    x, y = middle
    height = max(2 * (widest + MARGIN_MM[robot] / 4) / 1000, HEIGHT_M[robot])
    return ('  <visualization>\n    <qt-opengl autoplay="true">\n      <camera><placements>\n'
            f'        <placement index="0" position="{x:.9g},{y:.9g},{height:.9g}" '
            f'look_at="{x:.9g},{y:.9g},0" up="0,1,0" lens_focal_length="30" />\n'
            '      </placements></camera>\n    </qt-opengl>\n  </visualization>\n')


def check_window(libraries: pathlib.Path):
    """Raises ArgosError where ARGoS cannot open one."""
    if not any(libraries.glob("libargos3plugin_simulator_qtopengl.*")):
        raise ArgosError(f"--view: ARGoS in {libraries} was built without its window (Qt and "
                         "OpenGL); leave --view out, or build it with them as its own pages say")
    if not any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY",
                                                 "QT_QPA_PLATFORM")):
        raise ArgosError("--view needs a screen, and DISPLAY is not set: log in to one, or leave "
                         "--view out")


def experiment(template: str, scenario: dict, robot: str, folder: pathlib.Path,
               log: pathlib.Path, header: pathlib.Path, threads: int = 0,
               view: bool = False) -> str:
    """The template (platforms/argos/experiments/) filled in. @param folder  of the modules"""
    from xml.sax.saxutils import quoteattr  # a sixth of the time of a start: it brings urllib
    places = scenario["robots"]
    reach = max(max(abs(p["x_mm"]), abs(p["y_mm"])) for p in places) + MARGIN_MM[robot]
    side = math.ceil(2 * reach / 1000)  # around (0, 0)
    radio = RADIO[robot] | scenario["radio"]
    noise = radio["distance_noise_mm"]
    label = f"{scenario['program']}_{robot}"
    steps = math.ceil(scenario["seconds"] * STEPS_PER_SECOND - 1e-6)
    values = {
        "label": label, "module": folder / f"lib{label}.so", "seed": scenario["seed"],
        "loop_functions": folder / "libswarmtalk_argos.so", "threads": threads,
        # Half a step more: ARGoS cuts off what its own product is short of.
        "length": f"{(steps + 0.5) / STEPS_PER_SECOND:.9f}",
        "loss": radio["loss"],
        # The plugin takes mm, ARGoS's board metres.
        "distance_noise": noise if robot == "kilobot" else noise / 1000,
        "arena": f"{side},{side},{HEIGHT_M[robot]}", "grid": f"{side},{side},1",
        "window": window(places, robot) if view else "",
        "robots": "".join(robot_element(robot, i, p, scenario) for i, p in enumerate(places)),
        "log_params": f"<params log={quoteattr(str(log))} scenario={quoteattr(str(header))} />"}
    for name, value in values.items():
        template = template.replace(f"@{name}@", str(value))
    return template


def read_template(robot: str) -> str:
    """As it stands in the tree, or installed beside this file."""
    here = pathlib.Path(__file__).resolve().parent
    for folder in (here.parent.parent / "platforms/argos/experiments", here):
        path = folder / f"{robot}.argos.in"
        if path.exists():
            return path.read_text(encoding="utf-8")
    raise ArgosError(f"no {robot}.argos.in beside {here}: the installation is not whole")


def last_words(errors: str) -> str:
    """Of ARGoS's many lines the one that says what is wrong: the innermost cause comes last."""
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    return lines[-1].removeprefix("[FATAL] ") if lines else ""


def robot_of(scenario: dict) -> str:
    return scenario["platform"].removeprefix("argos-")


def find(scenario: dict, build: pathlib.Path) -> dict:
    """The installation, if it has all that the scenario needs. Raises ArgosError."""
    robot, found = robot_of(scenario), read_installation(build)
    if robot == "kilobot" and not found["kilobot"]:
        raise ArgosError("the Kilobot plugin (argos3-kilobot) is not installed beside ARGoS: "
                         "install it and configure again, or use --platform argos-footbot")
    module = build / "argos" / f"lib{scenario['program']}_{robot}.so"
    if not module.exists():
        raise ArgosError(f"no {module}: build it with ninja -C {build} {module.stem[3:]}")
    return found


def run(scenario: dict, log: pathlib.Path, build: pathlib.Path, call, view: bool = False):
    """Runs it to its end, or until interrupted.

    @param call  platforms.call
    @param view  in ARGoS's own window, in real time; it stays until the user closes it
    """
    robot = robot_of(scenario)
    check(scenario, robot)
    found, folder = find(scenario, build), build / "argos"
    if view:
        check_window(pathlib.Path(found["libraries"]))
    header = log.with_name(log.name + ".scenario").resolve()
    path = log.with_name(log.name + ".argos")
    environment = os.environ | {"LD_LIBRARY_PATH": os.pathsep.join(
        filter(None, [found["libraries"], os.environ.get("LD_LIBRARY_PATH")]))}
    try:
        header.write_text(json.dumps(scenario) + "\n", encoding="utf-8")
        path.write_text(experiment(read_template(robot), scenario, robot, folder, log.resolve(),
                                   header, view=view), encoding="utf-8")
        call([found["program"], "-n", "-c", path], environment, last_words)
    finally:
        header.unlink(missing_ok=True)
        path.unlink(missing_ok=True)
