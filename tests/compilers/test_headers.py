"""What a header pulls in, as the compiler says it."""
import pathlib
import subprocess

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
