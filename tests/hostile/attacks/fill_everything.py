"""Every limit at once: all places of this user, each with as many subscriptions as it gets and deep
queues that nobody reads, answers that nobody reads, publishers whose messages wait. Holds all of it
until its stdin ends. Prints what it got.

fill_everything.py SOCKET CLIENTS SEED"""
import json
import random
import sys

from local_client import GET_STATUS, SUBSCRIBE, Client, failure_text, field, frame

SUBSCRIPTIONS, KEEP_LAST, CHANNELS = 64, 1024, 4
STATUSES, PUBLISHERS, MESSAGES, FLOODS = 30, 4, 64, 4


def send(client, body):
    """Unless the daemon takes no more of this client."""
    try:
        client.socket.sendall(body)
    except OSError:
        pass


def fill(client, chance):
    """Registers, and from then on reads nothing."""
    wish = b"".join(frame(field(1, 1000 + each) + field(SUBSCRIBE, field(
        1, field(1, f"flood {each % CHANNELS}")) + field(2, KEEP_LAST)))
        for each in range(SUBSCRIPTIONS))
    client.socket.sendall(wish)
    waiting = [client.advertise(f"slow {each}", queue=64, copies=10, copy_interval_ms=10_000)
               for each in range(PUBLISHERS)]
    flooding = [client.advertise(f"flood {each}", queue=FLOODS) for each in range(CHANNELS)]
    client.socket.settimeout(1)
    for publishers, messages, sizes in ((waiting, MESSAGES, (0, 100, 1000)),
                                        (flooding, FLOODS, (0, 1000, 16000))):
        for number in range(1, messages + 1):
            for each in publishers:
                payload = chance.randbytes(chance.choice(sizes))
                body = field(1, each) + field(2, number) + field(3, payload)
                send(client, frame(field(11, body)) if isinstance(each, int) else b"")
    send(client, STATUSES * frame(field(1, 1) + field(GET_STATUS, b"")))
    return sum(isinstance(each, int) for each in waiting + flooding)


if __name__ == "__main__":
    CHANCE = random.Random(int(sys.argv[3]))
    HELD, REFUSAL, PUBLISHING = [], "", 0
    for number in range(int(sys.argv[2])):
        client = Client(sys.argv[1], name=f"hostile {number}")
        answer = client.take()
        if 3 in answer:
            REFUSAL = failure_text(answer)
            break
        HELD.append(client)
        PUBLISHING += fill(client, CHANCE)
    print(json.dumps({"clients": len(HELD), "publishers": PUBLISHING, "refusal": REFUSAL}),
          flush=True)
    sys.stdin.read()
