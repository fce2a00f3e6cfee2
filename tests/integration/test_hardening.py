"""What compilers and linkers put into our programs and libraries against the use of faults: looked
up in the files that are built, which are those that are installed."""
import platform
import re
import shutil

import pytest
from conftest import BUILD, ROOT, run

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


def read(path, option):
    done = run("readelf", "--wide", option, path)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("place", PLACES)
def test_files_are_compiled_and_linked_with_checks(place):
    path = built(place)
    assert re.search(r"Type:\s+DYN", read(path, "--file-header")), "position independent"
    assert "GNU_RELRO" in read(path, "--program-headers")
    assert "GNU_STACK" in read(path, "--program-headers")
    assert not re.search(r"GNU_STACK.*RWE", read(path, "--program-headers"))
    dynamic = read(path, "--dynamic")
    assert "BIND_NOW" in dynamic or re.search(r"FLAGS_1.*NOW", dynamic), "immediate binding"
    symbols = read(path, "--dyn-syms")
    assert "__stack_chk_fail" in symbols, "stack protector"
    if place.startswith(("daemon", "client_lib/libswarmtalk-c")):
        assert re.search(r"__\w+_chk\b", symbols.replace("__stack_chk", "")), "FORTIFY"
        assert "__glibcxx_assert_fail" in symbols, "checks of the standard library"


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.skipif(platform.machine() not in ("x86_64", "aarch64"),
                    reason="this processor does not check where jumps go")
def test_jumps_and_returns_are_checked(place):
    endbr64, paciasp = b"\xf3\x0f\x1e\xfa", b"\x3f\x23\x03\xd5"
    landing = {"x86_64": endbr64, "aarch64": paciasp}
    marks = built(place).read_bytes().count(landing[platform.machine()])
    assert marks > 100, f"{marks} places where a jump may land"


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.skipif(shutil.which("hardening-check") is None,
                    reason="hardening-check is missing: install devscripts")
def test_debians_own_check_is_content(place):
    done = run("hardening-check", "--color=no", built(place))
    missing = re.findall(r"^ (.+): no(?:, .*)?$", done.stdout, re.M)
    # These two need system files that are compiled so, too; Debian 12's are not.
    assert set(missing) <= {"Control flow integrity", "Branch protection"}, done.stdout


def test_no_core_of_the_daemon_is_written():
    unit = (ROOT / "systemd/swarmtalkd.service.in").read_text()
    assert "\nLimitCORE=0\n" in unit
