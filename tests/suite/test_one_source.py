"""What each platform's compiler is given of a program is the same text, to the byte."""
import json
import pathlib
import re
import shlex
import shutil
import subprocess

import pytest

from test_runner import BUILD, ROOT

PROGRAMS = ("hop_count", "firefly", "edge_following")
# Platform: its own source that joins it with the programs, by which its command is found.
HOST_SOURCES = {"sim-kilobot and sim-coachbot": "suite/sim/main.cpp",
                "coachbot-lab": "suite/coachbot/robot.cpp",
                "argos-kilobot and argos-footbot": "tests/unit/platforms/argos_test.cpp",
                "example": "tests/unit/platforms/minimal_port_test.cpp"}


def host_command(source: str) -> list[str]:
    """The compiler's call for a source: where several are joined, theirs, with it alone."""
    commands = json.loads((BUILD / "compile_commands.json").read_text())
    for entry in commands:
        if entry["file"].endswith(source):
            return shlex.split(entry["command"])
    for entry in commands:
        joined = pathlib.Path(entry["file"])
        if joined.parent.name == "joined" and f'"{source}"' in joined.read_text():
            return shlex.split(entry["command"].replace(entry["file"], str(ROOT / source)))
    raise AssertionError(f"no target compiles {source}")


def image_command(image: str, source: str) -> list[str]:
    """The compiler's call for a source of a Kilobot image, without CMake's work around it."""
    lines = subprocess.run(["ninja", "-C", BUILD, "-t", "commands", f"kilobot/{image}.elf"],
                           capture_output=True, text=True, check=True).stdout.splitlines()
    line = next(each for each in lines if f"/{source} " in each)
    return shlex.split(next(part for part in line.split(" && ") if f"/{source} " in part))


def compiled_text(command: list[str], program: pathlib.Path) -> str:
    """The lines of `program` that are left when the compiler has decided on all #if: macros, as
    the definitions of the C library's integers, stay unexpanded."""
    kept, skip = [], False
    for word in command:
        if skip or word in ("-c", "-MMD", "-MD"):
            skip = False
        elif word in ("-o", "-MF", "-MT"):
            skip = True
        else:
            kept.append(word)
    output = subprocess.run(kept + ["-E", "-fdirectives-only"], capture_output=True, text=True,
                            cwd=BUILD, check=True).stdout
    current, text = None, {}  # number of the line in the program: the line
    for line in output.splitlines():
        marker = re.fullmatch(r'# (\d+) "(.*)"[ 0-9]*', line)
        if marker:
            number, current = int(marker[1]), pathlib.Path(BUILD, marker[2]).resolve()
            continue
        if current == program and line.strip():
            text[number] = line
        number = number + 1 if current else 0
    return "\n".join(text[number] for number in sorted(text))


@pytest.mark.parametrize("program", PROGRAMS)
def test_all_platforms_compile_the_same_text(program):
    path = ROOT / f"suite/programs/{program}.hpp"
    commands = {name: host_command(source) for name, source in HOST_SOURCES.items()}
    for robot in ("kilobot", "footbot"):  # where ARGoS is installed
        source = f"suite/argos/argos/{program}_{robot}.cpp"
        if (BUILD / source).exists():
            commands[f"ARGoS's {robot}"] = host_command(source)
    if shutil.which("avr-g++"):
        commands["kilobot"] = image_command(program, f"suite/kilobot/{program}.cpp")
        assert "avr-g++" in commands["kilobot"][0]
    texts = {name: compiled_text(command, path) for name, command in commands.items()}
    own = "\n".join(line for line in path.read_text().splitlines()
                    if line.strip() and not line.startswith("#"))
    for name, text in texts.items():
        assert text == own, f"{name} compiles something else of {path}"
    if "kilobot" not in texts:
        pytest.skip("no avr-g++ (gcc-avr): the image was not compared")
