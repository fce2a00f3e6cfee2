"""Programs of the 2020 release, unchanged, on a Kilobot (platforms/kilobot/classic_home.cpp)."""
import pathlib
import subprocess

import pytest

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

# In the shape of those from before it.
OLDER = """
#include "swarmtalk.h"
START_USER_PROGRAM
Channel *channel;
Publisher *publisher;
char text[20];
volatile unsigned char heard[2];

void sent() { publisher->send((unsigned char *)text, (int)strlen(text) + 1); }
void receive(unsigned char *message, int size, int ttl, Meta_t *) {
  char theirs[20];
  strncpy(theirs, (char *)message, sizeof(theirs));
  printf("%s\\n", theirs);
  heard[0] = strlen(theirs) == 7 && size == 10 ? 16 : 1;
  heard[1] = (unsigned char)(40 + 2 * ttl);
  set_color(RGB(0, 3, 0));
  motor_control->turn_left(3);
}
void setup() {
  strncpy(text, "morning", sizeof(text));
  if ((swarmos.random_func() ^ (unsigned int)rand()) == swarmos.get_clock()) text[0]--;
  channel = swarmnet->new_channel(1, 5, false);
  publisher = channel->new_publisher(sent);
  channel->new_subscriber(100, receive);
  sent();
}
void loop() {}
END_USER_PROGRAM
"""


@pytest.mark.parametrize("program", [PROGRAM, swarm.in_the_field(OLDER)], ids=["release", "older"])
def test_a_program_of_2020_talks_lights_and_moves(tmp_path, program):
    source, image = tmp_path / "program.cpp", tmp_path / "program.elf"
    source.write_text(program)
    layer = list((ROOT / "platforms/kilobot").glob("*.cpp"))
    subprocess.run(
        ["avr-g++", "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-std=c++14", "-Os", "-flto",
         "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-fno-threadsafe-statics",
         "-fshort-enums", f"-I{ROOT}", f"-I{ROOT}/core/include", f"-I{ROOT}/platforms/classic",
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
