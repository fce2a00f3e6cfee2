"""Programs in the style of 2020 and before, as they would come to us, on Linux and for AVR.

Each is compiled with nothing but the folder of "swarmtalk.h" and a home, and several of it run as
processes that hear each other through a folder.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
INCLUDES = [f"-I{ROOT}", f"-I{ROOT}/core/include", f"-I{ROOT}/platforms/classic"]

# Of the release: globals, C casts, free setup() and loop(), and what its config.h would define.
MACROS = ["-DTOTAL_CHAN_NUM=3", "-DMAX_SUB_PER_CHAN=2"]
HOPS = """
#include "swarmtalk.h"

typedef struct gradient { int hop; } gradient_t;
Channel *channel;
Publisher *publisher;
gradient_t mine;
int told = -1;

void sent() { publisher->send((unsigned char *)&mine, sizeof(mine)); }
void heard(unsigned char *msg, int size, int ttl, Meta_t *meta) {
  gradient_t *theirs = (gradient_t *)msg;
  if (theirs->hop + 1 < mine.hop) mine.hop = theirs->hop + 1;
  if (size < (int)sizeof(gradient_t) || ttl != 0 || meta->dist > 60) mine.hop = -1000;
}
void never(unsigned char *, int, int, Meta_t *) { mine.hop = -2000; }
void setup() {
  const char *seed = getenv("SEED");
  mine.hop = seed != NULL ? 0 : 99;
  channel = swarmtalk.new_channel(5, 0, false);
  publisher = channel->new_publisher(sent);
  channel->new_subscriber(100, heard);
  channel->new_subscriber(1, never);
  sent();
}
void loop() {
  if (told == mine.hop) return;
  told = mine.hop;
  printf("hop %d\\n", told);
  LED_control->turn_on(told & 1, 0, 1, 2000);
  if (motor_control->current_status() == Stop) motor_control->turn_left(3);
}
"""

# Before the release: pointers to a node and a system, kilolib's colours, the C library's functions.
OLDER = """
#include "swarmtalk.h"
START_USER_PROGRAM
Channel *channel;
Publisher *publisher;
char text[20];
unsigned int drawn;
int motor_state = 0;

void sent() { publisher->send((unsigned char *)text, (int)strlen(text) + 1); }
void heard(unsigned char *msg, int size, int, Meta_t *meta) {
  char theirs[20];
  strncpy(theirs, (char *)msg, sizeof(theirs) - 1);
  theirs[19] = 0;
  printf("heard %s of %d after %d\\n", theirs, size, meta->msg_delay);
  set_color(RGB(0, 3, 1));
  if (motor_state++ == 0) motor_control->move_forward(2);
}
void setup() {
  drawn = swarmos.random_func() ^ (unsigned int)rand();
  strncpy(text, "good morning", sizeof(text));
  channel = swarmnet->new_channel(1, 3, true);
  publisher = channel->new_publisher(sent);
  channel->new_subscriber(1000, heard);
  sent();
}
void loop() {
  if (swarmos.get_clock() % 1000 == 999) set_color(RGB(0, 0, 0));
}
END_USER_PROGRAM
"""


def compile_linux(folder: pathlib.Path, source: str, *flags: str) -> pathlib.Path:
    path = folder / "program.cpp"
    path.write_text(source)
    for unit in (path, ROOT / "platforms/classic/linux_home.cpp"):
        subprocess.run(["g++", "-std=c++20", "-O1", "-Wall", "-Wextra", "-Werror", *flags,
                        *INCLUDES, "-c", unit, "-o", folder / f"{unit.stem}.o"], check=True)
    subprocess.run(["g++", folder / "program.o", folder / "linux_home.o", "-o", folder / "program"],
                   check=True)
    return folder / "program"


@pytest.fixture(autouse=True)
def _nothing_left_running():
    yield
    for process in Robots.started:
        if process.poll() is None:  # a test that failed
            process.kill()
            process.wait(60)
    Robots.started.clear()


@pytest.fixture(name="hops", scope="module")
def _hops(tmp_path_factory):
    """Compiled once, and only read."""
    return compile_linux(tmp_path_factory.mktemp("hops"), HOPS, *MACROS)


class Robots:
    """Processes in one air, ended by SIGTERM; what each prints goes to a file."""

    started = []

    def __init__(self, folder: pathlib.Path, program: pathlib.Path):
        self.folder, self.program, self.processes = folder, program, []
        self.air = folder / "air"

    def start(self, name: str, **environment: str) -> None:
        with open(self.folder / name, "w", encoding="utf-8") as out:
            self.processes.append(subprocess.Popen(
                [self.program], stdout=out,
                env={**os.environ, "SWARMTALK_AIR": str(self.air), "SWARMTALK_SPEED": "40",
                     **environment}))
        self.started.append(self.processes[-1])

    def text(self, name: str) -> str:
        return (self.folder / name).read_text(encoding="utf-8")

    def wait_for(self, name: str, pattern: str) -> None:
        end = time.monotonic() + 60
        while not re.search(pattern, self.text(name), re.M):
            assert time.monotonic() < end, f"{name} has no '{pattern}':\n{self.text(name)}"
            assert all(process.poll() is None for process in self.processes)
            time.sleep(0.02)

    def stop(self) -> None:
        for process in self.processes:
            process.send_signal(signal.SIGTERM)
        codes = [process.wait(60) for process in self.processes]
        assert codes == [0] * len(codes)
        assert not list(self.air.iterdir()), "each takes its socket with it"


def count_hops_in_a_line(folder, hops):
    robots = Robots(folder, hops)
    robots.start("r0", SEED="1", SWARMTALK_RANGE_MM="60")
    for place in (1, 2, 3):
        robots.start(f"r{place}", SWARMTALK_X_MM=str(50 * place), SWARMTALK_RANGE_MM="60")
    for place in (1, 2, 3):
        robots.wait_for(f"r{place}", f"^hop {place}$")
        robots.wait_for(f"r{place}", f"^led {place & 1} 0 1$")
        # It may hear of a shorter way while it turns.
        robots.wait_for(f"r{place}", r"^motor left\n(?:.*\n)*?motor stop$")
    robots.stop()
    assert not re.search("hop -", robots.text("r1") + robots.text("r2") + robots.text("r3"))


def run_a_program_from_before_the_release(folder, _):
    # 16 bits of time, so that a packet has room for three characters beside it.
    robots = Robots(folder, compile_linux(folder, OLDER, "-DTIMER_BITS=16"))
    robots.start("r0")
    robots.start("r1", SWARMTALK_X_MM="30", SWARMTALK_Y_MM="40")
    for name in ("r0", "r1"):
        robots.wait_for(name, r"^heard good morning of 15 after \d+$")
        robots.wait_for(name, "^led 0 255 85$")
        robots.wait_for(name, "^motor forward$")
    robots.stop()


def run_the_listing_of_the_paper(folder, _):
    """With the home's macros as the porting guide says."""
    robots = Robots(folder, compile_linux(folder, """
#include <iostream>
#include "core/classic/paper.h"
Publisher *publisher;
uint64_t state;
void sent() { publisher->send((unsigned char *)&state, sizeof(state)); }
void heard(unsigned char *msg, int, int, Data_t *sensing) {
  std::cout << *(uint64_t *)msg << " from " << sensing->dist << std::endl;
}
void setup() {
  state = 4711 + 0 * get_clock();
  Channel *channel = swarmtalk->new_channel(0, 0, false);
  publisher = channel->new_publisher(sent);
  channel->new_subscriber(100, heard);
  sent();
}
void loop() {}
""", "-DPKT_SIZE=9", "-DSWARMTALK_CLASSIC_CHECKSUM"))
    robots.start("r0")
    robots.start("r1", SWARMTALK_X_MM="50")
    robots.wait_for("r0", "^4711 from 50$")
    robots.stop()


@pytest.mark.clock
def test_programs_in_the_style_of_2020_hear_each_other(tmp_path, hops):
    for number, step in enumerate((count_hops_in_a_line, run_a_program_from_before_the_release,
                                   run_the_listing_of_the_paper)):
        folder = tmp_path / str(number)  # short: sockets are in it
        folder.mkdir()
        step(folder, hops)


def test_several_instances_talk_in_one_process_on_avr(tmp_path):
    """On Linux tests/unit/core/classic_test.cpp has them; here int has 16 bits and RAM 2 KiB."""
    console = pathlib.Path(os.environ["SWARMTALK_BUILD"]) / "tests/compilers/avr_console"
    if shutil.which("avr-g++") is None or not console.exists():
        pytest.skip("gcc-avr, avr-libc or libsimavr-dev is missing: run tools/setup test")
    source, image = tmp_path / "instances.cpp", tmp_path / "instances.elf"
    source.write_text("""
#define TOTAL_CHAN_NUM 1
#define SWARMTALK_CLASSIC_NO_GLOBALS
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include "core/classic/swarmtalk.h"
SwarmTalk::Swarmtalk seed, robot;
unsigned int now;
unsigned int read_clock() { return now; }
void say(const char *text) { while (*text) GPIOR2 = *text++; }
void heard(unsigned char *message, int size, int ttl, Meta_t *meta) {
  const bool is_right = message[0] == 1 && message[19] == 20 && size == 20 && ttl == 3 &&
                        meta->dist == 300 && meta->msg_delay == 0;
  say(is_right ? "heard\\n" : "wrong\\n");
}
void sent() { say("sent\\n"); }
int main() {
  seed.sys.set_common_sys_get_clock(read_clock);
  robot.sys.set_common_sys_get_clock(read_clock);
  seed.init();
  robot.init();
  robot.new_channel(15, 3, false)->new_subscriber(301, heard);
  Publisher *publisher = seed.new_channel(15, 3, false)->new_publisher(sent);
  unsigned char message[20], packet[PKT_SIZE];
  for (unsigned char i = 0; i < 20; ++i) message[i] = i + 1;
  publisher->send(message, 20);
  Meta_t meta = {300, 0};
  while (seed.next_pkt(packet) == PKT_SIZE) {
    now += 16;
    robot.receive(packet, PKT_SIZE, &meta);
    seed.receive(packet, robot.next_pkt(packet), &meta);
  }
  cli();
  sleep_mode();
}
""")
    subprocess.run(["avr-g++", "-mmcu=atmega328p", "-std=c++14", "-Os", "-fshort-enums", "-Wall",
                    "-fno-threadsafe-statics", *INCLUDES, source, "-o", image], check=True)
    run = subprocess.run([console, image], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout.splitlines()[-2:] == ["sent", "heard"]


def test_a_bad_place_is_refused_in_one_line(hops):
    for name, text, what in (("X_MM", "far", "a number"), ("SPEED", "0", "at least 0.01"),
                             ("RANGE_MM", "-3", "at least 0")):
        run = subprocess.run([hops], env={f"SWARMTALK_{name}": text}, capture_output=True,
                             text=True, timeout=60, check=False)
        assert run.returncode == 1
        assert run.stderr == f"SWARMTALK_{name} is '{text}': give it {what}\n"


@pytest.mark.parametrize("macros", [["-DPKT_SIZE=9"], [*MACROS, "-DCHAN_TYPE_MAX=3"],
                                    [*MACROS, "-DTIMER_BITS=16"]])
def test_a_home_with_other_macros_is_not_linked(tmp_path, hops, macros):
    """Two of them leave the sizes as they are and change nothing but packets."""
    subprocess.run(["g++", "-std=c++20", *INCLUDES, *macros, "-c",
                    ROOT / "platforms/classic/linux_home.cpp", "-o", tmp_path / "linux_home.o"],
                   check=True)
    link = subprocess.run(["g++", hops.parent / "program.o", tmp_path / "linux_home.o", "-o",
                           tmp_path / "program"], capture_output=True, text=True, check=False)
    assert link.returncode != 0
    assert "program_and_home_were_given_different_macros" in link.stderr


@pytest.mark.parametrize("bits", [3, 15])
def test_the_macros_of_a_config_decide_the_packet(tmp_path, bits):
    """CHAN_TYPE_MAX 3 is the template's format of 2-bit channels, 15 the shipped one."""
    source = tmp_path / "packet.cpp"
    source.write_text(f"""
#define CHAN_TYPE_MAX {bits}
#include "swarmtalk.h"
void setup() {{}}
void loop() {{}}
int main() {{
  unsigned char message[] = {{1}}, packet[PKT_SIZE];
  if (swarmtalk.new_channel(CHAN_TYPE_MAX + 1, 0, false) != NULL) return 1;
  swarmtalk.new_channel(2, 7, false)->new_publisher(NULL)->send(message, 1);
  swarmtalk.next_pkt(packet);
  printf("%02x", packet[2]);
}}
""")
    program = tmp_path / "packet"
    subprocess.run(["g++", "-std=c++20", *INCLUDES, source, "-o", program], check=True)
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    assert out == {3: "9c", 15: "27"}[bits]


def test_a_config_of_a_large_robot_works(tmp_path):
    """Long packets, many channels, and a largest number that no field of bits ends at."""
    source = tmp_path / "large.cpp"
    source.write_text("""
#define PKT_SIZE 1500
#define TOTAL_CHAN_NUM 16
#define CHAN_TYPE_MAX 20
#define FORWARD_BUFF_SIZE 50
#include "swarmtalk.h"
int heard_size;
void heard(unsigned char *message, int size, int, Meta_t *) {
  heard_size = message[9999] == 7 ? size : -1;
}
void setup() {}
void loop() {}
int main() {
  static SwarmTalk::Swarmtalk other;
  static unsigned char message[10000], packet[PKT_SIZE];
  message[9999] = 7;
  if (swarmtalk.new_channel(21, 0, false) != NULL) return 1;
  swarmtalk.new_channel(20, 2, false)->new_subscriber(100, heard);
  Publisher *publisher = other.new_channel(20, 2, false)->new_publisher(NULL);
  if (publisher->send(message, 10000) != 0 || publisher->send(message, 10000) != 1) return 2;
  Meta_t meta = {99, 0};
  while (other.next_pkt(packet) != 0) swarmtalk.receive(packet, PKT_SIZE, &meta);
  printf("%d", heard_size);
}
""")
    program = tmp_path / "large"
    subprocess.run(["g++", "-std=c++20", *INCLUDES, source, "-o", program], check=True)
    out = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    assert int(out) == 7 * 1496  # whole packets, as in 2020
