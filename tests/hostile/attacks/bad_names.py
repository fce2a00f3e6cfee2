"""A program whose own name and channels' names are text that steers a terminal or fakes a line of
the log; some of them are closed for a malformed frame, which is logged with the name. Holds what it
got until its stdin ends. Prints how many names were taken, as JSON.

bad_names.py SOCKET"""
import json
import sys

from local_client import Client, field, frame

NAMES = ["\u009b2Ja", "\u202eexe", "\x1b[2Jb", "a\u2066b\u2069", "c\u200b\u200fd", "\u2028e\u2029",
         "x' (pid 1, uid 0) closed: y", "a\rb\nc\td\x07", "\ufefff\u061c", "\x7f\x85", "good"]
NO_FIELDS = b"\xff\xfe"

if __name__ == "__main__":
    HELD, CHANNELS, REFUSED = [], 0, 0
    for name in NAMES:
        for is_doomed in (False, True):
            client = Client(sys.argv[1], name=name)
            try:
                client.take()
                for wish in (client.advertise, client.subscribe):
                    if isinstance(wish(name), int):
                        CHANNELS += 1
                    else:
                        REFUSED += 1
                if is_doomed:
                    client.socket.sendall(frame(field(1, 1) + NO_FIELDS))
                    while True:
                        client.take()
            except (EOFError, OSError):
                pass
            HELD.append(client)
    print(json.dumps({"clients": len(HELD), "channels": CHANNELS, "refused": REFUSED}), flush=True)
    sys.stdin.read()
