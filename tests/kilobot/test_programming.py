"""Programming over infrared: through our bootloader, byte for byte, and never past its bounds."""
import random

import pytest

import elf_image
import swarm
from overhead_frames import (BOOT, PROGRAM_PAGES, RUN, command, forward, page, send_at, upload)

BOOTLOADER_ADDRESS = 0x7000
PASSES = 6


def bootloader_bytes(tmp_path) -> bytes:
    return elf_image.flash_bytes(swarm.image("bootloader"), tmp_path)


def robots(count: int, name: str) -> list[dict]:
    return swarm.grid(1, count, 40, image=swarm.image(name), bootloader=swarm.image("bootloader"))


def run_and_dump(tmp_path, nodes, commands, seconds, **options) -> tuple[swarm.Log, list[bytes]]:
    """Runs the commands. @return log, and the robots' flash at the end"""
    dumps = [tmp_path / f"k{i}.bin" for i in range(len(nodes))]
    arguments = [word for i, dump in enumerate(dumps) for word in ("--dump-flash", f"k{i}={dump}")]
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands}
    log = swarm.emulate(tmp_path, nodes, ohc=ohc, arguments=tuple(arguments), seconds=seconds,
                        drift_ppm=10000, **options)
    return log, [dump.read_bytes() for dump in dumps]


def test_two_robots_are_programmed_with_one_percent_loss_and_run(tmp_path):
    program = elf_image.flash_bytes(swarm.image("beacon"), tmp_path)
    commands = command(2.1, BOOT, hold=0.5)
    more, end = upload(3.0, program, PASSES)
    commands += more + command(end + 0.3, RUN, hold=1.0)
    log, flashes = run_and_dump(tmp_path, robots(2, "hop_count"), commands, end + 3.5, seed=5,
                                medium={"loss": 0.01}, watch=["beacon_heard:2"])
    print(f"{len(program)} bytes, {PASSES} passes, {end:.0f} s")
    for i, flash in enumerate(flashes):
        assert flash[:len(program)] == program, f"robot k{i}"
        boot = bootloader_bytes(tmp_path)
        assert flash[BOOTLOADER_ADDRESS:BOOTLOADER_ADDRESS + len(boot)] == boot
    after = [e for i in range(2) for e in log.of("sent", f"k{i}", type=0x10)]
    assert {e["node"] for e in after} == {"k0", "k1"}, "the new program runs in both"


def test_nine_robots_are_whole_after_three_passes_with_one_percent_loss(tmp_path):
    """Each keeps what it has heard: a part is missing only if it was lost three times."""
    program = elf_image.flash_bytes(swarm.image("beacon"), tmp_path)
    commands = command(2.1, BOOT, hold=0.5)
    more, end = upload(3.0, program, 3)
    _, flashes = run_and_dump(tmp_path, robots(9, "hop_count"), commands + more, end + 0.5,
                              seed=11, medium={"loss": 0.01, "range_mm": 1000})
    assert [flash[:len(program)] == program for flash in flashes] == [True] * 9


def test_no_page_number_reaches_the_bootloader(tmp_path):
    """Each page that is none of a program's, then a program that must still be taken."""
    program = bytes((7 * i + 3) % 256 for i in range(256))
    commands = command(2.1, BOOT, hold=0.5)
    at = 3.0
    for number in (219, 220, 223, 224, 239, 255):
        # Raw messages, since our controller refuses such frames itself.
        for part in range(22):
            data = bytes([number, 3 * part]) + b"\xaa" * 6
            commands.append(send_at(at, forward(0x81, data, kind=6)))
            at += 0.0344 + 0.0125
    commands.append(send_at(at, forward(PROGRAM_PAGES, b"\x00")))
    commands.append(send_at(at + 0.2, forward(PROGRAM_PAGES, b"\xff")))
    at += 0.4
    more, end = upload(at, program, 1)
    _, flashes = run_and_dump(tmp_path, robots(1, "hop_count"), commands + more, end + 0.2, seed=1)
    boot = bootloader_bytes(tmp_path)
    flash = flashes[0]
    assert flash[BOOTLOADER_ADDRESS:BOOTLOADER_ADDRESS + len(boot)] == boot
    assert flash[220 * 128:BOOTLOADER_ADDRESS] == b"\xff" * (BOOTLOADER_ADDRESS - 220 * 128)
    assert flash[219 * 128:220 * 128] == b"\xaa" * 128, "the last page of a program is writable"
    assert flash[:256] == program


def test_page_with_a_hole_is_not_written(tmp_path):
    """21 of 22 parts, twice, of a one-page program: the part that never came stays missing."""
    commands = command(2.1, BOOT, hold=0.5) + [send_at(2.8, forward(PROGRAM_PAGES, b"\x01"))]
    at = 3.0
    for _ in range(2):
        for part in range(22):
            if part != 5:
                data = bytes([0, 3 * part]) + bytes([part]) * 6
                commands.append(send_at(at, forward(0x81, data, kind=6)))
                at += 0.0344 + 0.0125
    program = elf_image.flash_bytes(swarm.image("hop_count"), tmp_path)
    _, flashes = run_and_dump(tmp_path, robots(1, "hop_count"), commands, at + 0.5, seed=1)
    assert flashes[0][:128] == program[:128]


def test_message_of_a_neighbour_starts_the_old_program_again(tmp_path):
    """The standard bootloader's way out, as long as nothing has been taken."""
    commands = command(2.1, BOOT, hold=0.3) + command(3.0, 0x10, hold=0.1)
    commands += command(3.5, RUN, hold=0.5)
    log, _ = run_and_dump(tmp_path, robots(1, "beacon"), commands, 5.0, seed=1)
    assert log.of("sent", "k0", type=0x10)


def test_the_overhead_controller_refuses_pages_beyond_programs(tmp_path):
    commands = [send_at(2.1, page(224, b"\0" * 128)), send_at(2.4, page(219, b"\0" * 128))]
    log, _ = run_and_dump(tmp_path, robots(1, "blank"), commands, 2.8, seed=1)
    sent = log.of("sent", "ohc")
    assert len(sent) == 22
    assert all(e["data"].startswith("db") for e in sent)


def parts_at(seconds: float, program: bytes, chosen) -> tuple[list[str], float]:
    """Single messages with some parts of a program. @return commands, and when all are sent"""
    commands = []
    for number, part in chosen:
        page_bytes = program[128 * number:128 * number + 128].ljust(132, b"\xff")
        data = bytes([number, 3 * part]) + page_bytes[6 * part:6 * part + 6]
        commands.append(send_at(seconds, forward(0x81, data, kind=6)))
        seconds += 0.0344 + 0.0125
    return commands, seconds


def test_a_page_is_filled_up_by_later_passes(tmp_path):
    """No pass has it whole: even parts in the first, odd ones in the second, page 0 backwards."""
    program = bytes((7 * i + 3) % 256 for i in range(3 * 128))
    commands = command(2.1, BOOT, hold=0.5) + [send_at(2.8, forward(PROGRAM_PAGES, b"\x03"))]
    at = 3.0
    for first in (0, 1):
        for number in (2, 0, 1):
            chosen = [(number, part) for part in range(first, 22, 2)]
            more, at = parts_at(at, program, reversed(chosen) if number == 0 else chosen)
            commands += more
            at += 0.03
    _, flashes = run_and_dump(tmp_path, robots(1, "hop_count"), commands, at + 0.5, seed=1)
    assert flashes[0][:len(program)] == program


def intel_hex(flash: bytes) -> str:
    """A whole flash as an image for the emulator."""
    lines = []
    for at in range(0, len(flash), 16):
        record = bytes([16, at >> 8, at & 0xFF, 0]) + flash[at:at + 16]
        lines.append(":" + (record + bytes([-sum(record) & 0xFF])).hex().upper())
    return "\n".join(lines + [":00000001FF"]) + "\n"


TRIES = 20  # of half a minute each
WRITING_S = 0.012  # page 0 is erased and written twice, 9 ms each time
SHORT = bytes((7 * i + 3) % 256 for i in range(3 * 128))  # a program that does nothing


def power_cuts(cuts: int, pages_at: list[float], end: float) -> list[float]:
    """Times, half of them while page 0 is in hand (the first and the last time that flash changes
    for a program) and half of them at any time."""
    draw = random.Random(cuts)
    narrow = [(at - WRITING_S, at + WRITING_S) for at in (pages_at[0], pages_at[-1])]
    return [draw.uniform(*narrow[i // 2 % 2]) if i % 2 else draw.uniform(2.9, end)
            for i in range(cuts)]


@pytest.mark.parametrize("cuts", [8, swarm.in_the_field(1000)])
def test_a_robot_that_loses_power_while_programmed_takes_the_program_again(tmp_path, cuts):
    """At any time, with page 0 in the air or being written or not: it starts, and can be
    programmed."""
    commands = command(2.1, BOOT, hold=0.5)
    more, end = upload(3.0, SHORT, 1)
    commands += more
    own = [robot | {"resets_to_bootloader": True} for robot in robots(1, "blank")]
    log, _ = run_and_dump(tmp_path, own, commands, end + 0.2, seed=1)
    pages_at = [e["time_us"] / 1e6 for e in log.of("flash", "k0")]
    assert len(pages_at) >= 3
    erased = 0
    for cut_s in power_cuts(cuts, pages_at, end):
        _, flashes = run_and_dump(tmp_path, own, commands, cut_s, seed=1)
        erased += flashes[0][:128] == b"\xff" * 128
        left = tmp_path / "left.hex"
        left.write_text(intel_hex(flashes[0]))
        again = [{"x_mm": 0.0, "y_mm": 0.0, "image": str(left), "resets_to_bootloader": True}]
        _, flashes = run_and_dump(tmp_path, again, commands, end + 0.2, seed=2)
        assert flashes[0][:len(SHORT)] == SHORT, f"power cut at {cut_s:.5f} of {end:.2f} s"
    print(f"{cuts} cuts, {erased} of them while page 0 was erased")
    assert erased > 0


def test_with_the_fuse_a_reset_starts_the_program(tmp_path):
    """As long as there is one; what has only the jump in its place waits in the bootloader."""
    whole, waiting = robots(2, "beacon")
    left = tmp_path / "left.hex"
    flash = bytearray(b"\xff" * 0x8000)
    flash[:4] = bytes.fromhex("0c940038")  # jmp 0x7000
    for name, start in (("beacon", 0), ("bootloader", BOOTLOADER_ADDRESS)):
        part = elf_image.flash_bytes(swarm.image(name), tmp_path)
        flash[start + 4 * (start == 0):start + len(part)] = part[4 * (start == 0):]
    left.write_text(intel_hex(bytes(flash)))
    waiting |= {"image": str(left), "bootloader": ""}
    nodes = [robot | {"resets_to_bootloader": True} for robot in (whole, waiting)]
    log = swarm.emulate(tmp_path, nodes, seconds=2, seed=1, lamp=["run@0.5x20"])
    assert log.of("sent", "k0", type=0x10) and not log.of("sent", "k1")


@pytest.mark.field
@pytest.mark.parametrize("loss, passes", [(0.01, 3), (0.03, 4)])
def test_thirty_six_robots_are_whole_in_nine_of_ten_tries(tmp_path, loss, passes):
    program = elf_image.flash_bytes(swarm.image("hop_count"), tmp_path)
    commands = command(2.1, BOOT, hold=0.5)
    more, end = upload(3.0, program, passes)
    whole = []
    for seed in range(TRIES):
        _, flashes = run_and_dump(tmp_path, robots(36, "blank"), commands + more, end + 0.3,
                                  seed=100 + seed, medium={"loss": loss, "range_mm": 1})
        whole.append(sum(flash[:len(program)] == program for flash in flashes))
        print(f"{len(program)} bytes, {loss:.0%} loss, {passes} passes: {whole[-1]} of 36 whole")
    assert sum(count == 36 for count in whole) >= 0.9 * TRIES
