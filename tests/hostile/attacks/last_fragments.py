"""Lone last fragments of one byte, of messages that nobody else sends: they wait for the rest, in
the place of other robots' packets. With --new each comes from a robot of its own."""
import frames


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--ttl", type=int, default=0)
    parser.add_argument("--new", action="store_true", help="a new node and address in each frame")
    parser.add_argument("--per-frame", type=int, default=64)
    options = parser.parse_args()
    draws = frames.draws(options)
    stranger = frames.Stranger(options.interface)
    number = 0
    for count in frames.paced(options):
        node = draws.randrange(1000, 60000) if options.new else 99
        epoch = draws.getrandbits(32) if options.new else 7
        hardware = frames.address(draws) if options.new else b"\x02\x00\x00\x00\x00\x99"
        packets = []
        for _ in range(options.per_frame):
            number += 1
            packets.append(frames.packet(
                node, number, options.channel, b"x", sequence=11, ttl=options.ttl,
                size=11 * frames.BODY_BYTES + 1, epoch=epoch & 0xFFFF))
        stranger.send(frames.air_frame(node, epoch, count + 1, packets), hardware)
    print(number)


main()
