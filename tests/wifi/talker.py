"""Runs in a Wi-Fi guest, once for all of its robots: programs of several robots that send and
listen, in one process, since under emulation the start of a process takes half a second.

Standard input: JSON lines, orders; each is answered by one line.

    {"ways": [["/run/r1.sock", ["/run/r2.sock"]]], "channel": "count", "messages": 50,
     "rate_hz": 25, "size": 16, "tries": 8, "settle_s": 12}

tells, of each sender and listener: messages sent, those heard, and what the listener's daemon
counts as lost by place. It sends single messages, at most `tries`, until each listener has heard
one, since a loss is known only from there on; then `messages`; then it waits until nothing is
unaccounted for, at most `settle_s`.
"""
import json
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                "../../client_lib/python"))

import swarmtalk  # noqa: E402

WARM_UP_S = 0.5
LOOK_S = 0.2


class Listener:
    def __init__(self, client, socket, order):
        self.client, self.socket, self.channel = client, socket, order["channel"]
        self.numbers, self.lost_client = [], 0
        client.subscribe(self.channel, receive=self.hear)

    def hear(self, message):
        self.numbers.append((message.epoch, message.message_number))
        self.lost_client += message.lost_before.client

    def account(self, sent):
        lost = {}
        for each in self.client.status().channels:
            if each.name == self.channel:
                lost = {"lost_air": each.lost_air, "lost_kernel": each.lost_kernel,
                        "lost_daemon": each.lost_daemon, "late": each.late}
        first = min((number for _, number in self.numbers), default=1)
        return {"sent": sent, "heard": len(self.numbers), "first": first,
                "duplicates": len(self.numbers) - len(set(self.numbers)),
                "lost_client": self.lost_client, **lost}


def is_settled(account):
    """As Account.unaccounted of guest.py, which judges."""
    lost = sum(account.get(key, 0) for key in ("lost_air", "lost_kernel", "lost_daemon",
                                               "lost_client")) - account.get("late", 0)
    return account["heard"] and account["sent"] - account["heard"] - lost <= account["first"] - 1


class Exchange:
    """One order; its clients end with it."""

    def __init__(self, order):
        self.order, self.clients, self.sent = order, {}, 0
        self.publishers, self.listeners = [], []
        for sender, listeners in order["ways"]:
            for socket in listeners:
                self.listeners.append((sender, Listener(self.client(socket), socket, order)))
        for sender, _ in order["ways"]:
            self.publishers.append(self.client(sender).advertise(order["channel"]))

    def client(self, socket):
        if socket not in self.clients:
            self.clients[socket] = swarmtalk.Client("talker", socket_path=socket)
            self.clients[socket].request_timeout = 20.0
        return self.clients[socket]

    def turn(self, seconds):
        """Lets all clients work for so long."""
        end = time.monotonic() + seconds
        while True:
            for client in self.clients.values():
                client.process()
            left = end - time.monotonic()
            if left <= 0:
                return
            time.sleep(min(left, 0.01))

    def send(self, payload):
        for publisher in self.publishers:
            while not publisher.send(payload):
                self.turn(0.02)
        self.sent += 1

    def all_have_heard(self):
        return all(listener.numbers for _, listener in self.listeners)

    def run(self):
        for _ in range(self.order["tries"]):
            self.send("warm up")
            end = time.monotonic() + WARM_UP_S
            while not self.all_have_heard() and time.monotonic() < end:
                self.turn(0.05)
            if self.all_have_heard():
                break
        begin = time.monotonic()
        for number in range(self.order["messages"]):
            wait = begin + number / self.order["rate_hz"] - time.monotonic()
            self.turn(max(0.0, wait))
            self.send("x" * self.order["size"])
        end = time.monotonic() + self.order["settle_s"]
        while True:
            self.turn(LOOK_S)
            accounts = [(sender, listener.socket, listener.account(self.sent))
                        for sender, listener in self.listeners]
            if all(is_settled(account) for _, _, account in accounts) or time.monotonic() > end:
                return accounts

    def close(self):
        for client in self.clients.values():
            client.close()


def carry_out(order):
    exchange = Exchange(order)
    try:
        return {"accounts": exchange.run()}
    finally:
        exchange.close()


def main():
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        try:
            answer = carry_out(json.loads(line))
        except Exception as error:  # told to whoever asked
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
