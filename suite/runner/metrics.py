"""All figures of a run, and of several: mean and interval."""
import math
import statistics

import students_t
from deliveries import channel_load, losses, messages
from judges import edge_following, firefly, hop_count, news
from run_log import Log


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


def interval(values: list[float]) -> tuple[float, float]:
    """Mean and half width of its 95 % confidence interval (0 of a single value)."""
    mean = statistics.mean(values)
    if len(values) < 2:
        return mean, 0.0
    error = statistics.stdev(values) / math.sqrt(len(values))
    return mean, students_t.quantile(0.975, len(values) - 1) * error
