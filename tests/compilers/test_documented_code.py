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


CLIENT = """
#include <chrono>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>
"""


def compile_program(tmp_path, text):
    source = tmp_path / "code.cpp"
    source.write_text(text)
    subprocess.run(["g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                    f"-I{ROOT}/client_lib/include", source], check=True)


def test_first_lines_of_the_client_page(tmp_path):
    compile_program(tmp_path, CLIENT + "int main() {\n" + block_with("client.md", "my_program")
                    + "}\n")


def test_event_loops_of_the_client_page(tmp_path):
    loops, asio = block_with("client.md", "asio::").split("asio::posix", 1)
    compile_program(tmp_path, CLIENT + f"""
#include <boost/asio.hpp>
#include <poll.h>
namespace asio = boost::asio;
using namespace std::chrono_literals;
bool drive();
void read_serial();
void loops(swarmtalk::Client& robot, int serial) {{
{loops}
}}
struct Loop {{
  swarmtalk::Client& robot;
  asio::io_context& io;
  asio::posix{asio.replace("watch(io, robot.fd())", "watch{io, robot.fd()}")}
}};
""")


def test_port_of_the_porting_guide(tmp_path):
    compile_text(tmp_path, """
#include "swarmtalk/swarmtalk.hpp"
using namespace swarmtalk;
""" + block_with("porting.md", "struct MyRobot") + """
namespace port {
void drive(uint8_t* frame, uint16_t size, core::DistanceSensing sensing) {
  int robot = 0;
""" + block_with("porting.md", "node.pull_packet").replace("uint16_t n = ", "(void)") + """
}
}
""", "g++")
