"""The overhead controller's own firmware, seen by a robot in its light and at its LED."""
import pytest

import elf_image
import swarm
from overhead_frames import LED_TOGGLE, WAKEUP, forward, frame, send_at, stop


def with_copies(message: bytes, copies: int, check: int | None = None) -> bytes:
    """A repeated message's frame that says how many copies are sent at most."""
    check = ~copies & 0xFFFF if check is None else check
    body = bytearray(message)
    body[14:18] = copies.to_bytes(2, "little") + check.to_bytes(2, "little")
    body[131] = 0
    for byte in body[:131]:
        body[131] ^= byte
    return bytes(body)


def copies_sent(tmp_path, commands: list[str], seconds: float) -> list[float]:
    """When the controller's copies began. No host speaks behind the commands."""
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands}
    log = swarm.emulate(tmp_path, swarm.grid(1, 1, 0, image=swarm.image("blank")), ohc=ohc,
                        seconds=seconds, seed=1)
    return [e["time_us"] / 1e6 for e in log.of("sent", "ohc")]


def test_a_repetition_ends_by_itself_as_its_host_has_said(tmp_path):
    sent = copies_sent(tmp_path, [send_at(2.1, with_copies(forward(WAKEUP), 100))], 5)
    assert len(sent) == 100


@pytest.mark.parametrize("copies, check", [(0, 0), (5, 5), (60000, ~60000 & 0xFFFF)])
def test_a_host_that_says_nothing_of_it_has_30_seconds(tmp_path, copies, check):
    """kilogui fills with zeros, others with anything."""
    sent = copies_sent(tmp_path, [send_at(2.1, with_copies(forward(WAKEUP), copies, check))], 34)
    assert len(sent) == 2885
    assert abs(sent[-1] - sent[0] - 30) < 0.5


def test_the_next_frame_ends_it_all_the_same(tmp_path):
    sent = copies_sent(tmp_path, [send_at(2.1, with_copies(forward(WAKEUP), 1000)),
                                  send_at(3.1, stop())], 5)
    assert 80 <= len(sent) <= 100


def test_the_led_toggles_a_flag_of_its_own(tmp_path):
    """As the stock controller's: a message puts the light out and leaves the flag."""
    toggle = frame(LED_TOGGLE)
    commands = [send_at(2.1, toggle), send_at(2.3, with_copies(forward(WAKEUP), 1)),
                send_at(2.5, toggle), send_at(2.7, toggle)]
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands}
    log = swarm.emulate(tmp_path, swarm.grid(1, 1, 0, image=swarm.image("blank")), ohc=ohc,
                        seconds=3, seed=1)
    lights = [(e["time_us"] / 1e6, e["on"]) for e in log.of("status", "ohc")]

    def at(seconds):
        return [on for t, on in lights if t <= seconds][-1]
    assert [at(2.25), at(2.45), at(2.65), at(2.85)] == [True, False, False, True]


@pytest.mark.parametrize("name, prescales", [
    ("overhead_arduino", 0), ("overhead_arduino_16mhz", 2)])
def test_a_controller_on_an_arduino_speaks_at_8_mhz(tmp_path, name, prescales):
    """The emulator has no clock prescaler, so the image with one runs there as it does behind it;
    that it writes the prescaler (0x61, twice) is read in its code."""
    ohc = {"image": swarm.image(name), "infrared_pin": "B1", "status_pin": "B5",
           "send": [send_at(2.1, forward(WAKEUP)), send_at(2.6, stop())]}
    log = swarm.emulate(tmp_path, swarm.grid(1, 1, 0, image=swarm.image("blank")), ohc=ohc,
                        seconds=3, seed=1)
    assert len([e for e in log.of("sent", "ohc", type=WAKEUP) if e["crc_ok"]]) >= 40
    code = elf_image.flash_bytes(swarm.image(name), tmp_path)
    words = [int.from_bytes(code[i:i + 2], "little") for i in range(0, len(code) - 1, 2)]
    writes = [i for i in range(1, len(words))
              if words[i] == 0x61 and words[i - 1] & 0xFE0F == 0x9200]  # sts 0x61, register
    assert len(writes) == prescales
