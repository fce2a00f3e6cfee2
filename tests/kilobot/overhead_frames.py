"""Frames for the overhead controller (kilobot_wire/overhead_frame.hpp), as bytes."""
STOP, LED_TOGGLE, FORWARD, FORWARD_RAW, PAGE, GPS, SINGLE, VERSION = range(8)
BOOT, PROGRAM_PAGE, PROGRAM_PAGES, RESET = 0x80, 0x81, 0x82, 0x83
SLEEP, WAKEUP, CHARGE, VOLTAGE, RUN, READ_UID, CALIBRATE = range(0x84, 0x8B)
FRAME_BYTES = 132
PAGE_BYTES = 128


def frame(kind: int, payload: bytes = b"") -> bytes:
    """A frame of 132 bytes whose XOR is 0."""
    body = (bytes([0x55, kind]) + payload).ljust(FRAME_BYTES - 1, b"\0")
    check = 0
    for byte in body:
        check ^= byte
    return body + bytes([check])


def forward(ir_type: int, data: bytes = b"", kind: int = FORWARD) -> bytes:
    return frame(kind, data.ljust(9, b"\0") + bytes([ir_type]))


def stop() -> bytes:
    return frame(STOP)


def page(number: int, data: bytes) -> bytes:
    return frame(PAGE, bytes([number]) + data.ljust(PAGE_BYTES, b"\xff"))


def send_at(seconds: float, data: bytes) -> str:
    """In the emulator's notation: these bytes, from that time on."""
    return f"hex:{data.hex()}@{seconds:.4f}"


def command(seconds: float, ir_type: int, data: bytes = b"", hold: float = 0.5) -> list[str]:
    """A message repeated for `hold` seconds, then silence."""
    return [send_at(seconds, forward(ir_type, data)), send_at(seconds + hold, stop())]


def upload(seconds: float, program: bytes, passes: int) -> tuple[list[str], float]:
    """A whole program, several times over. @return commands, and when the last one has been sent"""
    pause = 0.1344 + 0.0344  # silence, and the frame's time on the line
    pages = [program[i:i + PAGE_BYTES] for i in range(0, len(program), PAGE_BYTES)]
    commands = []
    for _ in range(passes):
        frames = [forward(PROGRAM_PAGES, bytes([len(pages)]))]
        frames += [page(number, data) for number, data in enumerate(pages)]
        for data in frames:
            commands.append(send_at(seconds, data))
            seconds += pause
    commands.append(send_at(seconds, stop()))
    return commands, seconds
