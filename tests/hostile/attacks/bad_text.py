"""Text that steers a terminal or hides what it is, wherever a robot takes text from the air:
messages, log lines, questions and answers of harvest, reports with programs, values and a robot's
name, and the names of links in messages that crossed a gateway. Prints how many frames."""
import socket
import struct

import frames

# C1 and C0 control characters, all that changes the direction, what is invisible, what is no UTF-8,
# and a name that would end its own quotes.
TEXTS = ["\u009b2Ja", "\u202eexe", "\x1b[2Jb", "a\u2066b\u2069", "c\u200b\u200fd", "\u2028e\u2029",
         "x' (pid 1, uid 0) closed: y", "a\rb\nc\td\x07", "\ufefff\u061c", "\x7f\x85"]
BYTES = [text.encode() for text in TEXTS] + [b"\xff\xfe", b"a\xc3", b"\xed\xa0\x80", b"\xf4\x90"]


def section(kind, content):
    return bytes([kind, len(content)]) + content


def report(text, node):
    """What robot NODE says of itself, with `text` wherever there is room for one."""
    text = text[:20]
    body = (section(3, struct.pack(">HBBH", 5, 1, 1, 9)) + section(5, bytes([len(text)]) + text)
            + section(6, text)
            + section(7, bytes([len(text)]) + text + bytes([len(text)]) + text))
    return (b"R\x01" + struct.pack(">HBB", 10, 0, 0)
            + struct.pack(">HBB", node, 0, len(body)) + body)


def answer(text, question=1):
    return b"A" + struct.pack(">I", question) + bytes([len(text)]) + text + struct.pack(
        ">H", len(text)) + text


def questions(listening):
    """Numbers of the questions that were heard since the last call."""
    found = []
    while True:
        try:
            frame = listening.recv(2048)[14:]
        except BlockingIOError:
            return found
        at = 18 + 2 + frames.HEADER_BYTES  # of the first packet's payload
        if frame[:2] == b"ST" and frame[at:at + 1] == b"Q":
            found.append(struct.unpack_from(">I", frame, at + 1)[0])


def main():
    parser = frames.parser(__doc__)
    parser.add_argument("--channel", type=int, required=True)
    parser.add_argument("--debug", type=int, required=True)
    parser.add_argument("--harvest", type=int, required=True)
    options = parser.parse_args()
    stranger = frames.Stranger(options.interface)
    listening = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(frames.ETHERTYPE))
    listening.bind((options.interface, frames.ETHERTYPE))
    listening.setblocking(False)
    asked = [1]
    epoch = frames.draws(options).getrandbits(16)
    count = 0
    for count in frames.paced(options):
        asked = (asked + questions(listening))[-3:]
        text, node = BYTES[count % len(BYTES)], 90 + count % len(BYTES)
        payloads = [(options.channel, text, False), (options.debug, text, False),
                    *((options.harvest, answer(text, each), False) for each in asked),
                    (options.harvest, b"Q\0\0\0\1\0" + text, False),
                    (options.harvest, report(text, node), False),
                    (options.channel, frames.origin(text) + b"boo", True)]
        packets = [frames.packet(node, count * 10 + each + 1, channel, payload,
                                 epoch=epoch, crossed=crossed)
                   for each, (channel, payload, crossed) in enumerate(payloads)]
        stranger.send(frames.air_frame(node, epoch, count + 1, packets))
    print(count + 1)


main()
