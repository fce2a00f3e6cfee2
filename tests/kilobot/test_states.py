"""Control messages: what a robot does on each, as its users know it."""
import swarm
from overhead_frames import (CALIBRATE, READ_UID, RESET, RUN, SLEEP, VOLTAGE, WAKEUP, command)


def emulate(tmp_path, commands, seconds, name="beacon", **options) -> swarm.Log:
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands}
    robots = swarm.grid(1, 1, 0, image=swarm.image(name), uid=5)
    return swarm.emulate(tmp_path, robots, ohc=ohc, seconds=seconds, seed=1, **options)


def motors_at(log, seconds: float) -> tuple[int, int]:
    past = [e for e in log.of("motors", "k0") if e["time_us"] <= seconds * 1e6]
    return past[-1]["left"], past[-1]["right"]


def led_at(log, seconds: float) -> tuple[int, int, int]:
    past = [e for e in log.of("led", "k0") if e["time_us"] <= seconds * 1e6]
    return past[-1]["red"], past[-1]["green"], past[-1]["blue"]


def test_a_robot_is_idle_until_run_and_pauses(tmp_path):
    log = emulate(tmp_path, command(3.0, RUN) + command(5.0, WAKEUP) + command(7.0, RUN), 9.0)
    assert log.sent("k0", 0, 3.0) == 0
    assert log.sent("k0", 3.6, 5.0) > 10
    assert log.sent("k0", 5.6, 7.0) == 0
    assert log.sent("k0", 7.6, 9.0) > 10


def test_a_pause_is_seen_at_once_however_long_the_program_ran(tmp_path):
    commands, pauses, now = [], [], 2.1
    for ran in (1.0, 3.0, 5.0, 7.0):
        commands += command(now, RUN, hold=0.3) + command(now + ran, WAKEUP, hold=0.3)
        pauses.append(now + ran)
        now += ran + 1
    log = emulate(tmp_path, commands, now + 0.5)
    for pause in pauses:
        greens = [e for e in log.of("led", "k0", green=3)
                  if pause + 0.3 <= e["time_us"] / 1e6 < pause + 1]
        assert len(greens) >= 3, f"five flashes a second after the pause at {pause:.1f} s"


def test_reset_starts_again_in_idle(tmp_path):
    log = emulate(tmp_path, command(2.1, RUN) + command(4.0, RESET), 7.0)
    assert log.sent("k0", 2.7, 4.0) > 10
    assert log.sent("k0", 4.6, 7.0) == 0
    greens = [e for e in log.of("led", "k0", green=3) if e["time_us"] > 5e6]
    assert len(greens) >= 8  # five flashes a second


def test_sleeping_robot_wakes_up(tmp_path):
    """It listens for 10 ms every 8 s."""
    log = emulate(tmp_path, command(2.1, SLEEP) + command(4.0, WAKEUP, hold=10.0), 16.0)
    asleep = [e for e in log.of("led", "k0") if 3e6 < e["time_us"] < 9e6]
    assert asleep == []
    greens = [e for e in log.of("led", "k0", green=3) if e["time_us"] > 14e6]
    assert greens, "idle again"


def test_voltage_shows_a_colour(tmp_path):
    log = emulate(tmp_path, command(2.1, VOLTAGE), 4.0)
    assert led_at(log, 3.9) == (0, 3, 0)  # the emulator's battery reads about 700


def test_uid_is_shown_by_turning(tmp_path):
    """uid 5: bits 0 and 2."""
    commands = []
    for bit in range(3):
        commands += command(2.1 + bit, READ_UID, bytes([bit]), hold=0.4)
    log = emulate(tmp_path, commands + command(5.2, WAKEUP), 6.5)
    assert [motors_at(log, 2.9 + bit)[0] > 0 for bit in range(3)] == [True, False, True]
    assert motors_at(log, 6.4) == (0, 0)


def test_calibration_is_saved_and_survives_a_reset(tmp_path):
    saved = tmp_path / "saved.eep"
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3",
           "send": (command(2.1, CALIBRATE, bytes([1, 0xD2, 0x04]))
                    + command(3.1, CALIBRATE, bytes([2, 0, 0, 66]))
                    + command(4.1, CALIBRATE, bytes([4, 0, 0, 0, 0, 61, 62]))
                    + command(5.1, CALIBRATE, bytes([0])))}
    robots = swarm.grid(1, 1, 0, image=swarm.image("blank"), uid=5, save_eeprom=str(saved))
    log = swarm.emulate(tmp_path, robots, ohc=ohc, seconds=6.5, seed=1)
    assert motors_at(log, 4.0) == (66, 0)
    assert motors_at(log, 5.0) == (61, 62)
    assert motors_at(log, 6.4) == (0, 0)
    eeprom = saved.read_bytes()
    assert eeprom[0xB0:0xB2] == bytes([0xD2, 0x04])
    assert (eeprom[0x05], eeprom[0x0C], eeprom[0x14]) == (66, 61, 62)
