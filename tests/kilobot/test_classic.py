"""Programs of the 2020 release, unchanged, on a Kilobot (platforms/kilobot/classic_home.cpp)."""
import pathlib
import subprocess

import swarm

ROOT = pathlib.Path(__file__).resolve().parents[2]

# In the shape of the programs that came with that release.
PROGRAM = """
#include "swarmtalk.h"

Channel *channel;
Publisher *publisher;
volatile unsigned char heard[2];

void sent() { unsigned char message[2] = {7, 9}; publisher->send(message, 2); }
void receive(unsigned char *message, int size, int ttl, Meta_t *meta) {
  heard[0] = message[0] + message[1];
  heard[1] = meta->dist;
  LED_control->turn_on(0, 255, 0, 5);
  if (motor_control->current_status() == Stop) motor_control->turn_left(3);
}
void setup() {
  channel = swarmtalk.new_channel(1, 0, false);
  publisher = channel->new_publisher(sent);
  channel->new_subscriber(100, receive);
  sent();
}
void loop() {}
"""


def test_a_program_of_2020_talks_lights_and_moves(tmp_path):
    source, image = tmp_path / "program.cpp", tmp_path / "program.elf"
    source.write_text(PROGRAM)
    layer = list((ROOT / "platforms/kilobot").glob("*.cpp"))
    subprocess.run(
        ["avr-g++", "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-std=c++14", "-Os", "-flto",
         "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-fno-threadsafe-statics",
         "-fshort-enums", f"-I{ROOT}", f"-I{ROOT}/core/include", f"-I{ROOT}/core/classic",
         source, *layer, "-o", image], check=True)
    log = swarm.emulate(tmp_path, swarm.grid(1, 2, 50, image=str(image)),
                        ohc=swarm.overhead("run@2.1", "stop@3.1"), seconds=6, seed=1,
                        watch=["heard:1", "heard+1:1"])
    for node in ("k0", "k1"):
        assert log.variable(node, "heard:1") == 16
        assert abs(log.variable(node, "heard+1:1") - 50) <= 1
        assert log.of("led", node, green=3)
        assert [e for e in log.of("motors", node) if e["left"] > 0 and e["right"] == 0]
        assert log.of("sent", node, type=0)
