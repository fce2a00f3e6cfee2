"""A program that hangs: the robot can be reached all the same.

With interrupts off the watchdog resets it, by the data sheet; simavr 1.6 does not model that (it
leaves WDIE set until the interrupt runs), so there is no test of it here.
"""
import pathlib
import subprocess

import pytest

import swarm
from overhead_frames import BOOT, RESET, RUN, command

ROOT = pathlib.Path(__file__).resolve().parents[2]

HANGING_PROGRAM = """
#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/runtime.hpp"
using namespace swarmtalk::kilobot;
static void setup() {}
static void loop() {
  set_led(kLedWhite);
  set_motors(50, 50);
  for (;;) asm volatile("");
}
static void receive(const IrReception&) {}
static bool next(IrMessage&) { return false; }
int main() { run_program({&setup, &loop, &receive, &next}); }
"""


def hanging_image(tmp_path) -> str:
    """An image whose loop() does not return."""
    source, image = tmp_path / "hang.cpp", tmp_path / "hang.elf"
    source.write_text(HANGING_PROGRAM)
    layer = [path for path in (ROOT / "platforms/kilobot").glob("*.cpp")
             if path.stem not in ("kilobot_robot", "classic_home")]
    subprocess.run(
        ["avr-g++", "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-std=c++14", "-Os", "-flto",
         "-fno-threadsafe-statics", "-fshort-enums", f"-I{ROOT}",
         source, *layer, "-o", image], check=True)
    return str(image)


def hang(tmp_path, commands: list[str], seconds: float) -> swarm.Log:
    robots = swarm.grid(1, 1, 0, image=hanging_image(tmp_path),
                        bootloader=swarm.image("bootloader"))
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands}
    return swarm.emulate(tmp_path, robots, ohc=ohc, seconds=seconds, seed=1)


def last_motors(log) -> tuple[int, int]:
    event = log.of("motors", "k0")[-1]
    return event["left"], event["right"]


@pytest.mark.parametrize("message, colour", [(RESET, "green"), (BOOT, "blue")])
def test_reset_and_boot_reach_a_program_that_never_returns(tmp_path, message, colour):
    log = hang(tmp_path, command(2.1, RUN) + command(4.0, message), 7.0)
    assert log.of("led", "k0", red=3, green=3, blue=3), "it has run"
    flashes = [e for e in log.of("led", "k0") if e["time_us"] > 5e6 and e[colour]]
    assert flashes
    assert all(e["red"] == 0 for e in flashes)
    assert last_motors(log) == (0, 0)
