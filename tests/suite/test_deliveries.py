"""Figures of messages, of logs that were written by hand: each answer is counted on paper."""
import pytest

from test_metrics import END, written
import deliveries

NODES = [21, 22, 23, 24]


def start(t_s, robot):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "start", "node": NODES[robot]}


def sent(t_s, robot, channel=0):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "sent", "channel": channel}


def received(t_s, robot, sender, message, channel=0):
    return {"t": round(t_s * 1e6), "robot": robot, "event": "received", "channel": channel,
            "node": NODES[sender], "message": message % 16}


def found(folder, events, count=2, starts=None, **scenario):
    """Robots stand in a row, each heard by the next ones. @param starts  in s, by robot"""
    starts = starts or [0] * count
    events = [start(t_s, robot) for robot, t_s in enumerate(starts)] + events
    events.sort(key=lambda e: (e["t"], ("start", "sent", "received", "end").index(e["event"])))
    return deliveries.messages(written(folder, count, events + [END], **scenario))


def test_the_age_of_information_is_at_its_peak_when_the_next_message_comes(tmp_path):
    """Sent at 0, 1 and 3 s, heard 0.1, 0.3 and 0.2 s later: just before the second is heard, what
    is known is 1.3 s old, and before the third 2.2 s."""
    events = [sent(0, 0), received(0.1, 1, 0, 1), sent(1, 0), received(1.3, 1, 0, 2), sent(3, 0),
              received(3.2, 1, 0, 3)]
    result = found(tmp_path, events)
    assert result["peak_age_s"] == pytest.approx((1.3 + 2.2) / 2)
    assert result["latency_p50_s"] == pytest.approx(0.2)
    assert result["delivery"] == 1


def test_what_is_lost_makes_what_is_known_older(tmp_path):
    events = [sent(t, 0) for t in range(6)]
    events += [received(t + 0.1, 1, 0, t + 1) for t in (0, 1, 4, 5)]
    result = found(tmp_path, events)
    assert result["peak_age_s"] == pytest.approx((1.1 + 4.1 - 1 + 1.1) / 3)
    assert result["delivery"] == pytest.approx(3 / 5)  # the last one is still on its way


def test_ages_are_of_each_sender_channel_and_receiver(tmp_path):
    """All three in a row hear the one in the middle: twice, 1 s apart, on two channels."""
    events = []
    for channel, late in ((0, 0.1), (1, 0.5)):
        for t in (0, 1):
            events.append(sent(t, 1, channel))
            events += [received(t + late, robot, 1, t + 1, channel) for robot in (0, 2)]
    result = found(tmp_path, events, 3)
    assert result["peak_age_s"] == pytest.approx((1.1 + 1.5) / 2)
    assert result["delivery"] == 1
    # One message each has nothing to be old against.
    assert found(tmp_path, events[:2])["peak_age_s"] is None


def test_quantiles_are_of_all_latencies(tmp_path):
    """A hundred messages, 10 s apart, of which the k-th takes k ms."""
    events = []
    for k in range(100):
        events += [sent(10 * k, 0), received(10 * k + k / 1000, 1, 0, k + 1)]
    result = found(tmp_path, events)
    assert result["latency_p50_s"] == pytest.approx(0.05)
    assert result["latency_p99_s"] == pytest.approx(0.099)


def test_each_receiver_in_range_is_owed_each_message(tmp_path):
    """Of four in a row the second is heard by the first and third; the fourth is too far away."""
    events = [sent(t, 1) for t in range(5)]
    events += [received(t + 0.1, 0, 1, t + 1) for t in range(4)]
    events += [received(t + 0.1, 2, 1, t + 1) for t in (0, 3)]
    assert found(tmp_path, events, 4)["delivery"] == pytest.approx(6 / 8)
    events.append(received(1.2, 2, 1, 1))  # twice is once
    assert found(tmp_path, events, 4)["delivery"] == pytest.approx(6 / 8)


@pytest.mark.parametrize("faults, delivery", [
    ([], 2 / 4), ([{"kind": "death", "robot": 1, "at_s": 1.5}], 2 / 2),
    ([{"kind": "death", "robot": 1, "at_s": 1.5}, {"kind": "restart", "robot": 1, "at_s": 2.5}],
     2 / 3), ([{"kind": "death", "robot": 1, "at_s": 8}], 2 / 4)])
def test_the_dead_are_owed_nothing(tmp_path, faults, delivery):
    events = [sent(t, 0) for t in range(5)] + [received(t + 0.1, 1, 0, t + 1) for t in (0, 1)]
    assert found(tmp_path, events, faults=faults)["delivery"] == pytest.approx(delivery)


def test_a_program_is_owed_what_is_sent_while_it_runs(tmp_path):
    """It begins after the first message of six and ends before the fourth; it hears one of two."""
    events = [sent(t, 0) for t in range(6)] + [received(1.1, 1, 0, 2)]
    events.append({"t": 2500000, "robot": 1, "event": "end"})
    assert found(tmp_path, events, starts=[0, 0.5])["delivery"] == pytest.approx(1 / 2)


def test_numbers_go_round_after_sixteen_and_begin_anywhere(tmp_path):
    """The first message is number 9 here; 40 are sent and every second is heard."""
    events = [sent(t, 0) for t in range(41)]
    events += [received(t + 0.2, 1, 0, 9 + t) for t in range(0, 40, 2)]
    result = found(tmp_path, events)
    assert result["delivery"] == pytest.approx(20 / 40)
    assert result["latency_p99_s"] == pytest.approx(0.2)


@pytest.mark.parametrize("tells_numbers", [False, True])
def test_each_life_of_each_sender_has_numbers_of_its_own(tmp_path, tells_numbers):
    """Robots 0 and 2 beside robot 1; 0 starts anew. What is heard took 0.1, 0.2 and 0.3 s."""
    events = []
    for robot, first, times, late in ((0, 5, (0, 1, 2, 3), 0.1), (0, 12, (10, 11, 12, 13), 0.2),
                                      (2, 3, range(4, 9), 0.3)):
        for number, t in enumerate(times, first):
            told = {"message": number % 16} if tells_numbers else {}
            events += [sent(t, robot) | told, received(t + late, 1, robot, number)]
    events.append(start(9.5, 0))
    lost = [e for e in events if e["event"] == "received" and e["t"] in (1100000, 5300000)]
    result = found(tmp_path, [e for e in events if e not in lost], 3)
    assert result["delivery"] == pytest.approx((6 + 3) / (7 + 4))
    assert result["latency_p50_s"] == pytest.approx(0.2)
    assert result["latency_p99_s"] == pytest.approx(0.3)


def test_nothing_heard_is_no_delivery_and_no_figure(tmp_path):
    assert found(tmp_path, [sent(0, 0), sent(1, 0)]) == {"delivery": None}


def test_moving_robots_have_no_share_of_delivery(tmp_path):
    events = [sent(0, 0), sent(1, 0), received(0.1, 1, 0, 1)]
    result = found(tmp_path, events, program="edge_following")
    assert result["delivery"] is None and result["latency_p50_s"] == pytest.approx(0.1)


AIR = {"event": "air", "seconds": 10, "expected": 300, "sent": 100, "lost_collision": 30}


@pytest.mark.parametrize("platform, radio, air_ms", [
    ("sim-kilobot", {}, 4.6), ("sim-coachbot", {}, 0.3), ("sim-kilobot", {"air_us": 1000}, 1)])
def test_the_load_is_the_share_of_time_in_which_a_robots_air_is_taken(tmp_path, platform, radio,
                                                                      air_ms):
    """Four robots hear or send 400 packets in 10 s: a hundred each."""
    log = written(tmp_path, 4, [AIR], platform=platform, radio={"range_mm": 75} | radio)
    assert deliveries.channel_load(log) == {"channel_load": pytest.approx(100 * air_ms / 10000),
                                            "collided": pytest.approx(0.1)}


def test_without_packets_there_is_no_load(tmp_path):
    assert deliveries.channel_load(written(tmp_path, 4, [AIR | {"expected": 0}])) == {}
    assert deliveries.channel_load(written(tmp_path, 4, [])) == {}


def test_losses_are_summed_over_robots_that_tell_them(tmp_path):
    ends = [{"t": 9, "robot": robot, "event": "end", "lost_kernel": robot, "lost_client": 100,
             "lost_daemon": 10 * robot} for robot in (1, 2)]
    log = written(tmp_path, 3, [{"t": 9, "robot": 0, "event": "end"}, *ends, END])
    assert deliveries.losses(log) == {"lost_kernel": 3, "lost_daemon": 30, "lost_client": 200}
    assert deliveries.losses(written(tmp_path, 2, [END])) == {}
