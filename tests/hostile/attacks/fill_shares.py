"""One user's programs take all that they get: places, channels, publishers, subscriptions, messages
that wait. Prints what they were given and how they were refused, as JSON; holds it until its stdin
ends.

fill_shares.py SOCKET WHAT..."""
import json
import sys

from local_client import Client, failure_text, field, fields, frame

MOST_PLACES, MOST_CHANNELS, MESSAGES, PUBLISHERS = 80, 80, 1200, 8
COPIES, LONG_MS = 10, 10_000
TEXT_BYTES = 64


def take_places(path):
    """Connects until it is refused."""
    held = []
    for _ in range(MOST_PLACES):
        client = Client(path)
        answer = client.take()
        if 3 in answer:
            return {"given": len(held), "refusal": failure_text(answer)}, held
        held.append(client)
    return {"given": len(held), "refusal": ""}, held


def take_channels(path):
    """Registers with one client until it is refused, then with another."""
    held, given, refusal = [], [], ""
    for each in range(4):
        client = Client(path)
        held.append(client)
        for number in range(MOST_CHANNELS):
            answer = client.advertise(f"hostile {each} {number}")
            if isinstance(answer, str):
                given.append(number)
                refusal = answer
                break
        else:
            given.append(MOST_CHANNELS)
    return {"given": given, "refusal": refusal}, held


def take_waiting(path):
    """Sends messages that wait for copies ten seconds apart, each of a publisher of its own and
    queues behind them."""
    held, waiting, refusal = [], 0, ""
    for each in range(6):
        client = Client(path)
        held.append(client)
        publishers = [client.advertise(f"waits {number}", queue=256, copies=COPIES,
                                       copy_interval_ms=LONG_MS) for number in range(PUBLISHERS)]
        for publisher in publishers:
            client.socket.sendall(b"".join(
                frame(field(11, field(1, publisher) + field(2, count + 1) +
                            field(3, TEXT_BYTES * b"x")))
                for count in range(MESSAGES // PUBLISHERS)))
        client.post(field(17, b""))  # get_pose: answered behind all of them
        refused = 0
        while True:
            answer = client.take()
            if answer.get(1) == client.last_id:
                break
            if 3 in answer and 5 in fields(answer[3]):
                refused += 1
                refusal = failure_text(answer)
        waiting += MESSAGES - refused
    return {"given": waiting, "refusal": refusal}, held


TAKES = {"places": take_places, "channels": take_channels, "waiting": take_waiting}

if __name__ == "__main__":
    RESULTS, HELD = {}, []
    for what in sys.argv[2:]:
        RESULTS[what], more = TAKES[what](sys.argv[1])
        HELD += more
    print(json.dumps(RESULTS), flush=True)
    sys.stdin.read()
