"""Messages in the name of another robot, with numbers far ahead of its own: each tells that all
between were lost."""
import frames


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--node", type=int, required=True)
    parser.add_argument("--epoch", type=int, required=True)
    parser.add_argument("--step", type=int, default=9000, help="numbers more in each")
    parser.add_argument("--hops", type=int, default=0, help="more than 0: as if sent on by others")
    options = parser.parse_args()
    stranger = frames.Stranger(options.interface)
    for count in frames.paced(options):
        number = (count + 1) * options.step & 0xFFFFFFFF
        made = frames.packet(options.node, number, options.channel, b"made up",
                             epoch=options.epoch & 0xFFFF, hops=options.hops)
        stranger.send(frames.air_frame(options.node, options.epoch, 100000 + count * options.step,
                                       [made]))


main()
