"""The code in the documents compiles as it stands there."""
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def block_with(document: str, words: str) -> str:
    """The C++ block of a document that has these words."""
    text = (ROOT / "docs" / document).read_text(encoding="utf-8")
    blocks = [block for block in re.findall(r"```cpp\n(.*?)```", text, re.S) if words in block]
    assert len(blocks) == 1
    return blocks[0]


def compile_text(tmp_path: pathlib.Path, text: str, *command: str) -> None:
    source = tmp_path / "code.cpp"
    source.write_text(text)
    subprocess.run([*command, "-std=c++14", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                    f"-I{ROOT}", f"-I{ROOT}/core/include", source], check=True)


def test_profile_of_the_porting_guide(tmp_path):
    compile_text(tmp_path, """
#include "swarmtalk/swarmtalk.hpp"
using namespace swarmtalk;
""" + block_with("porting.md", "struct MyRobot") + """
template class core::Swarmtalk<MyRobot>;
""", "g++")


def test_program_for_kilobots(tmp_path):
    if shutil.which("avr-g++") is None:
        pytest.skip("gcc-avr is missing: run tools/setup test")
    compile_text(tmp_path, block_with("kilobot-firmware.md", "class Near"), "avr-g++",
                 "-mmcu=atmega328p", "-DF_CPU=8000000UL", "-fno-exceptions",
                 "-fno-threadsafe-statics")
