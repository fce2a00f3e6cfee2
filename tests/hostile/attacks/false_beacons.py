"""Beacons in the name of another robot, which say that it has sent far more messages."""
import frames


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--node", type=int, required=True)
    parser.add_argument("--epoch", type=int, required=True)
    parser.add_argument("--step", type=int, default=9000, help="messages more in each")
    options = parser.parse_args()
    stranger = frames.Stranger(options.interface)
    for count in frames.paced(options):
        last = (options.channel, (count + 1) * options.step)
        stranger.send(frames.beacon(options.node, options.epoch, 100000 + count, [last]))


main()
