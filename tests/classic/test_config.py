"""The macros of a 2020 config.h: each puts other packets on the air, as docs/wire-format.md orders
the fields, or is refused by its name; program and home are not linked if one differs; and the files
that came with the release are taken as they are.

Expected packets are put together here, bit by bit, and not by the library.
"""
import pathlib
import shutil
import subprocess

import pytest

from test_programs import HOPS, INCLUDES, ROOT

# What the release was configured with: for the Kilobot, and the template for others.
SHIPPED = {"PKT_SIZE": 8, "NODE_ID_BITS": 8, "MSG_ID_BITS": 4, "SEQ_NUM_BITS": 3,
           "CHAN_TYPE_BITS": 4, "TTL_BITS": 4, "WITH_CRC": "false", "TIMER_BITS": 32,
           "TOTAL_CHAN_NUM": 2, "BUFF_SIZE_PER_CHAN": 20, "FORWARD_BUFF_SIZE": 10,
           "MAX_SUB_PER_CHAN": 1, "MAX_PUB_PER_CHAN": 1, "CACHE_SIZE": 5}
TEMPLATE = {**SHIPPED, "CHAN_TYPE_BITS": 2, "BUFF_SIZE_PER_CHAN": 300, "FORWARD_BUFF_SIZE": 50,
            "MAX_SUB_PER_CHAN": 10, "MAX_PUB_PER_CHAN": 10}
META = "typedef struct Meta { int dist; int msg_delay; } Meta_t;"

# Sends what its arguments say until the message has the number asked for, and prints its packets;
# or hears packets, and prints what is delivered and what is sent on.
SPEAKER = """
#include "swarmtalk.h"
unsigned int now, node;
static SwarmTalk::Swarmtalk robot;
void setup() {}
void loop() {}
unsigned int read_clock() { return now; }
unsigned int draw() { return node; }
void print(const char *word, const unsigned char *bytes, int size) {
  printf("%s", word);
  for (int i = 0; i < size; i++) printf("%02x", bytes[i]);
}
int parse(const char *text, unsigned char *bytes) {
  int size = 0;
  for (unsigned byte; sscanf(text + 2 * size, "%2x", &byte) == 1; size++) bytes[size] = byte;
  return size;
}
void heard(unsigned char *message, int size, int ttl, Meta_t *meta) {
  print("deliver ", message, size);
  printf(" ttl %d dist %d delay %d\\n", ttl, meta->dist, meta->msg_delay);
}
int main(int argc, char **argv) {
  static unsigned char bytes[70000], packet[PKT_SIZE];
  node = atoi(argv[2]);
  const int channel_type = atoi(argv[3]), ttl = atoi(argv[4]);
  const bool is_timed = argv[5][0] == '1';
  robot.sys.set_common_sys_get_clock(read_clock);
  robot.sys.set_common_sys_random_func(draw);
  Channel *channel = robot.new_channel(channel_type, ttl, is_timed);
  if (channel == NULL) { printf("no channel\\n"); return 0; }
  if (argv[1][0] == 's') {
    const int size = parse(argv[6], bytes);
    Publisher *publisher = channel->new_publisher(NULL);
    for (int n = 0; n < 70000; n++) {
      now = 1000;
      const int error = publisher->send(bytes, size);
      if (error != 0) { printf("error %d\\n", error); return 0; }
      now = 1000 + atoi(argv[8]);
      printf("message\\n");
      while (robot.next_pkt(packet) != 0) { print("packet ", packet, PKT_SIZE); printf("\\n"); }
      if (n == atoi(argv[7])) return 0;
    }
  }
  channel->new_subscriber(100, heard);
  for (int i = 6; i < argc; i++) {
    Meta_t meta = {};
    meta.dist = 7;
    robot.receive(bytes, parse(argv[i], bytes), &meta);
    while (robot.next_pkt(packet) != 0) { print("forward ", packet, PKT_SIZE); printf("\\n"); }
  }
}
"""


def config_text(macros: dict, meta: str = META) -> str:
    lines = [f"#define {name} {value}" for name, value in macros.items()]
    return "\n".join(["#ifndef OUR_CONFIG_H", "#define OUR_CONFIG_H", meta,
                      "#define DEBUG false", "#define USE_FUNCTIONAL false", *lines, "#endif\n"])


def compile_with(folder: pathlib.Path, source: str, config: str, *flags: str,
                 compiler: str = "g++") -> subprocess.CompletedProcess:
    (folder / "config.h").write_text(config)
    (folder / "program.cpp").write_text(source)
    return subprocess.run([compiler, "-std=c++20", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
                           "-include", folder / "config.h", *flags, *INCLUDES,
                           folder / "program.cpp", "-o", folder / "program"],
                          capture_output=True, text=True, check=False)


class Speaker:
    def __init__(self, folder: pathlib.Path, macros: dict, *flags: str):
        self.program, self.macros = folder / "program", macros
        built = compile_with(folder, SPEAKER, config_text(macros), *flags)
        assert built.returncode == 0, built.stderr

    def run(self, *arguments) -> list[str]:
        run = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True,
                             timeout=60, check=True)
        return run.stdout.splitlines()

    def send(self, message: int, *, node=165, channel=2, ttl=7, timed=0, text="112233",
             waited=0) -> list[str]:
        """The packets of the message with this number, whatever number comes first."""
        count = 2 ** self.macros["MSG_ID_BITS"] if self.macros["MSG_ID_BITS"] < 9 else 1
        lines = self.run("send", node, channel, ttl, timed, text, count, waited)
        messages = "\n".join(lines).split("message\n")[1:]
        for packets in messages:
            packets = packets.replace("packet ", "").split()
            if count == 1 or self.number_in(packets[0]) == message:
                return packets
        raise AssertionError(f"no message has the number {message}")

    def number_in(self, packet: str) -> int:
        bits = f"{int(packet, 16):0{4 * len(packet)}b}"
        at = self.macros["NODE_ID_BITS"]
        return int(bits[at:at + self.macros["MSG_ID_BITS"]], 2)


def packet(macros: dict, payload: bytes, *, message=9, sequence=0, end=1, node=165, channel=2,
           ttl=7) -> str:
    """As docs/wire-format.md draws it."""
    fields = [(node, "NODE_ID_BITS"), (message, "MSG_ID_BITS"), (sequence, "SEQ_NUM_BITS"),
              (end, 1), (channel, "CHAN_TYPE_BITS"), (ttl, "TTL_BITS")]
    bits = ""
    for value, width in fields:
        width = macros.get(width, width)
        bits += f"{value % 2 ** width:0{width}b}" if width else ""
    header = bytes(int(bits[i:i + 8].ljust(8, "0"), 2) for i in range(0, len(bits), 8))
    checksum = macros["WITH_CRC"] == "true"
    frame = (header + payload).ljust(macros["PKT_SIZE"] - checksum, b"\0")
    return (frame + bytes([sum(frame) % 256]) * checksum).hex()


ODD = {"PKT_SIZE": 12, "NODE_ID_BITS": 10, "MSG_ID_BITS": 5, "CHAN_TYPE_BITS": 3, "TTL_BITS": 6,
       "WITH_CRC": "true"}
CHANGES = [
    {}, {"CHAN_TYPE_BITS": 2}, {"WITH_CRC": "true"}, {"WITH_CRC": "true", "PKT_SIZE": 9},
    {"NODE_ID_BITS": 10}, {"NODE_ID_BITS": 4}, {"NODE_ID_BITS": 16},
    {"MSG_ID_BITS": 5}, {"MSG_ID_BITS": 8}, {"MSG_ID_BITS": 16, "PKT_SIZE": 12},
    {"MSG_ID_BITS": 32, "PKT_SIZE": 12},
    {"SEQ_NUM_BITS": 0}, {"SEQ_NUM_BITS": 1}, {"SEQ_NUM_BITS": 5},
    {"CHAN_TYPE_BITS": 7}, {"CHAN_TYPE_BITS": 16}, {"TTL_BITS": 3}, {"TTL_BITS": 8},
    {"TIMER_BITS": 13}, {"TIMER_BITS": 0}, {"PKT_SIZE": 1500}, ODD,
]
# Sanitizers look at the extremes alone: they treble what a configuration costs.
SANITIZERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]
SANITIZED = [{"MSG_ID_BITS": 32, "PKT_SIZE": 12}, {"SEQ_NUM_BITS": 0}, {"PKT_SIZE": 1500}, ODD]


def ids(change: dict) -> str:
    return "-".join(f"{name}_{value}" for name, value in change.items()) or "shipped"


@pytest.fixture(name="speakers", scope="module")
def _speakers(tmp_path_factory):
    """Each is compiled when a test first asks for it."""
    built = {}

    def get(change: dict) -> Speaker:
        if ids(change) not in built:
            flags = SANITIZERS if change in SANITIZED else []
            built[ids(change)] = Speaker(tmp_path_factory.mktemp("speaker"), {**SHIPPED, **change},
                                         *flags)
        return built[ids(change)]
    return get


@pytest.mark.parametrize("change", CHANGES, ids=ids)
def test_its_widths_are_on_the_air(speakers, change):
    speaker = speakers(change)
    macros = speaker.macros
    wide = macros["MSG_ID_BITS"] > 8  # too many to wait for one: whatever comes
    bare = packet(macros, b"", node=0, message=0, channel=0, ttl=0)
    payload = macros["PKT_SIZE"] - (macros["WITH_CRC"] == "true") - (
        sum(macros[name] for name in ("NODE_ID_BITS", "MSG_ID_BITS", "SEQ_NUM_BITS",
                                      "CHAN_TYPE_BITS", "TTL_BITS")) + 1 + 7) // 8
    assert len(bare) == 2 * macros["PKT_SIZE"]

    # One packet, and as many as there can be: sent, heard, sent on.
    most = 2 ** macros["SEQ_NUM_BITS"]
    for text in (bytes([0x11, 0x22, 0x33]), bytes(i % 251 for i in range(most * payload))):
        text = text[:most * payload]
        sent = speaker.send(9, text=text.hex())
        number = speaker.number_in(sent[0]) if wide else 9
        expected = [packet(macros, text[at:at + payload], message=number, sequence=n,
                           end=at + payload >= len(text))
                    for n, at in enumerate(range(0, len(text), payload))]
        assert sent == expected
        heard = speaker.run("hear", 3, 2, 7, 0, *sent)
        padded = text.ljust(len(expected) * payload, b"\0").hex()
        assert [line for line in heard if line.startswith("deliver")] == [
            f"deliver {padded} ttl 7 dist 7 delay 0"]
        assert [line for line in heard if line.startswith("forward")] == [
            "forward " + packet(macros, text[at:at + payload], message=number, sequence=n,
                                end=at + payload >= len(text), ttl=6)
            for n, at in enumerate(range(0, len(text), payload))]
    assert speaker.run("send", 165, 2, 7, 0, "00" * (most * payload + 1), 0, 0)[-1] == "error 2"

    # The largest number of each field.
    most_channel, most_ttl = 2 ** macros["CHAN_TYPE_BITS"] - 1, 2 ** macros["TTL_BITS"] - 1
    sent = speaker.send(9, channel=most_channel, ttl=most_ttl, text="ff")
    number = speaker.number_in(sent[0])
    assert sent == [packet(macros, b"\xff", message=number, channel=most_channel, ttl=most_ttl)]
    for arguments in ((most_channel + 1, 0), (0, most_ttl + 1)):
        assert speaker.run("send", 1, *arguments, 0, "00", 0, 0) == ["no channel"]

    # Timestamps, where they leave room.
    stamp = (macros["TIMER_BITS"] + 7) // 8
    if macros["TIMER_BITS"] == 0 or payload <= stamp:
        assert speaker.run("send", 1, 1, 0, 1, "00", 0, 0) == ["no channel"]
        return
    for waited in (300, 70000):
        told = min(waited, 2 ** macros["TIMER_BITS"] - 1)
        sent = speaker.send(9, timed=1, text="5a", waited=waited)
        body = b"\x5a".ljust(payload - stamp, b"\0") + told.to_bytes(stamp, "little")
        assert sent == [packet(macros, body, message=speaker.number_in(sent[0]))]
        assert speaker.run("hear", 3, 2, 0, 1, sent[0])[0].endswith(f"delay {told}")


@pytest.mark.parametrize("change, golden", [
    ({"CHAN_TYPE_BITS": 2}, "a5919c1122330000"),
    ({}, "a591271122330000"),
    ({"WITH_CRC": "true", "PKT_SIZE": 9}, "a591271122330000c3"),
    (ODD, "295228701122330000000079"),
], ids=["template", "shipped", "paper", "odd"])
def test_it_sends_what_2020_sent(speakers, change, golden):
    assert speakers(change).send(9) == [golden]


@pytest.mark.parametrize("macros, meta", [
    (SHIPPED, META), (TEMPLATE, META),
    (SHIPPED, "typedef struct { int dist; int msg_delay; } Meta_t;"),
    (TEMPLATE, "struct Meta_t { int dist, msg_delay; };"), (SHIPPED, "")],
    ids=["kilobot", "template", "nameless", "struct", "none"])
def test_the_files_of_the_release_are_taken_as_they_are(tmp_path, macros, meta):
    source = """
#include "swarmtalk.h"
int heard_count, sent_count;
void sent() { sent_count++; }
void heard(unsigned char *, int, int, Meta_t *meta) { heard_count += meta->dist; }
void setup() {}
void loop() {}
int main() {
  static SwarmTalk::Swarmtalk other;
  Channel *channel = swarmtalk.new_channel(CHAN_TYPE_MAX, 0, false);
  Channel *its_channel = other.new_channel(CHAN_TYPE_MAX, 0, false);
  Publisher *publisher = NULL;
  for (int i = 0; i < MAX_PUB_PER_CHAN; i++) publisher = channel->new_publisher(sent);
  if (publisher == NULL || channel->new_publisher(sent) != NULL) return 1;
  for (int i = 0; i < MAX_SUB_PER_CHAN; i++) its_channel->new_subscriber(5, heard);
  unsigned char message[] = {1}, packet[PKT_SIZE];
  publisher->send(message, 1);
  swarmtalk.next_pkt(packet);
  Meta_t near = {4, 0}, far = {5, 0};
  other.receive(packet, PKT_SIZE, &far);
  other.receive(packet, PKT_SIZE, &near);
  printf("%d %d", sent_count, heard_count);
}
"""
    built = compile_with(tmp_path, source, config_text(macros, meta))
    assert built.returncode == 0, built.stderr
    out = subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True).stdout
    assert out == f"{macros['MAX_PUB_PER_CHAN']} {4 * macros['MAX_SUB_PER_CHAN']}"


def test_a_robot_may_measure_more(tmp_path):
    """What a platform adds to its Meta_t comes through."""
    source = """
#include "swarmtalk.h"
float heard_bearing;
void heard(unsigned char *, int, int, Meta_t *meta) { heard_bearing = meta->bearing; }
void setup() {}
void loop() {}
int main() {
  static SwarmTalk::Swarmtalk other;
  other.new_channel(1, 0, false)->new_subscriber(100, heard);
  unsigned char message[] = {1}, packet[PKT_SIZE];
  swarmtalk.new_channel(1, 0, false)->new_publisher(NULL)->send(message, 1);
  swarmtalk.next_pkt(packet);
  Meta_t meta = {};
  meta.bearing = 1.5f;
  other.receive(packet, PKT_SIZE, &meta);
  printf("%g", heard_bearing);
}
"""
    meta = "typedef struct Meta { float bearing; int msg_delay; int dist; } Meta_t;"
    built = compile_with(tmp_path, source, config_text(SHIPPED, meta))
    assert built.returncode == 0, built.stderr
    out = subprocess.run([tmp_path / "program"], capture_output=True, text=True, check=True).stdout
    assert out == "1.5"


def test_a_node_has_more_channels_than_a_byte_counts(tmp_path):
    source = """
#include "swarmtalk.h"
void setup() {}
void loop() {}
int main() {
  Channel *first = swarmtalk.new_channel(0, 0, false);
  for (int i = 1; i < TOTAL_CHAN_NUM; i++)
    if (swarmtalk.new_channel(i, 0, false) == NULL) return 1;
  if (swarmtalk.new_channel(TOTAL_CHAN_NUM, 0, false) != NULL) return 2;
  unsigned char message[] = {1}, packet[PKT_SIZE];
  first->new_publisher(NULL)->send(message, 1);
  if (swarmtalk.next_pkt(packet) != PKT_SIZE) return 3;
  return (packet[1] & 15) == 1 && packet[2] == 0 ? 0 : 4;  // the end, and channel 0
}
"""
    built = compile_with(tmp_path, source, config_text(
        {**SHIPPED, "PKT_SIZE": 12, "CHAN_TYPE_BITS": 12, "TOTAL_CHAN_NUM": 300}))
    assert built.returncode == 0, built.stderr
    assert subprocess.run([tmp_path / "program"], check=False).returncode == 0


REFUSED = [
    ({"NODE_ID_BITS": 17}, "NODE_ID_BITS: node ids have 1 to 16 bits"),
    ({"NODE_ID_BITS": 0}, "NODE_ID_BITS: node ids have 1 to 16 bits"),
    ({"MSG_ID_BITS": 33}, "MSG_ID_BITS: message numbers have 1 to 32 bits"),
    ({"MSG_ID_BITS": 0}, "MSG_ID_BITS: message numbers have 1 to 32 bits"),
    ({"SEQ_NUM_BITS": 6}, "SEQ_NUM_BITS: sequence numbers have 0 to 5 bits"),
    ({"SEQ_NUM_BITS": 300}, "SEQ_NUM_BITS: sequence numbers have 0 to 5 bits"),
    ({"CHAN_TYPE_BITS": 17}, "CHAN_TYPE_BITS: channels have 1 to 16 bits"),
    ({"CHAN_TYPE_BITS": 0}, "CHAN_TYPE_BITS: channels have 1 to 16 bits"),
    ({"CHAN_TYPE_MAX": 7}, "CHAN_TYPE_MAX and CHAN_TYPE_BITS contradict each other"),
    ({"TTL_BITS": 9}, "TTL_BITS: the TTL has 0 to 8 bits"),
    ({"TIMER_BITS": 33}, "TIMER_BITS: a timestamp has 0 to 32 bits"),
    ({"PKT_SIZE": 65536}, "PKT_SIZE: a packet has 1 to 65535 bytes"),
    ({"PKT_SIZE": 3}, "PKT_SIZE: header and checksum leave nothing for a message"),
    ({"PKT_SIZE": 9000}, "PKT_SIZE: the packets that SEQ_NUM_BITS counts hold more than 65535"),
    ({"TOTAL_CHAN_NUM": 2001}, "TOTAL_CHAN_NUM: a node has 1 to 2000 channels"),
    ({"TOTAL_CHAN_NUM": 0}, "TOTAL_CHAN_NUM: a node has 1 to 2000 channels"),
    ({"BUFF_SIZE_PER_CHAN": 40000}, "BUFF_SIZE_PER_CHAN: all channels together hold 1 to 65535"),
    ({"BUFF_SIZE_PER_CHAN": 0}, "BUFF_SIZE_PER_CHAN: all channels together hold 1 to 65535"),
    ({"FORWARD_BUFF_SIZE": 65536}, "FORWARD_BUFF_SIZE: 1 to 65535 packets wait"),
    ({"MAX_SUB_PER_CHAN": 256}, "MAX_SUB_PER_CHAN: 1 to 255 subscribers"),
    ({"MAX_PUB_PER_CHAN": 256}, "MAX_PUB_PER_CHAN: 1 to 255 publishers"),
    ({"CACHE_SIZE": 65536}, "CACHE_SIZE: 0 to 65535 messages"),
    ({"SWARMTALK_CLASSIC_CHECKSUM": 1}, "WITH_CRC is false, and SWARMTALK_CLASSIC_CHECKSUM asks"),
]


@pytest.mark.parametrize("change, sentence", REFUSED, ids=[ids(change) for change, _ in REFUSED])
def test_what_cannot_be_is_refused_by_its_name(tmp_path, change, sentence):
    built = compile_with(tmp_path, '#include "core/classic/config.hpp"',
                         config_text({**SHIPPED, **change}), "-fsyntax-only")
    assert built.returncode != 0
    assert sentence in built.stderr


HOME = """
#define SWARMTALK_CLASSIC_NO_GLOBALS
#include "core/classic/swarmtalk.h"
int main() { SwarmTalk::compare_macros_with_the_program(); }
"""


def test_a_home_with_one_other_macro_is_not_linked(tmp_path):
    def build(name: str, source: str, config: str) -> pathlib.Path:
        unit, header = tmp_path / f"{name}.cpp", tmp_path / f"{name}.h"
        unit.write_text(source)
        header.write_text(config)
        subprocess.run(["g++", "-std=c++20", "-include", header, *INCLUDES, "-c", unit,
                        "-o", tmp_path / f"{name}.o"], check=True)
        return tmp_path / f"{name}.o"

    def link(home: pathlib.Path) -> subprocess.CompletedProcess:
        return subprocess.run(["g++", program, home, "-o", tmp_path / "robot"],
                              capture_output=True, text=True, check=False)

    program = build("program", HOPS, config_text(SHIPPED))
    assert link(build("same", HOME, config_text(SHIPPED))).returncode == 0
    others = {"PKT_SIZE": 9, "NODE_ID_BITS": 7, "MSG_ID_BITS": 3, "SEQ_NUM_BITS": 2,
              "CHAN_TYPE_BITS": 3, "TTL_BITS": 3, "WITH_CRC": "true", "TIMER_BITS": 31,
              "TOTAL_CHAN_NUM": 3, "BUFF_SIZE_PER_CHAN": 21, "FORWARD_BUFF_SIZE": 11,
              "MAX_SUB_PER_CHAN": 2, "MAX_PUB_PER_CHAN": 2, "CACHE_SIZE": 99}
    assert set(others) == set(SHIPPED)
    homes = {name: config_text({**SHIPPED, name: value}) for name, value in others.items()}
    homes["Meta_t"] = config_text(SHIPPED, "")
    for name, config in homes.items():
        linked = link(build(name, HOME, config))
        assert linked.returncode != 0, f"{name} differs"
        assert "program_and_home_were_given_different_macros" in linked.stderr


def test_the_kilobots_file_is_taken_on_a_kilobot(tmp_path):
    """Program and home with -include, as the porting guide says; int has 16 bits there."""
    if shutil.which("avr-g++") is None:
        pytest.skip("gcc-avr or avr-libc is missing: run tools/setup test")
    (tmp_path / "config.h").write_text(config_text(SHIPPED))
    (tmp_path / "program.cpp").write_text(HOPS.replace('getenv("SEED")', "NULL"))
    subprocess.run(["avr-g++", "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-std=c++14", "-Os",
                    "-flto", "-Wall", "-ffunction-sections", "-fdata-sections",
                    "-Wl,--gc-sections", "-fno-threadsafe-statics", "-fshort-enums",
                    "-include", tmp_path / "config.h", *INCLUDES, tmp_path / "program.cpp",
                    *(ROOT / "platforms/kilobot").glob("*.cpp"), "-o", tmp_path / "program.elf"],
                   check=True)
