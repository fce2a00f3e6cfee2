"""tools/progress: what somebody sees of apt's and the compilers' work, and what it ends with."""
import pathlib
import subprocess

import pytest

pytestmark = pytest.mark.logic
ROOT = pathlib.Path(__file__).resolve().parents[2]


def progress(tmp_path, *lines):
    """What it printed, its exit status, and what it kept."""
    log = tmp_path / "log"
    log.write_text("")
    done = subprocess.run([ROOT / "tools/progress", log], text=True, capture_output=True,
                          input="".join(line + "\n" for line in lines), check=False, timeout=60)
    assert done.stderr == ""
    return done.stdout.splitlines(), done.returncode, log.read_text().splitlines()


def test_apt_and_ninja_are_said_in_steps_of_twenty(tmp_path):
    lines = ["dlstatus:1:0.4:Retrieving file 1 of 20", "dlstatus:9:38.9:Retrieving file 9 of 20",
             "dlstatus:11:41.2:Retrieving file 11 of 20",
             "pmstatus:libpython3.11-minimal:amd64:62.5:Unpacking libpython3.11-minimal (amd64)",
             "[  8%, 3.1 s] Building CXX object a.o", "[100%, 140.0 s] Linking CXX executable b",
             "status 0"]
    said, status, kept = progress(tmp_path, *lines)
    assert said == ["Fetching: 0 %", "Fetching: 20 %", "Fetching: 40 %", "Installing: 60 %",
                    "Building: 0 %", "Building: 100 %"]
    assert (status, kept) == (0, lines[:-1])


@pytest.mark.parametrize("line", [
    "status of the compiler: bad", "status 1234", "a.cpp:7:5: error: 'x' was not declared",
    "pmerror:libc6:50.0:a package's script failed", "[1/9] cmake --regenerate", "E: 12.5: no"])
def test_other_lines_are_kept_and_not_shown(tmp_path, line):
    assert progress(tmp_path, line, "status 0") == ([], 0, [line])


@pytest.mark.parametrize("status", [0, 1, 100])
def test_it_ends_with_the_status_that_it_was_told(tmp_path, status):
    assert progress(tmp_path, f"status {status}", "never read")[1:] == (status, [])


def test_without_a_status_it_fails(tmp_path):
    assert progress(tmp_path, "[ 50%, 1.0 s] x") == (["Building: 40 %"], 1, ["[ 50%, 1.0 s] x"])
