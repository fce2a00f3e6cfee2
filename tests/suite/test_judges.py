"""What the judges of moving, flashing and telling robots find in logs that were written by hand."""
import math

import pytest

from test_metrics import END, written
import judges

PERIOD_S = judges.PERIOD_S


def value(t_s, robot, name, number):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "value", "name": name, "value": number}


def starts(robots):
    return [{"t": 0, "robot": i, "event": "start", "node": 7 + i} for i in range(robots)]


def in_order(events):
    return sorted(events, key=lambda e: e["t"])


def edge(folder, rounds, away_mm=60.0, events=(), platform="sim-kilobot"):
    """What is found of a seed with a follower for each of `rounds`, which are spread around it and
    go round clockwise so often, all of them in the same time."""
    unit = {"sim-kilobot": 1, "sim-coachbot": 110 / 33}[platform]

    def place(robot, turned):
        angle = 2 * math.pi * (robot / len(rounds) - turned)
        return {"x_mm": 500 + away_mm * unit * math.cos(angle),
                "y_mm": 300 + away_mm * unit * math.sin(angle)}
    robots = [{"x_mm": 500, "y_mm": 300, "role": 0}]
    robots += [place(i, 0) | {"role": 1} for i in range(len(rounds))]
    poses = [{"t": 1000 * step, "robot": i + 1, "event": "pose"} | place(i, turns * step / 200)
             for step in range(201) for i, turns in enumerate(rounds)]
    log = written(folder, len(robots), in_order([*poses, *events]) + [END], robots=robots,
                  program="edge_following", platform=platform)
    return judges.edge_following(log)


@pytest.mark.parametrize("rounds, fewest, success", [
    ([6, 6], 6, True), ([5.5, 5.5], 5.5, True), ([4.9, 4.9], 4.9, False), ([-6, -6], -6, False)])
def test_followers_have_to_go_round_clockwise_five_times(tmp_path, rounds, fewest, success):
    found = edge(tmp_path, rounds)
    assert found["revolutions"] == pytest.approx(fewest)
    assert (found["contacts"], found["success"]) == (0, success)


@pytest.mark.parametrize("rounds", [[8, 0], [0, 8]])
def test_the_slowest_follower_counts(tmp_path, rounds):
    found = edge(tmp_path, rounds, away_mm=66)
    assert found["revolutions"] == pytest.approx(0) and not found["success"]


@pytest.mark.parametrize("platform", ["sim-kilobot", "sim-coachbot"])
@pytest.mark.parametrize("away_mm, error, success", [
    (60, 0, True), (69, 9, True), (51, 9, True), (71, 11, False), (49, 11, False)])
def test_the_distance_is_judged_in_the_size_of_a_kilobot(tmp_path, platform, away_mm, error,
                                                         success):
    found = edge(tmp_path, [6, 6], away_mm, platform=platform)
    assert found["distance_error"] == pytest.approx(error)
    assert found["success"] == success


def test_one_body_in_another_is_a_contact(tmp_path):
    """The second stands; the first passes its place, 60 mm from the seed, eight times."""
    found = edge(tmp_path, [8.25, 0])
    assert found["contacts"] > 0


def test_contacts_of_a_simulated_world_are_taken_as_counted(tmp_path):
    def ended(*counts):
        return [{"t": 300000, "robot": i, "event": "end", "contacts": count}
                for i, count in enumerate(counts)]
    assert edge(tmp_path, [6, 6], events=ended(0, 0, 0))["success"]
    found = edge(tmp_path, [6, 6], events=ended(0, 2, 1))
    assert (found["contacts"], found["success"]) == (3, False)


def test_followers_that_stand_still_have_not_succeeded(tmp_path):
    found = edge(tmp_path, [0, 0])
    assert (found["revolutions"], found["contacts"], found["success"]) == (0, 0, False)


def test_a_seed_alone_has_not_succeeded(tmp_path):
    assert edge(tmp_path, [])["success"] is False


def test_waiting_for_a_seed_that_is_taken_and_for_an_answer_are_counted_apart(tmp_path):
    waits = [value(0.001 * k, 1, "waits", kind) for k, kind in enumerate((1, 2, 1, 1, 0))]
    found = edge(tmp_path, [6, 6], events=waits)
    assert (found["times_waited"], found["times_asked"]) == (1, 3)


def fireflies(folder, offsets, periods=20, faults=(), until=None):
    """What is found of robots that flash once a period, each at its own offset (a share of a
    period). From period `until` on, if it is given, all of them flash together."""
    events = [value(PERIOD_S * (k + (0 if until is not None and k >= until else offset)), robot,
                    "flash", 0)
              for robot, offset in enumerate(offsets) for k in range(periods)]
    end = {"event": "air", "seconds": PERIOD_S * periods}
    return judges.firefly(written(folder, len(offsets), starts(len(offsets)) + in_order(events)
                                  + [end], program="firefly", faults=list(faults)))


def test_robots_that_flash_together_have_succeeded(tmp_path):
    found = fireflies(tmp_path, [0.5] * 4)
    assert found["order"] == pytest.approx(1) and found["together"] == 1 and found["success"]
    assert found["synchronised_s"] == pytest.approx(PERIOD_S)
    assert found["spread_s"] == pytest.approx(0, abs=1e-5)


def test_two_halves_that_alternate_have_no_order(tmp_path):
    found = fireflies(tmp_path, [0.2, 0.2, 0.7, 0.7])
    assert found["order"] == pytest.approx(0, abs=1e-5) and found["together"] == 0.5
    assert found["synchronised_s"] is None and not found["success"]


def test_a_tenth_may_flash_apart_and_no_more(tmp_path):
    """The order of 9 to 1 is too low where the one flashes half a period later: then it is no
    success either; where it flashes 0.1 periods later, beyond a flash, it is."""
    late = fireflies(tmp_path, [0.5] * 9 + [0.6])
    assert late["together"] == 0.9 and late["order"] > 0.95 and late["success"]
    later = fireflies(tmp_path, [0.4] * 9 + [0.9])
    assert later["order"] == pytest.approx(0.8) and not later["success"]
    two = fireflies(tmp_path, [0.5] * 8 + [0.6] * 2)
    assert two["together"] == 0.8 and not two["success"]


def test_flashes_a_flash_apart_are_together_and_their_spread_is_told(tmp_path):
    apart = judges.FLASH_S / PERIOD_S
    assert fireflies(tmp_path, [0.5, 0.5 + 0.99 * apart])["together"] == 1
    assert fireflies(tmp_path, [0.5, 0.5 + 1.01 * apart])["together"] == 0.5
    spread = fireflies(tmp_path, [0.48, 0.48, 0.52, 0.52])["spread_s"]
    assert spread == pytest.approx(0.02 * PERIOD_S, rel=1e-3)


def test_when_they_came_together_is_told(tmp_path):
    found = fireflies(tmp_path, [0.1, 0.4, 0.7, 0.9], until=10)
    assert found["success"] and found["synchronised_s"] == pytest.approx(10 * PERIOD_S,
                                                                         abs=1.01 * PERIOD_S)


def test_the_dead_need_not_flash(tmp_path):
    """Two of ten flash elsewhere; once they are dead they are nobody's shortcoming."""
    offsets = [0.5] * 8 + [0.6] * 2
    dead = [{"kind": "death", "robot": robot, "at_s": 1} for robot in (8, 9)]
    assert fireflies(tmp_path, offsets, faults=dead)["together"] == 1


def news(folder, heard, robots=4, ttl=1, told=((0, 1, 1.0),), spliced=0, seconds=12):
    """What is found where robots on a line (teller, story, s) tell and (robot, teller, story, s)
    hear."""
    events = starts(robots)
    events += [value(t, teller, "told", story) for teller, story, t in told]
    events += [value(t, robot, "heard", 256 * teller + story) for robot, teller, story, t in heard]
    events.append(value(0.5, 1, "spliced", spliced))
    end = {"event": "air", "seconds": seconds, "sent": 96}
    return judges.news(written(folder, robots, in_order(events) + [end], program="news",
                               message={"ttl": ttl}))


def test_news_is_delivered_to_all_that_the_ttl_reaches(tmp_path):
    found = news(tmp_path, [(1, 0, 1, 1.25), (2, 0, 1, 2.0)])
    assert (found["delivery"], found["whole"], found["success"]) == (1, 1, True)
    assert found["heard"] == pytest.approx(2 / 3)
    assert found["converged_s"] == pytest.approx(1)
    assert found["packets_per_s"] == pytest.approx(96 / 4 / 12)
    assert news(tmp_path, [(1, 0, 1, 1.25)], ttl=0)["success"]
    further = news(tmp_path, [(1, 0, 1, 1.25), (2, 0, 1, 2.0)], ttl=2)
    assert further["delivery"] == pytest.approx(2 / 3)


def test_news_that_a_robot_missed_is_no_success(tmp_path):
    found = news(tmp_path, [(1, 0, 1, 1.25)])
    assert (found["delivery"], found["whole"], found["success"]) == (0.5, 0, False)
    assert found["latency_p50_s"] == pytest.approx(0.25) and found["converged_s"] is None


def test_the_first_copy_counts_and_one_from_beyond_the_ttl_does_not(tmp_path):
    found = news(tmp_path, [(1, 0, 1, 1.25), (1, 0, 1, 9.0), (2, 0, 1, 1.5), (3, 0, 1, 5.0)])
    assert found["delivery"] == 1 and found["heard"] == 1
    assert found["latency_p99_s"] == pytest.approx(0.5)


def test_what_was_told_late_is_not_judged(tmp_path):
    """Of 12 s the first 8 are."""
    heard = [(1, 0, 1, 1.25), (2, 0, 1, 2.0)]
    assert news(tmp_path, heard, told=((0, 1, 1.0), (0, 2, 8.5)))["delivery"] == 1
    assert news(tmp_path, heard, told=((0, 1, 1.0), (0, 2, 7.5)))["delivery"] == 0.5


def test_a_message_made_of_two_is_no_success(tmp_path):
    found = news(tmp_path, [(1, 0, 1, 1.25), (2, 0, 1, 2.0)], spliced=1)
    assert (found["delivery"], found["spliced"], found["success"]) == (1, 1, False)


def test_where_nothing_was_told_there_is_no_figure(tmp_path):
    found = news(tmp_path, [], told=())
    assert (found["delivery"], found["heard"], found["whole"]) == (None, None, None)
    assert not found["success"]
