"""As many messages as fit into the time, each to be sent on as often as the format allows."""
import frames


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--ttl", type=int, default=255)
    parser.add_argument("--size", type=int, default=100, help="bytes of each message")
    options = parser.parse_args()
    draws = frames.draws(options)
    stranger = frames.Stranger(options.interface)
    number = 0
    for count in frames.paced(options):
        epoch = draws.getrandbits(16)
        packets = []
        for _ in range(1400 // (options.size + frames.HEADER_BYTES + 2)):
            number += 1
            packets.append(frames.packet(99, number, options.channel, draws.randbytes(options.size),
                                         ttl=options.ttl, epoch=epoch))
        stranger.send(frames.air_frame(99, epoch, count + 1, packets), frames.address(draws))
    print(number)


main()
