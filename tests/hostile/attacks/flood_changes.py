"""Asks for what an operator asks for, as fast as it goes: many reloads in one write, then node ids.
Prints how many were done and how many refused, as JSON.

flood_changes.py SOCKET RELOADS NODE_IDS"""
import json
import sys

from local_client import FAILURE, Client, failure_text, field, frame

RELOAD, SET_NODE_ID = 60, 64
AT_ONCE = 500


def ask_all(client, bodies):
    """@return how many were done, and the last refusal"""
    first = client.last_id + 1
    client.last_id += len(bodies)
    client.socket.sendall(b"".join(frame(field(1, first + i) + body)
                                   for i, body in enumerate(bodies)))
    done, refusal = 0, ""
    for i in range(len(bodies)):
        answer = client.answer(first + i)
        if FAILURE in answer:
            refusal = failure_text(answer)
        else:
            done += 1
    return done, refusal


if __name__ == "__main__":
    CLIENT = Client(sys.argv[1])
    RELOADS, _ = ask_all(CLIENT, int(sys.argv[2]) * [field(RELOAD, b"")])
    IDS, REFUSAL, left = 0, "", int(sys.argv[3])
    while left > 0:
        done, text = ask_all(CLIENT, [field(SET_NODE_ID, field(1, 1 + left % 50))
                                      for left in range(left, max(left - AT_ONCE, 0), -1)])
        left -= AT_ONCE
        IDS, REFUSAL = IDS + done, text or REFUSAL
    print(json.dumps({"reloads": RELOADS, "node_ids": IDS, "refusal": REFUSAL}))
