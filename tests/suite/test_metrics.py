"""What metrics say of logs whose answers are known."""
import json
import statistics
import sys

import pytest

from test_runner import ROOT, results, suite

sys.path.insert(0, str(ROOT / "suite/runner"))
import deliveries  # noqa: E402
import judges  # noqa: E402
import metrics  # noqa: E402
import run_log  # noqa: E402


def run(folder, program: str, text: str = "", *options) -> dict:
    """The result of one run of a scenario."""
    (folder / "s.toml").write_text(f"program = '{program}'\n{text}\n")
    return results(suite(folder, "run", "--scenario", "s.toml", *options))[0]


def written(folder, count: int, events: list[dict], **scenario) -> run_log.Log:
    """A log made by hand: robots on a line, 50 mm apart, each heard by the next ones."""
    first = {"program": "hop_count", "platform": "sim-kilobot", "seed": 1, "seconds": 12,
             "radio": {"range_mm": 75}, "faults": [],
             "robots": [{"x_mm": 50 * i, "y_mm": 0, "role": int(i == 0)} for i in range(count)]}
    path = folder / "log.jsonl"
    lines = [first | scenario] + events
    path.write_text("".join(json.dumps(each) + "\n" for each in lines))
    return run_log.Log(str(path))


END = {"event": "air", "seconds": 12}


def hops(*counts) -> list[dict]:
    return [{"t": 1000 * i, "robot": i, "event": "value", "name": "hops_1", "value": count}
            for i, count in enumerate(counts)]


@pytest.mark.parametrize("counts, wrong, success", [
    ((0, 1, 2, 3), 0, True), ((0, 1, 1, 3), 1, False), ((0, 1, 2), 1, False)])
def test_a_wrong_or_missing_count_is_found(tmp_path, counts, wrong, success):
    log = written(tmp_path, 4, hops(*counts) + [END])
    found = judges.hop_count(log)
    assert (found["wrong_hops"], found["success"]) == (wrong, success)


def test_a_robot_out_of_reach_must_not_have_a_count(tmp_path):
    """The third robot hears nobody: 2 is as wrong there as anything but "unreached" is."""
    broken = [{"kind": "partition", "x_mm": 75, "at_s": 0}]
    assert judges.hop_count(written(tmp_path, 3, hops(0, 1, 2) + [END],
                                    faults=broken))["wrong_hops"] == 1
    assert judges.hop_count(written(tmp_path, 3, hops(0, 1, 100) + [END],
                                    faults=broken))["success"]


def test_a_swarm_that_does_not_hear_its_seed_has_not_succeeded(tmp_path):
    log = written(tmp_path, 3, hops(0, 100, 100) + [END], radio={"range_mm": 20})
    assert judges.hop_count(log) == {"wrong_hops": 0, "converged_s": 0.002, "success": False}


def test_a_log_that_was_cut_off_is_no_success(tmp_path):
    """All counts are right, and 11 of 12 s are there."""
    result = run(tmp_path, "hop_count")
    assert result["success"]
    log = tmp_path / result["log"]
    text = log.read_text()
    log.write_text(text[:int(len(text) * 0.95)])
    assert metrics.evaluate(run_log.Log(str(log)))["interrupted"]
    assert not metrics.evaluate(run_log.Log(str(log)))["success"]


def test_a_run_that_ends_before_it_can_be_judged_is_no_success(tmp_path):
    """All counts are right after 6 s; the criterion says 10."""
    done = suite(tmp_path, "run", "hop_count", "--robots", 9, "--seconds", 6)
    result = results(done)[0]
    assert "10 s after the last start: use --seconds 12\n" in done.stderr, done.stderr
    assert "run failed" not in done.stderr
    assert done.returncode == 1 and result["wrong_hops"] == 0 and result["too_short"]
    assert "Traceback" not in done.stderr


def test_a_robot_that_starts_anew_numbers_its_messages_anew(tmp_path):
    """Its new messages were taken for those of 16 before: up to 8 s old."""
    result = run(tmp_path, "hop_count",
                 "seconds = 40\n[[fault]]\nkind = 'restart'\nrobot = 3\nat_s = 20")
    assert result["latency_p99_s"] < 0.6 and result["delivery"] > 0.9 and result["success"]
    assert 0 < result["converged_s"] < 5, "the robot that lost its count has to find it again"


@pytest.mark.parametrize("fault", [
    "kind = 'death'\nrobot = 7", "kind = 'death'\nrobot = 35\nat_s = 2",
    "kind = 'partition'\nx_mm = 120\nend_s = 30",
    "kind = 'jam'\nx_mm = 120\ny_mm = 120\nradius_mm = 60\nend_s = 30"])
def test_counts_are_judged_by_what_works(tmp_path, fault):
    """Ways lead around the dead and the deaf, who are not judged, or have no count."""
    result = run(tmp_path, "hop_count", "seconds = 14\n[[fault]]\n" + fault)
    assert result["wrong_hops"] == 0 and result["success"], result


def test_a_dead_seed_leaves_wrong_counts(tmp_path):
    result = run(tmp_path, "hop_count", "[[fault]]\nkind = 'death'\nrobot = 0\nat_s = 5")
    assert result["wrong_hops"] == 35 and not result["success"]


def test_delivery_and_latency_of_three_messages(tmp_path):
    """Robot 0 sends three, the last of which is on its way; its one neighbour gets the second."""
    events = [{"t": 0, "robot": i, "event": "start", "node": 7 + i} for i in range(2)]
    events += [{"t": t, "robot": 0, "event": "sent", "channel": 0} for t in (0, 500000, 1000000)]
    events.append({"t": 600000, "robot": 1, "event": "received", "channel": 0, "node": 7,
                   "message": 2})
    found = deliveries.messages(written(tmp_path, 2, events + [END]))
    assert found["delivery"] == 0.5
    assert found["latency_p50_s"] == pytest.approx(0.1)


def test_numbers_that_a_log_tells_of_what_was_sent_are_taken(tmp_path):
    """The next message waits already when one arrives: by times alone it would be taken for it."""
    events = [{"t": 0, "robot": i, "event": "start", "node": 7 + i} for i in range(2)]
    for k in range(20):
        events.append({"t": 100000 * k, "robot": 0, "event": "sent", "channel": 0,
                       "message": (11 + k) % 16})
        events.append({"t": 100000 * k + 104000, "robot": 1, "event": "received", "channel": 0,
                       "node": 7, "message": (11 + k) % 16})
    found = deliveries.messages(written(tmp_path, 2, sorted(events, key=lambda e: e["t"]) + [END]))
    assert found["latency_p50_s"] == pytest.approx(0.104)


@pytest.mark.parametrize("platform, delivered", [("coachbot-lab", 1), ("sim-kilobot", 0.9)])
def test_in_real_time_one_may_hear_before_the_sender_tells(tmp_path, platform, delivered):
    """Whoever has heard it logs that first when the sender has to wait for its turn."""
    events = [{"t": 0, "robot": i, "event": "start", "node": 7 + i} for i in range(2)]
    for k in range(41):
        is_late = k % 10 == 5
        events.append({"t": 100000 * k + (3000 if is_late else 0), "robot": 0, "event": "sent",
                       "channel": 0})
        events.append({"t": 100000 * k + 1000, "robot": 1, "event": "received", "channel": 0,
                       "node": 7, "message": (11 + k) % 16})
    found = deliveries.messages(written(tmp_path, 2, sorted(events, key=lambda e: e["t"]) + [END],
                                        platform=platform))
    assert found["delivery"] == delivered
    assert (found["latency_p99_s"] < 0.01) == (platform == "coachbot-lab")


def test_two_neighbours_of_one_id_do_not_lose_each_others_messages(tmp_path):
    """All that was sent has arrived; from whom, the robot in the middle cannot tell."""
    events = [{"t": 0, "robot": i, "event": "start", "node": node}
              for i, node in enumerate((7, 8, 7))]
    for number in (1, 2):
        for sender, node, to in ((0, 7, (1,)), (1, 8, (0, 2)), (2, 7, (1,))):
            t = 100000 * number + 1000 * sender
            events.append({"t": t, "robot": sender, "event": "sent", "channel": 0})
            events += [{"t": t + 500, "robot": other, "event": "received", "channel": 0,
                        "node": node, "message": number} for other in to]
    assert deliveries.messages(written(tmp_path, 3, events + [END]))["delivery"] == 1


@pytest.mark.parametrize("runs, quantile", [(2, 12.706), (10, 2.262), (20, 2.093), (33, 2.037),
                                            (100, 1.984)])
def test_intervals_are_students(runs, quantile):
    values = [float(i % 2) for i in range(runs)]
    mean, half = metrics.interval(values)
    assert mean == statistics.mean(values)
    expected = quantile * statistics.stdev(values) / runs ** 0.5
    assert half == pytest.approx(expected, rel=2e-3)


def test_a_stop_for_a_seed_that_answers_late_is_no_stop_for_a_taken_one(tmp_path):
    """Each change of seeds is asked for; followers that never meet need never wait."""
    result = run(tmp_path, "edge_following", "", "--platform", "sim-coachbot", "--seed", 53)
    hand_overs = 4 * 2 * result["revolutions"]
    assert result["times_waited"] == 0 and 0.8 * hand_overs < result["times_asked"]
    other = run(tmp_path, "edge_following", "", "--platform", "sim-coachbot", "--seed", 54)
    assert other["times_waited"] > 10 and other["success"], "nobody met anybody"
