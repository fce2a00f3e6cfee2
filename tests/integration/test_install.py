"""What `cmake --install` lays down: programs that run, units that systemd accepts, a library that a
program outside this tree can use. And this tree as a part of another project."""
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest
from conftest import BUILD, ROOT, run

pytestmark = pytest.mark.logic


def install(root):
    done = run("cmake", "--install", BUILD, "--prefix", "/usr", timeout=120,
               env={**os.environ, "DESTDIR": str(root)})
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def staged(tmp_path_factory):
    root = tmp_path_factory.mktemp("root")
    install(root)
    return root


def test_installing_again_keeps_the_robots_configuration(staged):
    config = staged / "etc/swarmtalk/swarmtalkd.toml"
    original = config.read_text()
    config.write_text(original + "# mine\n")
    install(staged)
    assert config.read_text() == original + "# mine\n"


def test_a_handle_that_nobody_keeps_is_a_warning(tmp_path):
    source = tmp_path / "program.cpp"
    source.write_text("""#include <swarmtalk/client.hpp>
void f(swarmtalk::Client& robot) {
  auto subscriber = robot.subscribe("c", [](auto&) {});
  auto publisher = robot.channel("c").publisher();
  robot.subscribe("c", [](auto&) {});
  robot.channel("c").publisher();
}
""")
    done = run("g++", "-std=c++20", "-fsyntax-only", "-I", ROOT / "client_lib/include", source)
    assert done.returncode == 0, done.stderr
    warned = re.findall(r"program.cpp:(\d+):.*keep it", done.stderr)
    assert sorted(warned) == ["5", "6"], done.stderr


def test_the_units_name_files_that_are_installed(staged):
    for unit in ("system/swarmtalkd.service", "system/swarmtalkd.socket",
                 "user/swarmtalk-view.service"):
        text = (staged / "usr/lib/systemd" / unit).read_text()
        for path in re.findall(r"(?:file:|ExecStart=|--config )(/\S+)", text):
            assert (staged / path[1:]).exists(), path


def test_the_installed_documents_have_no_dead_links(staged):
    folder = next(staged.glob("usr/share/doc/*/client.md")).parent
    pages = sorted(folder.rglob("*.md"))
    assert {"README.md", "tutorial.md", "ipc.md", "faq.md"} <= {page.name for page in pages}
    dead = [f"{page.relative_to(folder)}: {target}" for page in pages
            for target in re.findall(r"\]\(([^()\s]+)\)", page.read_text())
            if not re.match("[a-z]+:|#", target)
            and not (page.parent / target.split("#")[0]).exists()]
    assert dead == []
    links = re.findall(r"\]\(([^()\s]+)\)", (folder / "README.md").read_text())
    assert len(links) > 10, "links that are alive are still there"


def test_manual_pages_and_completions_are_installed(staged):
    for path in ("man/man1/swarmtalk-cli.1", "man/man8/swarmtalkd.8", "zsh/vendor-completions/"
                 "_swarmtalk-lab", "bash-completion/completions/swarmtalk-suite"):
        assert (staged / "usr/share" / path).exists(), path


@pytest.mark.parametrize("document", ["operations.md", "kilobot.md"])
def test_drop_ins_are_where_the_documents_say(staged, document):
    text = next(staged.glob(f"usr/share/doc/*/{document}")).read_text()
    assert "serial.conf" not in text
    paths = re.findall(r"/usr/[a-z/]*/swarmtalk/[a-z]+\.conf", text)
    assert paths, "it names none"
    for path in paths:
        assert (staged / path[1:]).exists(), path


def test_the_units_are_accepted_by_systemd(staged):
    # The units that ours refer to come from this machine's systemd.
    for folder in ("usr/lib/systemd/system", "lib/systemd/system"):
        source = pathlib.Path("/") / folder
        if source.is_dir() and not source.is_symlink():
            for unit in list(source.glob("*.target")) + list(source.glob("*.slice")):
                target = staged / "usr/lib/systemd/system" / unit.name
                target.parent.mkdir(parents=True, exist_ok=True)
                if not target.exists():
                    shutil.copy(unit, target)
    (staged / "etc").mkdir(exist_ok=True)
    units = ["swarmtalkd.service", "swarmtalkd.socket"]
    for unit in units:
        assert (staged / "usr/lib/systemd/system" / unit).exists(), unit
    done = run("systemd-analyze", "verify", "--man=no", "--recursive-errors=yes",
               f"--root={staged}", *units)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_sysusers_and_tmpfiles_are_accepted(staged):
    etc = staged / "etc"
    etc.mkdir(exist_ok=True)
    assert run("systemd-sysusers", f"--root={staged}", "swarmtalk.conf").returncode == 0
    assert "swarmtalk:" in (etc / "passwd").read_text()
    assert "swarmtalk:" in (etc / "group").read_text()
    done = run("systemd-tmpfiles", f"--root={staged}", "--create", "swarmtalk.conf")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("drop_in,limit", [(None, 13), ("kilobot", 15), ("udp", 17)])
def test_the_unit_is_hardened(staged, drop_in, limit):
    """Exposure in tenths, with what a kind of link needs more: 1.6 is the most for raw layer 2 and
    serial ports; IP sockets have a limit of their own."""
    folder = staged / "usr/lib/systemd/system/swarmtalkd.service.d"
    folder.mkdir(exist_ok=True)
    copy = folder / "kind.conf"
    copy.unlink(missing_ok=True)
    if drop_in:
        shutil.copy(staged / f"usr/share/swarmtalk/{drop_in}.conf", copy)
    done = run("systemd-analyze", "security", "--offline=true", f"--threshold={limit}",
               f"--root={staged}", "swarmtalkd.service")
    shutil.rmtree(folder)
    assert done.returncode == 0, done.stdout[-2000:]
    assert limit <= 16 or drop_in == "udp"


def test_the_manual_names_drop_ins_that_are_installed(staged):
    installed = {path.name for path in (staged / "usr/share/swarmtalk").glob("*.conf")}
    for page in ("operations.md", "kilobot.md"):
        named = set(re.findall(r"[`/](\w+\.conf)`", (ROOT / "docs" / page).read_text()))
        assert named and named <= installed, (page, named)


def test_the_runner_of_scripts_finds_the_library_beside_it(staged, tmp_path):
    (tmp_path / "usr_code.py").write_text("def usr(robot):\n    pass\n")
    done = run(staged / "usr/bin/swarmtalk-run", "usr_code.py", cwd=tmp_path,
               env={"SWARMTALK_SOCKET": "/nowhere/socket", "PYTHONDONTWRITEBYTECODE": "1"})
    assert done.returncode == 3
    assert done.stderr.startswith("swarmtalk: cannot reach swarmtalkd: /nowhere/socket")
    folder = staged / "usr/lib/python3/dist-packages"
    assert (folder / "swarmtalk.py").exists() and (folder / "swarmtalk-stubs/__init__.pyi").exists()


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """A virtual environment into which pip has installed the Python client, without a network."""
    for module in ("ensurepip", "setuptools", "wheel"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"Python's {module} is missing (tools/setup test installs it)")
    folder = tmp_path_factory.mktemp("pip")
    clone = shutil.copytree(ROOT / "client_lib/python", folder / "clone")  # pip writes into it
    done = run(sys.executable, "-m", "venv", "--system-site-packages", folder / "env", timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    done = run(folder / "env/bin/pip", "install", "--no-build-isolation", "--no-index", clone,
               timeout=120, cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "env"


def test_pip_installs_the_python_client_into_a_virtual_environment(environment, tmp_path):
    done = run(environment / "bin/python", "-c", """import importlib.metadata, swarmtalk
print(swarmtalk.__file__)
print(swarmtalk.__version__, importlib.metadata.version("swarmtalk"))""", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    place, versions = done.stdout.splitlines()
    assert pathlib.Path(place).is_relative_to(environment)
    said = re.search(r"project\(swarmtalk VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())
    assert versions.split() == [said[1], said[1]]
    (tmp_path / "usr_code.py").write_text("def usr(robot):\n    pass\n")
    done = run(environment / "bin/swarmtalk-run", "usr_code.py", cwd=tmp_path,
               env={"SWARMTALK_SOCKET": "/nowhere/socket"})
    assert done.returncode == 3
    assert done.stderr.startswith("swarmtalk: cannot reach swarmtalkd: /nowhere/socket")


TYPED = """import swarmtalk

with swarmtalk.Client("typed") as robot:
    hello = robot.advertise("hello", ttl=2, redundancy="auto")
    if not hello.send("good morning"):
        print("too fast")
    for message in robot.subscribe("hello", within=1.5):
        print(message.text.upper(), message.distance < 0.5)
    print([link.name for link in robot.status().links])
"""


@pytest.mark.parametrize("right, wrong, finding", [
    ("", "", None), ("within=", "withn=", "call-arg"), (".text", ".txt", "attr-defined"),
    ("ttl=2", 'ttl="2"', "arg-type")])
def test_mypy_finds_what_a_program_calls_wrongly(environment, tmp_path, right, wrong, finding):
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is missing (tools/setup test installs it)")
    (tmp_path / "program.py").write_text(TYPED.replace(right, wrong, 1) if right else TYPED)
    done = run(sys.executable, "-m", "mypy", "--strict", "--python-executable",
               environment / "bin/python", "program.py", cwd=tmp_path, timeout=120)
    assert re.findall(r"\[([a-z-]+)\]$", done.stdout, re.M) == ([finding] if finding else [])
    assert done.returncode == (1 if finding else 0), done.stdout + done.stderr


def test_the_installed_configuration_is_accepted(staged):
    config = staged / "etc/swarmtalk/swarmtalkd.toml"
    done = run(staged / "usr/sbin/swarmtalkd", "--config", config, "--check")
    assert done.returncode == 0, done.stderr


CONSUMER = """
#include <string>
#include <swarmtalk/client.hpp>
int main() {
  swarmtalk::ClientOptions options;
  options.socket_path = "/nonexistent/socket";
  swarmtalk::Client robot("consumer", options);
  // What the library uses as well, and a program must be able to have a copy of its own of.
  const auto shared = std::make_shared<std::string>(std::to_string(robot.fd()));
  if (shared->empty()) return 1;
  return robot.connect().code() == swarmtalk::StatusCode::kNoDaemon ? 0 : 1;
}
"""


@pytest.mark.parametrize("standard", [17, 20])
def test_a_program_outside_the_tree_builds_with_cmake(staged, tmp_path, standard):
    (tmp_path / "main.cpp").write_text(CONSUMER)
    (tmp_path / "CMakeLists.txt").write_text(f"""
cmake_minimum_required(VERSION 3.25)
project(consumer CXX)
set(CMAKE_CXX_STANDARD {standard})
find_package(swarmtalk REQUIRED)
add_executable(consumer main.cpp)
target_link_libraries(consumer swarmtalk::client)
""")
    done = run("cmake", "-G", "Ninja", "-S", tmp_path, "-B", tmp_path / "b",
               f"-DCMAKE_PREFIX_PATH={staged}/usr",
               timeout=120)
    assert done.returncode == 0, done.stderr
    done = run("cmake", "--build", tmp_path / "b", timeout=120)
    assert done.returncode == 0, done.stdout
    assert run(tmp_path / "b/consumer").returncode == 0


ADD = {
    "add_subdirectory": f"add_subdirectory({ROOT} swarmtalk)",
    "FetchContent": f"""include(FetchContent)
FetchContent_Declare(swarmtalk SOURCE_DIR {ROOT} SYSTEM)
FetchContent_MakeAvailable(swarmtalk)""",
}


def configure_with_us_inside(folder, way, *options):
    """Another project, which has nothing but protobuf. Returns its own settings afterwards."""
    (folder / "main.cpp").write_text(
        CONSUMER + "static_assert(__cplusplus == 201703L, \"the standard of the project\");\n")
    (folder / "CMakeLists.txt").write_text(f"""
cmake_minimum_required(VERSION 3.25)
project(consumer CXX)
set(CMAKE_CXX_STANDARD 17)
enable_testing()
{ADD[way]}
add_executable(consumer main.cpp)
target_link_libraries(consumer swarmtalk::client)
install(TARGETS consumer DESTINATION bin)
foreach(name CMAKE_BUILD_TYPE CMAKE_CXX_STANDARD CMAKE_CXX_COMPILER_LAUNCHER BUILD_TESTING
    CMAKE_EXPORT_COMPILE_COMMANDS CMAKE_POSITION_INDEPENDENT_CODE CMAKE_RUNTIME_OUTPUT_DIRECTORY)
  message(STATUS "setting ${{name}}=${{${{name}}}}")
endforeach()
""")
    absent = ["Boost", "spdlog", "CLI11", "nlohmann_json", "PkgConfig", "ZLIB", "GTest"]
    done = run("cmake", "-G", "Ninja", "-S", folder, "-B", folder / "b", *options,
               *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in absent), timeout=120)
    assert done.returncode == 0, done.stderr
    return dict(re.findall(r"^-- setting (\w+)=(.*)$", done.stdout, re.M))


@pytest.mark.parametrize("way", ADD)
def test_inside_another_project_its_settings_stay(tmp_path, way):
    settings = configure_with_us_inside(tmp_path, way)
    assert settings.pop("CMAKE_CXX_STANDARD") == "17"
    assert set(settings.values()) == {""} and len(settings) == 6
    cache = (tmp_path / "b/CMakeCache.txt").read_text()
    assert re.search("^CMAKE_BUILD_TYPE:STRING=$", cache, re.M)
    assert re.findall("^SWARMTALK_.*", cache, re.M) == []
    assert not (tmp_path / "b/compile_commands.json").exists()


def test_inside_another_project_the_client_library_alone_is_built(tmp_path):
    settings = configure_with_us_inside(
        tmp_path, "add_subdirectory", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O0",
        "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wconversion -Wuseless-cast -Werror",
        "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DSWARMTALK_JOIN_SOURCES=ON")
    assert settings["CMAKE_BUILD_TYPE"] == "Debug"
    commands = json.loads((tmp_path / "b/compile_commands.json").read_text())
    own, = (entry["command"].split() for entry in commands if entry["file"].endswith("main.cpp"))
    assert [word for word in own[1:] if word.startswith("-") and not word.startswith("-std=")] == [
        f"-I{ROOT}/client_lib/include", "-Wall", "-Wextra", "-Wconversion", "-Wuseless-cast",
        "-Werror", "-O0", "-o", "-c"]
    done = run("cmake", "--build", tmp_path / "b", timeout=280)
    assert done.returncode == 0, done.stdout
    assert run(tmp_path / "b/consumer").returncode == 0
    made = {path.name for path in (tmp_path / "b/swarmtalk").rglob("lib*")}
    assert made == {"libswarmtalk.a"}
    assert "Total Tests: 0" in run("ctest", "-N", "--test-dir", tmp_path / "b").stdout
    done = run("cmake", "--install", tmp_path / "b", "--prefix", tmp_path / "installed")
    assert done.returncode == 0, done.stderr
    files = [path for path in (tmp_path / "installed").rglob("*") if path.is_file()]
    assert files == [tmp_path / "installed/bin/consumer"]


def test_a_program_outside_the_tree_builds_with_pkg_config(staged, tmp_path):
    (tmp_path / "main.cpp").write_text(CONSUMER)
    folders = [str(path.parent) for path in staged.rglob("swarmtalk.pc")]
    assert folders, "no swarmtalk.pc is installed"
    flags = run("pkg-config", "--cflags", "--libs", "swarmtalk",
                env={**os.environ, "PKG_CONFIG_PATH": folders[0],
                     "PKG_CONFIG_SYSROOT_DIR": str(staged)})
    assert flags.returncode == 0, flags.stderr
    words = flags.stdout.split()
    assert [word for word in words if word.startswith("-l")] == ["-lswarmtalk"]
    done = subprocess.run(["g++", "-std=c++17", str(tmp_path / "main.cpp"), "-o",
                           str(tmp_path / "consumer"), *words], text=True, capture_output=True,
                          timeout=120)
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "consumer").returncode == 0
    assert "protobuf" not in run("ldd", tmp_path / "consumer").stdout


def test_an_application_with_a_protobuf_of_its_own_is_not_disturbed(staged, tmp_path):
    """No name of protobuf, nor of the messages made by it, is in the installed library."""
    library = next(staged.rglob("libswarmtalk.a"))
    names = run("nm", "--extern-only", "--defined-only", library, timeout=60).stdout
    assert "9swarmtalk6Client7connect" in names
    exported = re.findall(r"^[0-9a-f]+ \w (\S+)$", names, re.M)
    assert [name for name in exported if not name.startswith("swarmtalk_own_")
            and ("9swarmtalk" not in name or "9swarmtalk3ipc" in name)] == []


C_CONSUMER = r"""
#include <stdio.h>
#include <swarmtalk/swarmtalk.h>
int main(void) {
  swarmtalk_client* robot = swarmtalk_open("consumer", "/nonexistent/socket");
  swarmtalk_status status = swarmtalk_connect(robot);
  printf("%s\n", swarmtalk_error(robot));
  swarmtalk_close(robot);
  return status == SWARMTALK_NO_DAEMON ? 0 : 1;
}
"""


def run_staged(path, staged):
    folder = next(staged.rglob("libswarmtalk-c.so")).parent
    return run(path, env={**os.environ, "LD_LIBRARY_PATH": str(folder)})


def test_a_c_program_outside_the_tree_builds_with_pkg_config(staged, tmp_path):
    (tmp_path / "main.c").write_text(C_CONSUMER)
    folder = next(staged.rglob("swarmtalk-c.pc")).parent
    flags = run("pkg-config", "--cflags", "--libs", "swarmtalk-c",
                env={**os.environ, "PKG_CONFIG_PATH": str(folder),
                     "PKG_CONFIG_SYSROOT_DIR": str(staged)})
    assert flags.returncode == 0, flags.stderr
    done = subprocess.run(["gcc", "-std=c99", "-Wall", "-Werror", str(tmp_path / "main.c"), "-o",
                           str(tmp_path / "consumer"), *flags.stdout.split()], text=True,
                          capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr
    done = run_staged(tmp_path / "consumer", staged)
    assert done.returncode == 0
    assert "/nonexistent/socket does not exist" in done.stdout


def test_a_c_program_outside_the_tree_builds_with_cmake(staged, tmp_path):
    (tmp_path / "main.c").write_text(C_CONSUMER)
    (tmp_path / "CMakeLists.txt").write_text("""
cmake_minimum_required(VERSION 3.25)
project(consumer C CXX)
find_package(swarmtalk REQUIRED)
add_executable(consumer main.c)
target_link_libraries(consumer swarmtalk::c)
""")
    done = run("cmake", "-G", "Ninja", "-S", tmp_path, "-B", tmp_path / "b",
               f"-DCMAKE_PREFIX_PATH={staged}/usr", timeout=120)
    assert done.returncode == 0, done.stderr
    done = run("cmake", "--build", tmp_path / "b", timeout=120)
    assert done.returncode == 0, done.stdout
    assert run_staged(tmp_path / "b/consumer", staged).returncode == 0


def test_the_c_library_shows_its_own_functions_only(staged):
    library = next(staged.rglob("libswarmtalk-c.so"))
    done = run("nm", "-D", "--defined-only", library)
    names = [line.split()[-1].split("@")[0] for line in done.stdout.splitlines()]
    assert "swarmtalk_send" in names
    assert [name for name in names if not name.lower().startswith("swarmtalk_")] == []


def test_the_readme_shows_the_very_first_program():
    program = (ROOT / "examples/first_program.cpp").read_text()
    body = program[program.index("#include"):]
    assert body in (ROOT / "README.md").read_text()
