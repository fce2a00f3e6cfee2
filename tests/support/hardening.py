"""What compilers and linkers put into a file against the use of faults, as readelf shows it: for
tests of what is built, of what is installed and of packages, of any machine."""
import pathlib
import re

from commands import run

# Landing marks of functions that are called through pointers, and of returns: bytes in the file.
LANDING = {"X86-64": b"\xf3\x0f\x1e\xfa", "AArch64": b"\x3f\x23\x03\xd5"}
FEW_MARKS = 100  # the smallest program of ours has 2,000
SMALL_BYTES = 16 * 1024  # code with so little may well have no array on its stack


def read(path, option):
    done = run("readelf", "--wide", option, path)
    assert done.returncode == 0, done.stderr
    return done.stdout


def is_elf(path):
    path = pathlib.Path(path)
    if path.is_symlink() or not path.is_file():
        return False
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


def elf_files(root):
    """Programs and shared libraries below a folder; images of bare processors are not."""
    for path in sorted(pathlib.Path(root).rglob("*")):
        if is_elf(path) and "Machine:                           Atmel" not in read(
                path, "--file-header"):
            yield path


def code_bytes(path):
    found = re.search(r"\.text\s+PROGBITS\s+\S+\s+\S+\s+(\S+)", read(path, "--sections"))
    return int(found[1], 16) if found else 0


def weaknesses(path):
    """What is missing, as words; none is right."""
    missing = []
    header = read(path, "--file-header")
    if not re.search(r"Type:\s+DYN", header):
        missing.append("position independent")
    segments = read(path, "--program-headers")
    if "GNU_RELRO" not in segments:
        missing.append("relocations read-only")
    if not re.search(r"GNU_STACK.* RW ", segments):
        missing.append("stack not executable")
    dynamic = read(path, "--dynamic")
    if not ("BIND_NOW" in dynamic or re.search(r"FLAGS_1.*NOW", dynamic)):
        missing.append("immediate binding")
    if code_bytes(path) > SMALL_BYTES:
        symbols = read(path, "--dyn-syms")
        if "__stack_chk_fail" not in symbols:
            missing.append("stack protector")
        machine = re.search(r"Machine:\s+(.*)", header)[1]
        mark = next((each for name, each in LANDING.items() if name in machine), None)
        if mark and path.read_bytes().count(mark) < FEW_MARKS:
            missing.append("checked jumps and returns")
    return missing


def has_fortify(path):
    symbols = read(path, "--dyn-syms").replace("__stack_chk", "")
    return re.search(r"__\w+_chk\b", symbols) is not None
