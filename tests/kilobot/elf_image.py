"""What an AVR image holds, asked of avr-size, avr-nm and avr-objdump."""
import dataclasses
import re
import subprocess


@dataclasses.dataclass
class Sizes:
    """Bytes of an image: flash it fills, RAM that is taken before the stack."""
    flash: int
    ram: int


def tool(*command) -> str:
    return subprocess.run(list(map(str, command)), capture_output=True, text=True,
                          check=True).stdout


def sizes(path) -> Sizes:
    text, data, bss = map(int, tool("avr-size", path).splitlines()[1].split()[:3])
    return Sizes(flash=text + data, ram=data + bss)


def flash_range(path) -> tuple[int, int]:
    """First and last byte address of flash that the image fills, initial values included."""
    parts = []
    for line in tool("avr-objdump", "-h", path).splitlines():
        fields = line.split()
        if len(fields) >= 6 and fields[1] in (".text", ".data") and int(fields[2], 16):
            size, load_address = int(fields[2], 16), int(fields[4], 16)
            parts.append((load_address, load_address + size - 1))
    return min(part[0] for part in parts), max(part[1] for part in parts)


def flash_bytes(path, tmp_path) -> bytes:
    """The image as it lies in flash, from its first address."""
    binary = tmp_path / "image.bin"
    tool("avr-objcopy", "-O", "binary", "-R", ".eeprom", "--gap-fill", "0xff", path, binary)
    first, last = flash_range(path)
    return binary.read_bytes()[:last - first + 1]


SKIPS = ("sbrc", "sbrs", "sbic", "sbis", "cpse")
INSTRUCTION = re.compile(r"\s*([0-9a-f]+):\t([0-9a-f]{2}) ([0-9a-f]{2}) [^\t]*\t(\S+)")


def misread_skips(path) -> list[str]:
    """Addresses where simavr 1.6 would leave the program's path.

    Behind a skip it takes "adiw" and "sbiw" with a low digit of 0xC to 0xF for a jump of two words
    and skips one word too many. Real processors are right; but what we measure there is not.
    """
    found = []
    previous = ""
    for line in tool("avr-objdump", "-d", path).splitlines():
        match = INSTRUCTION.match(line)
        if not match:
            continue
        address, low, high, name = match.groups()
        if previous in SKIPS and name in ("adiw", "sbiw") and int(low, 16) & 0xC == 0xC:
            found.append(address)
        previous = name
    return found
