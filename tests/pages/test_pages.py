"""The manual pages and completions in packaging/pages: made from the programs, without errors."""
import os
import pathlib
import pty
import select
import shutil
import signal
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))

from commands import wait_for  # noqa: E402

BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test"))
PAGES = ROOT / "packaging/pages"


def run(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=60, **options)


def need(program):
    if shutil.which(program) is None:
        pytest.skip(f"{program} is missing: run tools/setup test")


def test_they_are_what_the_programs_say():
    done = run("/usr/bin/python3", "-B", ROOT / "tools/make_pages.py", "--build", BUILD, "--check")
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_page_that_differs_is_named(tmp_path):
    shutil.copytree(ROOT / "tools", tmp_path / "tools")
    for folder in ("suite", "client_lib/python"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    shutil.copytree(PAGES, tmp_path / "packaging/pages")
    page = tmp_path / "packaging/pages/man/swarmtalk-lab.1"
    page.write_text(page.read_text().replace("medium", "element"))
    done = run("/usr/bin/python3", "-B", tmp_path / "tools/make_pages.py", "--build", BUILD,
               "--check")
    assert done.returncode == 1
    assert done.stdout.startswith("packaging/pages/man/swarmtalk-lab.1 is not"), done.stdout
    assert done.stdout.count("\n") == 1


@pytest.mark.parametrize("command", [("mandoc", "-Tlint", "-Wwarning"),
                                     ("groff", "-man", "-ww", "-z", "-Kutf8")],
                         ids=["mandoc", "groff"])
def test_the_manual_pages_have_no_mistakes(command):
    need(command[0])
    for page in sorted((PAGES / "man").iterdir()):
        done = run(*command, page)
        assert (done.returncode, done.stdout + done.stderr) == (0, ""), page.name


def completed(program, line):
    """What bash offers at the end of a command line."""
    words = line.split(" ")
    script = (f'. "$1"; COMP_WORDS=("${{@:2}}"); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); '
              f'_{program.replace("-", "_")}; printf "%s\\n" "${{COMPREPLY[@]}}"')
    done = run("bash", "-c", script, "bash", PAGES / "bash" / program, *words, cwd=ROOT / "docs")
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout.split()


def test_bash_completes_commands_options_values_and_files():
    assert completed("swarmtalk-cli", "swarmtalk-cli s") == ["sub", "status", "stats", "survey"]
    assert completed("swarmtalk-cli", "swarmtalk-cli pose s") == ["set"]
    assert completed("swarmtalk-cli", "swarmtalk-cli --socket pose po") == ["pose"]
    assert "--latest-from-each" in completed("swarmtalk-cli", "swarmtalk-cli sub --l")
    assert completed("swarmtalk-cli", "swarmtalk-cli sub --count ") == []
    assert completed("swarmtalk-cli", "swarmtalk-cli help neig") == ["neighbours"]
    assert completed("swarmtalk-cli", "swarmtalk-cli capture client.m") == ["client.md"]
    assert completed("swarmtalk-lab", "swarmtalk-lab up 3 --medium ") == [
        "bridge", "radio", "radio-udp", "udp", "wifi"]
    assert completed("swarmtalk-lab", "swarmtalk-lab exec 1 -- client.m") == ["client.md"]
    assert completed("swarmtalkd", "swarmtalkd --config client.m") == ["client.md"]
    assert completed("swarmtalk-suite", "swarmtalk-suite rep") == ["replay", "report"]
    assert completed("swarmtalk-run", "swarmtalk-run --py") == ["--python"]


def test_shells_can_read_the_completions():
    for file in sorted((PAGES / "bash").iterdir()):
        done = run("bash", "-n", file)
        assert (done.returncode, done.stderr) == (0, ""), file.name
    need("zsh")
    for file in sorted((PAGES / "zsh").iterdir()):
        done = run("zsh", "-n", file)
        assert (done.returncode, done.stderr) == (0, ""), file.name


class Terminal:
    """A shell behind a pseudo-terminal."""

    def __init__(self, *command):
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            os.environ.update(TERM="xterm", PS1="")
            os.execvp(command[0], command)
        self.text = ""

    def write(self, text):
        os.write(self.fd, text.encode())

    def read_until(self, wanted):
        """What has come since the last call, as soon as it has `wanted` in it."""
        def has_come():
            if select.select([self.fd], [], [], 0)[0]:
                self.text += os.read(self.fd, 4096).decode(errors="replace")
            return wanted in self.text
        wait_for(has_come, 60, repr(wanted))
        found, self.text = self.text, ""
        return found

    def close(self):
        os.close(self.fd)
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)


def test_zsh_completes_commands_and_options():
    need("zsh")
    shell = Terminal("zsh", "-f", "-i")
    try:
        shell.write(f"fpath=({PAGES}/zsh $fpath); autoload -U compinit; compinit -u -D; "
                    "bindkey -e; print be''gun\n")
        shell.read_until("begun\r\n")
        shell.write("swarmtalk-cli neig\t")
        shell.read_until("neighbo")
        shell.write("\x15swarmtalk-cli sub --latest\t")
        shell.read_until("-from-each")
        shell.write("\x15swarmtalk-lab up --medium b\t")
        shell.read_until("ridge")
    finally:
        shell.close()
