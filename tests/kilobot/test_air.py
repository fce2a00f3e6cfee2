"""The infrared link: what is heard, how far away it seems, and who gets to speak."""
import pytest

import swarm
from swarm import in_the_field

RUN = swarm.overhead("run@2.1", "stop@3.1")
QUIET = 3.2  # from here on the controller is silent


@pytest.mark.parametrize("mm", [
    in_the_field(33), 40, in_the_field(50), in_the_field(60), in_the_field(75), 90])
def test_two_robots_hear_each_other_at_the_right_distance(tmp_path, mm):
    log = swarm.emulate(tmp_path, swarm.grid(1, 2, mm, image=swarm.image("beacon")), ohc=RUN,
                        seconds=5, seed=mm, drift_ppm=10000,
                        watch=["beacon_distance_mm:2", "beacon_heard:2", "beacon_last_uid:2"])
    for node, other in (("k0", "k1"), ("k1", "k0")):
        sent = log.sent(other, QUIET)
        heard = log.variable(node, "beacon_heard:2") - log.variable(node, "beacon_heard:2", QUIET)
        print(f"{node}: heard {heard} of {sent}")
        assert sent >= 17  # a turn each 102 ms
        assert heard >= 0.9 * sent
        assert log.variable(node, "beacon_last_uid:2") == int(other[1:]) + 1
        assert abs(log.variable(node, "beacon_distance_mm:2") - mm) <= 1


@pytest.mark.parametrize("mm", [45, in_the_field(70)])
def test_distance_survives_noise(tmp_path, mm):
    """Readings scatter by 3 counts; the calibration falls 6 to 7 counts per mm."""
    log = swarm.emulate(tmp_path, swarm.grid(1, 2, mm, image=swarm.image("beacon")), ohc=RUN,
                        seconds=6, seed=7, noise_counts=3, watch=["beacon_distance_mm:2"])
    seen = [e["value"] for e in log.of("variable", "k0", name="beacon_distance_mm:2")][1:]
    assert seen and all(abs(value - mm) <= 3 for value in seen)


def test_robot_without_calibration_says_that_it_does_not_know(tmp_path):
    blank = tmp_path / "blank.eep"
    blank.write_bytes(b"\xff" * 1024)
    robots = swarm.grid(1, 2, 50, image=swarm.image("beacon"))
    robots[0]["eeprom"] = str(blank)
    log = swarm.emulate(tmp_path, robots, ohc=RUN, seconds=4, seed=1,
                        watch=["beacon_distance_mm:2", "beacon_heard:2"])
    assert log.variable("k0", "beacon_heard:2") > 5
    assert log.variable("k0", "beacon_distance_mm:2") in (-1, 0xFFFF)


def test_clocks_four_percent_apart_hear_each_other(tmp_path):
    """The receiver times each byte from its own start pulse."""
    drifts = [-40000, -20000, 0, 20000, 40000]
    robots = [{"x_mm": 10.0 * i, "image": swarm.image("beacon"), "drift_ppm": drift}
              for i, drift in enumerate(drifts)]
    log = swarm.emulate(tmp_path, robots, seconds=3.2, seed=1, watch=["beacon_heard:2"],
                        lamp=["16:55aaff000102@1x100"])
    heard = [log.variable(f"k{i}", "beacon_heard:2") for i in range(len(drifts))]
    print(f"heard of 100: {heard}")
    assert all(count >= 98 for count in heard)


@pytest.mark.parametrize("range_mm", [80, in_the_field(300)])
@pytest.mark.parametrize("drift_ppm", [in_the_field(0), 10000])
def test_nine_saturated_robots_starve_nobody(tmp_path, drift_ppm, range_mm):
    """80 mm: neighbours and diagonals, so the one in the middle hears all and most do not hear
    each other; 300 mm: all hear all. Least to most messages sent is at least 0.5."""
    log = swarm.emulate(tmp_path, swarm.grid(3, 3, 50, image=swarm.image("beacon")),
                        medium={"range_mm": range_mm}, ohc=RUN, seconds=13.2, seed=1,
                        drift_ppm=drift_ppm)
    sent = [log.sent(f"k{i}", QUIET) for i in range(9)]
    print(f"drift {drift_ppm} ppm, range {range_mm} mm: {sent}, "
          f"least to most {min(sent) / max(sent):.2f}")
    assert min(sent) >= 0.5 * max(sent)
    assert sum(sent) > 800  # of 880: each has one turn in 102 ms, and 10 s
    for i in range(9):  # what met taken air is not given up, but sent at the next try
        numbers = [int.from_bytes(bytes.fromhex(e["data"])[2:4], "little")
                   for e in log.of("sent", f"k{i}", type=16)]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
