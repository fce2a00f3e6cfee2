"""All figures of a run, and of several: mean and interval."""
import math
import statistics

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
