"""What `cmake --install` copies is what the packages build: the target `shipped`."""
import pathlib
import re
import shlex
import subprocess

from conftest import BUILD

# What CMake writes when it configures, and nothing has to build.
CONFIGURED = (".cmake", ".conf", ".pc", ".service", ".socket", ".txt")


def installed_from_the_build_folder():
    """Paths of files in the build folder, named by the scripts that CMake made for installing."""
    paths = set()
    for script in BUILD.rglob("cmake_install.cmake"):
        text = script.read_text()
        for install in re.findall(r"file\(INSTALL .*? TYPE (?!DIRECTORY)(.*?)\)", text):
            for path in map(pathlib.Path, re.findall(r'"(/[^"]+)"', install)):
                if BUILD in path.parents and path.suffix not in CONFIGURED:
                    paths.add(str(path))
    return paths


def words_of_the_commands_for(target):
    done = subprocess.run(["ninja", "-C", str(BUILD), "-t", "commands", target],
                          capture_output=True, text=True, timeout=60, check=True)
    return {str(BUILD / word) for word in shlex.split(done.stdout)}


def test_packages_build_everything_that_they_install():
    installed = installed_from_the_build_folder()
    assert str(BUILD / "daemon/swarmtalkd") in installed, installed
    missing = installed - words_of_the_commands_for("shipped")
    assert not missing, "installed, but the target shipped does not make them"
