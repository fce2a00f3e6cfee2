"""The library through clang and gcc at every level, with the undefined-behaviour sanitizer, and
through avr-gcc, whose int has 16 bits: no warning, no complaint, and everywhere the same packets,
deliveries and counts as in the build under test."""
import os
import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["SWARMTALK_BUILD"]) / "tests/compilers"
SOURCE = ROOT / "tests/compilers/behaviour.cpp"
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]
AVR = ["-mmcu=atmega328p", "-DF_CPU=8000000UL", "-flto", "-ffunction-sections", "-fdata-sections",
       "-Wl,--gc-sections", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics",
       "-funsigned-char", "-fshort-enums", "-Wall", "-Wextra", "-Werror"]


def build(compiler: str, out: pathlib.Path, *flags: str) -> pathlib.Path:
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is missing (tools/setup test installs it)")
    launcher = ["ccache"] if shutil.which("ccache") else []
    subprocess.run([*launcher, compiler, "-std=c++14", *flags, f"-I{ROOT}/core/include", "-c",
                    SOURCE, "-o", f"{out}.o"], check=True)
    subprocess.run([compiler, "-std=c++14", *flags, f"{out}.o", "-o", out], check=True)
    return out


def lines_of(*command: pathlib.Path) -> list[str]:
    """What a build of the program says, a line per profile."""
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    lines = [line for line in run.stdout.splitlines() if not line.startswith("Loaded ")]
    assert lines[0] == "vectors 00000001", "packets known from elsewhere are read and written"
    return lines


@pytest.mark.parametrize("level", [
    "-O0", pytest.param("-O1", marks=pytest.mark.field), "-O2",
    pytest.param("-O3", marks=pytest.mark.field)])
@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_is_clean_and_says_the_same(tmp_path, compiler, level):
    # "undefined" has the checks of shifts by too much and of negative numbers.
    program = build(compiler, tmp_path / "behaviour", level, *WARNINGS, "-fsanitize=undefined",
                    "-fno-sanitize-recover=all")
    lines = lines_of(program)
    assert len(lines) == 6
    assert lines == lines_of(BUILD / "compilers_behaviour")


@pytest.mark.parametrize("level", ["-Os", "-O2"])
def test_says_the_same_with_an_int_of_16_bits(tmp_path, level):
    if not (BUILD / "avr_console").exists():
        pytest.skip("libsimavr-dev is missing (tools/setup test installs it)")
    image = build("avr-g++", tmp_path / "behaviour.elf", level, *AVR)
    lines = lines_of(BUILD / "avr_console", image)
    assert len(lines) == 4
    assert lines == lines_of(BUILD / "compilers_behaviour")[:4]
