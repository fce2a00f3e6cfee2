"""Images against budget.toml, and against what keeps robots programmable."""
import pathlib
import tomllib

import pytest

import elf_image
import swarm

BUDGET = tomllib.loads((pathlib.Path(__file__).parent / "budget.toml").read_text())
PROGRAMS = sorted(set(BUDGET) - {"bootloader", "overhead"})
RAM_BYTES = 2048


def test_every_image_has_a_budget():
    images = {path.stem for path in swarm.IMAGES.glob("*.elf")}
    ours = {name for name in images if not name.endswith("_kilolib")}  # kilolib's size is not ours
    assert ours == set(BUDGET)


@pytest.mark.parametrize("name", sorted(BUDGET))
def test_size(name):
    sizes = elf_image.sizes(swarm.image(name))
    print(f"{name}: flash {sizes.flash} B, static RAM {sizes.ram} B")
    assert sizes.flash <= BUDGET[name]["flash_bytes"]
    assert sizes.ram <= BUDGET[name]["ram_bytes"]


def test_programs_leave_room_for_the_way_into_the_bootloader():
    """kilolib programs reach the bootloader through erased flash from 0x6000 on."""
    for name in PROGRAMS:
        assert elf_image.flash_range(swarm.image(name))[1] < 0x6000, name


def test_bootloader_and_overhead_controller_stay_in_their_section():
    for name in ("bootloader", "overhead"):
        assert elf_image.flash_range(swarm.image(name))[0] == 0x7000, name
        assert elf_image.flash_range(swarm.image(name))[1] < 0x8000, name


def test_images_run_in_the_emulator_as_on_a_robot():
    for name in BUDGET:
        assert elf_image.misread_skips(swarm.image(name)) == [], name


@pytest.mark.parametrize("name", [n for n in sorted(BUDGET) if "stack_bytes" in BUDGET[n]])
def test_stack_and_interrupts_with_nine_robots(tmp_path, name):
    log = swarm.emulate(tmp_path, swarm.grid(3, 3, 50, image=swarm.image(name)),
                        ohc=swarm.overhead("run@2.1", "stop@3.1"), seconds=8, seed=1,
                        drift_ppm=10000)
    ends = [log.end(f"k{i}") for i in range(9)]
    free = min(end["stack_free_bytes"] for end in ends)
    stack = RAM_BYTES - elf_image.sizes(swarm.image(name)).ram - free
    cycles = max(max(end["longest_handler_cycles"].values()) for end in ends)
    print(f"{name}: stack {stack} B, longest interrupt {cycles} cycles")
    assert stack <= BUDGET[name]["stack_bytes"]
    assert cycles <= BUDGET[name]["interrupt_cycles"]
