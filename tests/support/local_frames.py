"""The local protocol's frames and their protobuf fields, by hand: docs/ipc.md has the bytes."""
import struct

MOST_BYTES = 4 + 65536  # of a frame, its length included


def varint(number):
    out = b""
    while number > 0x7F:
        out += bytes([number & 0x7F | 0x80])
        number >>= 7
    return out + bytes([number])


def field(number, value):
    """One protobuf field: a varint, or bytes with their length."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


def fields(message):
    """The last value of each field."""
    out, at = {}, 0

    def number():
        nonlocal at
        value = shift = 0
        while True:
            byte = message[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    while at < len(message):
        key = number()
        size = {0: None, 1: 8, 5: 4}.get(key & 7, -1)
        if size is None:
            out[key >> 3] = number()
            continue
        size = number() if size < 0 else size
        out[key >> 3] = message[at:at + size]
        at += size
    return out


def frame(envelope):
    return struct.pack("<I", len(envelope)) + envelope


def next_envelope(received, receive):
    """(the next envelope, what came after it). @param received  bytes so far, of whole frames and
    the beginning of one. @param receive  waits for more; empty at the end. @raises EOFError;
    ValueError when this is not the beginning of a frame"""
    while True:
        if len(received) >= 4:
            end = 4 + struct.unpack_from("<I", received)[0]
            if end > MOST_BYTES:
                raise ValueError("this is not the beginning of a frame")
            if len(received) >= end:
                return received[4:end], received[end:]
        more = receive()
        if not more:
            raise EOFError
        received += more
