"""Frames of every kind that there is, right, half right and wrong, from a seed: packets, lone
fragments, parity packets, beacons, crossed origins, pings, looks and reports, sealed frames without
the key, and each of them with bits flipped or cut. With --small in the profile of Kilobots."""
import struct

import frames

NAMES = [b"wifi", b"small", b"\xff\xfe", b"\x1b[2J", b"x" * 64]


def small_packet(draws, channel):
    """Nine bytes with the checksum of the profile "kilobot"."""
    start = bytes([draws.randrange(255), draws.randrange(256),
                   (channel & 15) << 4 | draws.randrange(16)]) + draws.randbytes(5)
    return start + bytes([sum(start) & 0xFF])


def text(draws):
    number = draws.randrange(2**32)
    return draws.choice([
        f"ping {number} {draws.randrange(9)} {draws.randrange(1, 4)} {draws.randrange(256)}",
        f"pong {number} {draws.randrange(9)} 1 {draws.randrange(256)} {draws.randrange(4)}",
        "ping " + "9" * draws.randrange(300), "pong 1 2 3"]).encode()


def report(draws):
    """A look, a report or a question, with a body of any length."""
    records = b"".join(
        struct.pack(">HBB", draws.randrange(65536), draws.randrange(256), len(body)) + body
        for body in (draws.randbytes(draws.randrange(40)) for _ in range(draws.randrange(5))))
    roots = draws.randrange(6)
    return draws.choice([
        b"L\x01" + bytes([draws.randrange(256), draws.randrange(6)]) + draws.randbytes(8),
        b"R\x01" + struct.pack(">HBB", draws.randrange(65536), draws.randrange(256), roots)
        + draws.randbytes(8 * roots) + records,
        b"Q" + draws.randbytes(5) + b"/", b"A" + draws.randbytes(20)])


def packet(draws, channels):
    """One packet of the profile "wifi", whose fields mostly fit each other."""
    node, number = draws.randrange(1, 12), draws.randrange(1, 400)
    channel = draws.choice(channels)
    crossed = draws.random() < 0.2
    payload = draws.choice([text, report, lambda d: d.randbytes(d.randrange(200))])(draws)
    if crossed:
        payload = frames.origin(draws.choice(NAMES), draws.randrange(9)) + payload
    size = len(payload)
    sequence, end, full = 0, True, False
    if draws.random() < 0.4:
        of = draws.randrange(2, 13)
        sequence, full = draws.randrange(of + 16), draws.random() < 0.8
        end = sequence == of - 1
        size = (of - 1) * frames.BODY_BYTES + 1 + draws.randrange(frames.BODY_BYTES)
    if full:
        payload = draws.randbytes(frames.BODY_BYTES if not end else
                                  size - (size - 1) // frames.BODY_BYTES * frames.BODY_BYTES)
    made = bytearray(frames.packet(node, number, channel, payload, sequence=sequence, end=end,
                                   ttl=draws.choice([0, 1, 5, 255]), hops=draws.choice([0, 3, 255]),
                                   size=min(size, 65535), epoch=draws.randrange(4),
                                   crossed=crossed))
    made[16] |= draws.choice([0, 0, 0x80, draws.randrange(16) << 2, draws.randrange(256)])
    return bytes(made[:frames.PACKET_BYTES])


def one(draws, options, count):
    """One air frame."""
    node, epoch = draws.randrange(1, 12), draws.randrange(4)
    if options.small:
        packets = [small_packet(draws, draws.randrange(16)) for _ in range(draws.randrange(1, 60))]
        return frames.air_frame(node, epoch, count, packets)
    flags, rest, packets = 0, b"", []
    kind = draws.random()
    if kind < 0.1:
        flags, rest = frames.BEACON, draws.randbytes(6 * draws.randrange(40))
    elif kind < 0.2:
        flags = draws.choice([0x02, 0x0A, 0x0B])  # sealed, fresh, with a pose
        rest = draws.randbytes(draws.randrange(300))
    elif kind < 0.3:
        flags, rest = 0x01, draws.randbytes(7)
    else:
        room = frames.PACKET_BYTES
        while room > 60 and len(packets) < draws.choice([1, 3, 30]):
            packets.append(packet(draws, options.channel)[:room])
            room -= len(packets[-1]) + 2
    return frames.air_frame(node, epoch, count, packets, flags=flags, rest=rest)


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, nargs="+", required=True)
    parser.add_argument("--small", action="store_true")
    options = parser.parse_args()
    draws = frames.draws(options)
    stranger = frames.Stranger(options.interface)
    count = 0
    for count in frames.paced(options):
        frame = bytearray(one(draws, options, count + 1))
        if options.small:
            frame[6] = 1
        for _ in range(draws.choice([0, 0, 0, 1, 4])):
            at = draws.randrange(len(frame))
            frame[at] ^= 1 << draws.randrange(8)
        if draws.random() < 0.05:
            del frame[draws.randrange(len(frame)):]
        stranger.send(bytes(frame[:1500]), frames.address(draws))
    print(count + 1)


main()
