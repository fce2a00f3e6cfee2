"""What a header pulls in, as the compiler says it."""
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def headers_of(header: str) -> list[str]:
    """Every file that including this one reads."""
    rule = subprocess.run(["g++", "-std=c++20", "-M", f"-I{ROOT}", "-x", "c++", ROOT / header],
                          capture_output=True, text=True, check=True).stdout
    return rule.replace("\\\n", " ").split(":", 1)[1].split()


def test_configuration_is_plain_values_and_pulls_in_no_library():
    libraries = ("/boost/", "/google/", "/spdlog/", "/toml++/", "/drivers/", "/kilobot_bridge/")
    assert [each for each in headers_of("daemon/config/config.hpp")
            if any(library in each for library in libraries)] == []


PROGRAM = """
#include <swarmtalk/client.hpp>
#include <array>
#include <vector>
#if __cplusplus >= 202002L
#include <span>
#endif
struct Plain { float x; };
void use(swarmtalk::Publisher& publisher, const swarmtalk::Message& message) {
  std::vector<std::uint8_t> some;
  std::uint8_t three[3] = {1, 2, 3};
  (void)(publisher.send(some).ok() && publisher.send(three).ok() && publisher.send(Plain{}).ok());
  (void)(publisher.send("text").ok() && publisher.send(std::array<float, 3>{}, 2).ok());
  (void)(publisher.send(message.bytes()).ok() && publisher.send(message.text()).ok());
  for (std::uint8_t byte : message.bytes()) some.push_back(byte);
  (void)(message.lost_before == swarmtalk::Loss{} && message.as<Plain>());
#if __cplusplus >= 202002L
  std::span<const std::uint8_t> bytes = message.bytes();
  (void)(publisher.send(bytes).ok() && publisher.send(std::span<std::uint8_t>(some)).ok());
#endif
}
"""


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize("standard", [17, 20])
def test_the_public_headers_are_for_every_standard_from_17_on(compiler, standard, tmp_path):
    (tmp_path / "program.cpp").write_text(PROGRAM)
    done = subprocess.run(
        [compiler, f"-std=c++{standard}", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
         "-fsyntax-only", f"-I{ROOT}/client_lib/include", tmp_path / "program.cpp"],
        capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
