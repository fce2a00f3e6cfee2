"""The adapter for kilolib: it compiles, and where there is a kilolib, its robots and ours hear each
other."""
import pathlib
import subprocess

import pytest

import swarm

ROOT = pathlib.Path(__file__).resolve().parents[2]
NO_KILOLIB = "no kilolib: give its folder with -DKILOLIB="


def test_the_adapter_compiles_against_what_it_uses(tmp_path):
    """Against declarations of ours: kilolib itself is not in this repository."""
    result = subprocess.run(
        ["avr-g++", "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-std=c++14", "-Os", "-Wall",
         "-Wextra", "-Werror", "-fno-threadsafe-statics", f"-I{ROOT}", f"-I{ROOT}/core/include",
         f"-I{pathlib.Path(__file__).parent}/kilolib_declarations",
         "-c", ROOT / "suite/kilobot/hop_count_kilolib.cpp", "-o", tmp_path / "image.o"],
        capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


@pytest.mark.parametrize("kinds", [("hop_count_kilolib", "hop_count"),
                                   ("hop_count", "hop_count_kilolib")])
def test_robots_with_and_without_kilolib_hear_each_other(tmp_path, kinds):
    """The first is a seed; the second counts one hop, so it has heard the first."""
    if not (swarm.IMAGES / "hop_count_kilolib.elf").exists():
        pytest.skip(NO_KILOLIB)
    robots = swarm.grid(1, 2, 50)
    for robot, kind, uid in zip(robots, kinds, (1, 9)):
        robot.update(image=swarm.image(kind), uid=uid)
    log = swarm.emulate(tmp_path, robots, ohc=swarm.overhead("run@2.1", "stop@3.6"), seconds=10,
                        seed=1, drift_ppm=10000, log_heard=True)
    # One hop from seed 1, none from seed 2: odd and even, which is red.
    lights = log.of("led", "k1")
    assert (lights[-1]["red"] > 0, lights[-1]["green"], lights[-1]["blue"]) == (True, 0, 0)


@pytest.mark.parametrize("mm", [40, 60, 90])
def test_both_measure_the_right_distance_of_the_other(tmp_path, mm):
    """Within 2 mm of the emulator's; kilolib reads its calibration in steps of its own."""
    if not (swarm.IMAGES / "ranging_kilolib.elf").exists():
        pytest.skip(NO_KILOLIB)
    robots = swarm.grid(1, 2, mm)
    for robot, kind in zip(robots, ("ranging_kilolib", "ranging")):
        robot.update(image=swarm.image(kind))
    log = swarm.emulate(tmp_path, robots, ohc=swarm.overhead("run@2.1", "stop@3.1"), seconds=8,
                        seed=mm, drift_ppm=10000,
                        watch=["ranging_heard:2", "ranging_distance_mm:2"])
    for node in ("k0", "k1"):
        heard = log.variable(node, "ranging_heard:2")
        distance_mm = log.variable(node, "ranging_distance_mm:2")
        print(f"{node}: {heard} messages, {distance_mm} mm of {mm} mm")
        assert heard >= 5  # kilolib speaks about twice a second
        assert abs(distance_mm - mm) <= 2
