"""What compilers and linkers put into our programs and libraries against the use of faults: looked
up in the files that are built, and in all that are installed (those of packages:
tests/packages/test_release.py)."""
import os
import re
import shutil

import pytest
from conftest import BUILD, ROOT, run
from hardening import elf_files, has_fortify, read, weaknesses

pytestmark = pytest.mark.logic

PLACES = ("daemon/swarmtalkd", "cli/swarmtalk-cli", "lab/swarmtalk-lab",
          "view/swarmtalk-view", "client_lib/libswarmtalk-c.so")


def cached(name):
    found = re.search(rf"^{name}:\w+=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.M)
    return found.group(1) if found else ""


def built(place):
    path = BUILD / place
    if not path.exists():
        pytest.skip(f"{place} is not built")
    if cached("SWARMTALK_SANITIZE") or cached("CMAKE_BUILD_TYPE") == "Debug":
        pytest.skip("a build for finding faults is compiled otherwise")
    return path


@pytest.mark.parametrize("place", PLACES)
def test_files_are_compiled_and_linked_with_checks(place):
    path = built(place)
    assert not weaknesses(path)
    if place.startswith(("daemon", "client_lib/libswarmtalk-c")):
        assert has_fortify(path)
        assert "__glibcxx_assert_fail" in read(path, "--dyn-syms"), "checks of the library"


def test_every_installed_program_and_library_is_compiled_with_checks(tmp_path):
    built(PLACES[0])
    done = run("cmake", "--install", BUILD, "--prefix", "/usr", timeout=120,
               env={**os.environ, "DESTDIR": str(tmp_path)})
    if done.returncode != 0 and "cannot find" in done.stderr:
        pytest.skip("not everything that is installed is built: " + done.stderr.splitlines()[0])
    assert done.returncode == 0, done.stderr
    files = list(elf_files(tmp_path))
    assert tmp_path / "usr/sbin/swarmtalkd" in files and len(files) > 5, files
    weak = {str(path.relative_to(tmp_path)): missing for path in files
            if (missing := weaknesses(path))}
    assert not weak, weak


def test_a_file_without_checks_is_found(tmp_path):
    source, path = tmp_path / "weak.c", tmp_path / "weak"
    source.write_text("int main(void) { return 0; }\n", encoding="ascii")
    done = run("gcc", source, "-o", path, "-no-pie", "-Wl,-z,norelro,-z,lazy,-z,execstack")
    assert done.returncode == 0, done.stderr
    assert weaknesses(path) == ["position independent", "relocations read-only",
                                "stack not executable", "immediate binding"]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.skipif(shutil.which("hardening-check") is None,
                    reason="hardening-check is missing: install devscripts (tools/setup test)")
def test_debians_own_check_is_content(place):
    done = run("hardening-check", "--color=no", built(place))
    missing = re.findall(r"^ (.+): no(?:, .*)?$", done.stdout, re.M)
    # These two need system files that are compiled so, too; Debian 12's are not.
    assert set(missing) <= {"Control flow integrity", "Branch protection"}, done.stdout


def test_no_core_of_the_daemon_is_written():
    unit = (ROOT / "systemd/swarmtalkd.service.in").read_text()
    assert "\nLimitCORE=0\n" in unit
