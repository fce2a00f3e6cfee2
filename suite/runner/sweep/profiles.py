"""Simulators of other profiles: a header with the numbers that the sweep asks for, compiled once.

A simulator lies in the sweep's folder, in a place named after everything that it is made of: a
sweep that is taken up again goes on with the one that it began with, on whichever machine.
"""
import concurrent.futures
import hashlib
import os
import pathlib
import re
import shlex
import shutil
import subprocess

import limits
import platforms
from sweep import SweepError

ROOT = pathlib.Path(__file__).resolve().parents[3]
SOURCES = ("core/include", "sim", "platforms", "suite/programs", "suite/sim")
BASES = {"kilobot": ("core::Kilobot", "kilobot"), "footbot": ("core::Footbot", "footbot"),
         "classic2020": ("core::Classic2020", "classic2020")}
CHECKSUMS = {"none": "kNone", "sum8": "kSum8"}
BITS, TICKS = "uint8_t", "uint32_t"
# Key of a file: constant of core/include/swarmtalk/profile.hpp, its type, least, most. What numbers
# go together is said there, in sentences.
NUMBERS = {
    "mtu_bytes": ("kMtuBytes", "uint16_t", 4, 250),
    "node_bits": ("kNodeBits", BITS, 1, 16), "message_bits": ("kMessageBits", BITS, 1, 32),
    "sequence_bits": ("kSequenceBits", BITS, 0, 5), "channel_bits": ("kChannelBits", BITS, 4, 16),
    "ttl_bits": ("kTtlBits", BITS, 0, 8), "hops_bits": ("kHopsBits", BITS, 0, 8),
    "size_bits": ("kSizeBits", BITS, 0, 16), "epoch_bits": ("kEpochBits", BITS, 0, 16),
    "timestamp_bits": ("kTimestampBits", BITS, 8, 32),
    "forward_slots": ("kForwardSlots", "uint16_t", 1, 5000),
    "fragment_slots": ("kFragmentSlots", "uint16_t", 1, 5000),
    "records": ("kRecords", "uint16_t", 2, 5000), "buckets": ("kBuckets", "uint16_t", 0, 4096),
    "buffer_budget_bytes": ("kBufferBudgetBytes", "uint32_t", 64, 1 << 20),
    "clock_bits": ("kClockBits", BITS, 8, 32),
    "assembly_ticks": ("kAssemblyTicks", TICKS, 1, 10**6),
    "one_hop_duplicate_ticks": ("kOneHopDuplicateTicks", TICKS, 0, 10**6),
    "flood_surely_ticks": ("kFloodSurelyTicks", TICKS, 0, 10**6),
    "flood_ticks": ("kFloodTicks", TICKS, 0, 10**6),
    "forward_repeats": ("kForwardRepeats", BITS, 0, 255),
}
KEYS = {"base", "checksum", "padded", *NUMBERS}
LOOK_S = 0.2  # a compiler is at work: has somebody interrupted us?
PROGRAMS = {  # header, template
    "hop_count": ("hop_count", "HopCountOneSeed"), "hop_count_two_seeds": ("hop_count", "HopCount"),
    "firefly": ("firefly", "Firefly"), "firefly_no_delay": ("firefly", "FireflyNoDelay"),
    "edge_following": ("edge_following", "EdgeFollowing"), "news": ("news", "News")}


def check_value(key: str, value):
    """Raises ScenarioError or SweepError unless a profile's key may have this value."""
    if key in NUMBERS:
        _, _, least, most = NUMBERS[key]
        limits.check_number(value, (limits.WHOLE, least, most), f"profile.{key}")
    elif key == "padded":
        if not isinstance(value, bool):
            raise SweepError("profile.padded must be true or false")
    elif value not in (BASES if key == "base" else CHECKSUMS):
        raise SweepError(f"profile.{key} is {value!r}: must be one of "
                         + " ".join(BASES if key == "base" else CHECKSUMS))


def describe(profile: dict) -> str:
    return ", ".join(f"{key} = {value}" for key, value in sorted(profile.items()))


def header_text(profile: dict, program: str) -> str:
    """What suite/sim/swept.cpp includes."""
    base, base_header = BASES[profile.get("base", "kilobot")]
    program_header, template = PROGRAMS[program]
    lines = []
    for key, value in sorted(profile.items()):
        if key in NUMBERS:
            lines.append(f"  static constexpr {NUMBERS[key][1]} {NUMBERS[key][0]} = {value};")
        elif key == "padded":
            lines.append(f"  static constexpr bool kPadded = {str(value).lower()};")
        elif key == "checksum":
            lines.append("  static constexpr core::Checksum kChecksum = core::Checksum::"
                         f"{CHECKSUMS[value]};")
    return "\n".join([
        "#pragma once", f'#include "suite/programs/{program_header}.hpp"',
        f'#include "swarmtalk/profiles/{base_header}.hpp"',
        "namespace swarmtalk::suite {", f"struct SweptProfile : {base} {{",
        "  using Counter = uint32_t;", *lines, "};",
        f"template <class Robot> using SweptProgram = {template}<Robot>;",
        f'constexpr const char* kSweptProgram = "{program}";', "}", ""])


def compiler() -> list[str]:
    """CXX and CXXFLAGS, as they are known; the bytes of a run depend on neither."""
    return [*shlex.split(os.environ.get("CXX", "g++")),
            *shlex.split(os.environ.get("CXXFLAGS", "-O2")), "-std=c++20", "-ffp-contract=off",
            "-Wfatal-errors", "-Werror=overflow", f"-I{ROOT}", f"-I{ROOT}/core/include"]


def sources_digest() -> str:
    """Of all that a simulator is compiled from, and of the compiler."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*.[ch]pp")):
            digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    words = compiler()
    try:
        version = subprocess.run([words[0], *(w for w in words[1:2] if not w.startswith("-")),
                                  "--version"], capture_output=True, text=True, timeout=60)
    except OSError as error:
        raise SweepError(f"no compiler {words[0]} for the profiles ({error.strerror}): install "
                         "g++, or name one with CXX") from error
    digest.update("\0".join([version.stdout, *words[:-2]]).encode())
    return digest.hexdigest()


def last_words(errors: str) -> str:
    """Of a compiler's many lines the one that says why."""
    found = re.search(r"static assertion failed: (.*)|static_assert failed.*\"(.*)\"", errors)
    if found:
        return (found[1] or found[2]).strip('"')
    found = re.search(r"error: (.*)", errors)
    return found[1] if found else (errors.strip().splitlines() or ["the compiler ended"])[-1]


def call_compiler(arguments: list, what: str, folder: pathlib.Path | None = None):
    """Raises SweepError with the compiler's reason, platforms.Interrupted after Ctrl-C."""
    if platforms.interrupted:
        raise platforms.Interrupted
    with subprocess.Popen([*compiler(), *map(str, arguments)], stdin=subprocess.DEVNULL, cwd=folder,
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        errors = None
        while errors is None:
            try:
                _, errors = process.communicate(timeout=LOOK_S)
            except subprocess.TimeoutExpired:
                if platforms.interrupted:
                    process.terminate()
    if platforms.interrupted:
        raise platforms.Interrupted
    if process.returncode != 0:
        raise SweepError(f"{what} does not compile: {last_words(errors)}")


def make_scenario_object(folder: pathlib.Path, digest: str) -> pathlib.Path:
    """What no profile changes, compiled once for all."""
    path = folder / f"scenario-{digest[:16]}.o"
    if not path.exists():
        part = path.with_name(f".{os.getpid()}.o")
        call_compiler(["-c", ROOT / "suite/sim/scenario.cpp", "-o", part], "suite/sim/scenario.cpp")
        part.replace(path)
    return path


def make_simulator(folder: pathlib.Path, key: str, profile: dict, program: str,
                   scenario_object: pathlib.Path):
    """folder/key/swarmtalk-sim, whole or not there."""
    place = folder / key
    place.mkdir(parents=True, exist_ok=True)
    header = place / "profile.hpp"
    header.write_text(header_text(profile, program), encoding="utf-8")
    part = f".{os.getpid()}"
    what = f"the profile with {describe(profile)}"
    # In its folder and in two steps, so that a compiler's cache knows it again elsewhere.
    call_compiler(["-I.", f'-DSWARMTALK_SWEPT="{header.name}"', "-c", ROOT / "suite/sim/swept.cpp",
                   "-o", f"{part}.o"], what, place)
    call_compiler([f"{part}.o", scenario_object.resolve(), "-o", part], what, place)
    (place / f"{part}.o").unlink()
    (place / part).replace(place / "swarmtalk-sim")


def make_all(cells: list, folder: pathlib.Path, jobs: int, say) -> dict[int, str]:
    """Compiles what is not there yet. @return cell's number: path of its simulator in `folder`.
    Cells on other platforms have none. @param say  told what goes on"""
    folder.mkdir(parents=True, exist_ok=True)
    simulated = [c for c in cells if c.scenario["platform"].startswith("sim-")]
    found, wanted = {}, {}
    if any(not c.profile for c in simulated):
        shipped = platforms.program_path("swarmtalk-sim", "suite")
        digest = hashlib.sha256(shipped.read_bytes()).hexdigest()[:16]
        place = folder / f"shipped-{digest}"
        if not (place / "swarmtalk-sim").exists():
            place.mkdir(exist_ok=True)
            shutil.copy(shipped, place / f".{os.getpid()}")
            (place / f".{os.getpid()}").replace(place / "swarmtalk-sim")
        found |= {c.number: f"{place.name}/swarmtalk-sim" for c in simulated if not c.profile}
    if any(c.profile for c in simulated):
        if not (ROOT / "suite/sim/swept.cpp").exists():
            raise SweepError("profiles are compiled from the sources of swarmtalkd, and this is an "
                             "installed copy: run suite/swarmtalk-suite in a clone, or leave "
                             "profile out")
        digest = sources_digest()
        for cell in simulated:
            if cell.profile:
                text = header_text(cell.profile, cell.scenario["program"]) + digest
                key = hashlib.sha256(text.encode()).hexdigest()[:16]
                found[cell.number] = f"{key}/swarmtalk-sim"
                if not (folder / key / "swarmtalk-sim").exists():
                    wanted[key] = cell
    if wanted:
        say(f"compiling {len(wanted)} simulators, one for each profile and program")
        scenario_object = make_scenario_object(folder, digest)
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            futures = [pool.submit(make_simulator, folder, key, cell.profile,
                                   cell.scenario["program"], scenario_object)
                       for key, cell in wanted.items()]
            try:
                for future in futures:
                    future.result()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    return found
