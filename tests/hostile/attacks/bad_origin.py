"""Messages that say they crossed a gateway, from a link with a name that is not text, or that
steers a terminal."""
import frames

NAMES = [b"\xff\xfe", b"a\xc3", "\u009b2J".encode(), "\u202Eexe".encode(), "\u2028x".encode(),
         b"\x1b[2J", b"\xed\xa0\x80", b"\x00"]


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--ttl", type=int, default=0)
    options = parser.parse_args()
    draws = frames.draws(options)
    stranger = frames.Stranger(options.interface)
    epoch = draws.getrandbits(32)
    count = 0
    for count in frames.paced(options):
        payload = frames.origin(NAMES[count % len(NAMES)]) + b"boo"
        packet = frames.packet(99, count + 1, options.channel, payload, ttl=options.ttl,
                               epoch=epoch & 0xFFFF, crossed=True)
        stranger.send(frames.air_frame(99, epoch, count + 1, [packet]))
    print(count + 1)


main()
