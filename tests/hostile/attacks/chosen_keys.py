"""Messages with chosen names: with the multiplier 2^64 / golden ratio and no secret, all would be
in one of 4,096 buckets of the table of messages."""
import frames

MULTIPLIER = 0x9E3779B97F4A7C15
INVERSE = pow(MULTIPLIER, -1, 1 << 64)


def main():
    parser = frames.parser(__doc__)
    options = parser.parse_args()
    draws = frames.draws(options)
    stranger = frames.Stranger(options.interface)
    for count in frames.paced(options):
        packets = []
        for _ in range(60):
            # Any product below 2^52 is in bucket 0; the key is its preimage.
            key = draws.getrandbits(52) * INVERSE % (1 << 64)
            packets.append(frames.packet(key >> 48, key >> 16 & 0xFFFFFFFF, key & 0xFFFF, ttl=1))
        stranger.send(frames.air_frame(99, 7, count + 1, packets))


main()
