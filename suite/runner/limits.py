"""What a scenario may say: kinds and limits of its values, so that nonsense is refused in one line
and never simulated. Lengths in mm, times in s or us as the key says.
"""
import math
import numbers

MOST_ROBOTS = 100_000
LATEST_S = 1_000_000


class ScenarioError(Exception):
    """One line for the user: what is wrong and what to do."""


WHOLE, REAL = "a whole number", "a number"
# Key: kind, least and most.
TOP = {
    "robots": (WHOLE, 1, MOST_ROBOTS), "runs": (WHOLE, 1, 1_000_000),
    "seed": (WHOLE, 0, 2**63 - 1), "seconds": (REAL, 1e-6, LATEST_S),
    "spacing_mm": (REAL, 1e-3, 1e6),
}
SECTIONS = {
    "radio": {
        "range_mm": (REAL, 1e-3, 1e6), "asymmetry": (REAL, 0, 1), "loss": (REAL, 0, 1),
        "air_us": (WHOLE, 1, 10_000_000), "period_us": (WHOLE, 100, 1_000_000_000),
        "period_jitter": (REAL, 0, 1), "turnaround_us": (WHOLE, 0, 10_000_000),
        "backoff_us": (WHOLE, 1, 1_000_000_000), "distance_noise_mm": (REAL, 0, 1e6),
        "bearing_noise_rad": (REAL, 0, 10)},
    "body": {
        "diameter_mm": (REAL, 1e-3, 1e6), "wheel_base_mm": (REAL, 1e-3, 1e6),
        "speed_mm_per_s": (REAL, 0, 1e6), "speed_bias": (REAL, 0, 1),
        "motion_noise": (REAL, 0, 1)},
    "clock": {
        "drift_ppm": (WHOLE, 0, 500_000), "power_on_spread_us": (WHOLE, 0, 1_000_000_000)},
    "message": {  # of the program news
        "bytes": (WHOLE, 3, 64), "ttl": (WHOLE, 0, 255), "copies": (WHOLE, 0, 255),
        "period_ms": (WHOLE, 33, 1_000_000), "tellers": (WHOLE, 1, MOST_ROBOTS)},
}
PLACE = (REAL, -1e9, 1e9)
FAULT = {
    "at_s": (REAL, 0, LATEST_S), "end_s": (REAL, 0, 1e9), "robot": (WHOLE, 0, MOST_ROBOTS - 1),
    "ticks": (WHOLE, -2**31, 2**31 - 1), "x_mm": PLACE, "y_mm": PLACE,
    "radius_mm": (REAL, 1e-3, 1e9),
}
# What each fault has to say, and may.
FAULTS = {
    "death": ({"robot"}, set()), "restart": ({"robot"}, set()),
    "clock_step": ({"robot", "ticks"}, set()), "partition": ({"x_mm"}, {"end_s"}),
    "jam": ({"x_mm", "y_mm", "radius_mm"}, {"end_s"}),
}


def check_number(value, limits: tuple, name: str):
    """Raises ScenarioError unless it is of the kind and within the limits."""
    kind, least, most = limits
    wanted = numbers.Integral if kind == WHOLE else numbers.Real
    if isinstance(value, bool) or not isinstance(value, wanted) or not math.isfinite(value) \
            or not least <= value <= most:
        raise ScenarioError(f"{name} is {value!r}: must be {kind} from {least:.15g} to "
                            f"{most:.15g}")


def check_top(options: dict):
    """The scenario's own keys, and what kind its sections are. @param options  as in the file"""
    for key, limits in TOP.items():
        if key in options:
            check_number(options[key], limits, key)
    if not isinstance(options.get("random_ids", False), bool):
        raise ScenarioError("random_ids must be true or false")
    for section in SECTIONS:
        if not isinstance(options.get(section, {}), dict):
            raise ScenarioError(f"[{section}] must be a table of keys and numbers")
    faults = options.get("fault", [])
    if not isinstance(faults, list) or not all(isinstance(each, dict) for each in faults):
        raise ScenarioError("faults are tables: begin each with a line [[fault]]")


def check_sections(scenario: dict):
    """Numbers of [radio], [body], [clock], [message]; keys that nobody knows are refused, too."""
    for section, keys in SECTIONS.items():
        for key, value in scenario.get(section, {}).items():
            if key not in keys:
                raise ScenarioError(f"[{section}] has no key '{key}'; there is: "
                                    + " ".join(sorted(keys)))
            check_number(value, keys[key], f"[{section}] {key}")


def check_faults(faults: list[dict], robots: int, seconds: float):
    """Each fault says what it needs, nothing that it ignores, and comes before the end."""
    for number, fault in enumerate(faults, 1):
        name = f"[[fault]] {number}"
        kind = fault.get("kind")
        if kind not in FAULTS:
            raise ScenarioError(f"{name}: no fault {kind!r}; there is: " + " ".join(FAULTS))
        needs, may = FAULTS[kind]
        given = set(fault) - {"kind", "at_s"}
        if needs - given:
            raise ScenarioError(f"{name}: {kind} needs '{sorted(needs - given)[0]}'")
        if given - needs - may:
            raise ScenarioError(f"{name}: {kind} has no key '{sorted(given - needs - may)[0]}'; "
                                "there is: " + " ".join(sorted(needs | may | {"at_s"})))
        for key in given | ({"at_s"} & set(fault)):
            check_number(fault[key], FAULT[key], f"{name} {key}")
        at_s = fault.get("at_s", 0)
        if fault.get("robot", 0) >= robots:
            raise ScenarioError(f"{name}: no robot {fault['robot']}; they are 0 to {robots - 1}")
        if at_s >= seconds:
            raise ScenarioError(f"{name}: the run ends at {seconds:g} s, before it comes "
                                f"(at_s = {at_s:g})")
        if fault.get("end_s", math.inf) <= at_s:
            raise ScenarioError(f"{name}: end_s must be after at_s ({at_s:g})")
