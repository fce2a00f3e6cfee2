"""Messages that crossed a gateway, from a link with a name that is not text."""
from stranger import Air, counter
from wires import heard

TITLE = "300 bad origins a second for 2 s, 100 honest messages"
REFERENCE = "17 to 24 of 200 honest messages heard, 19 disconnects in 20 frames"


def measure():
    with Air() as air:
        sender, hearer = air.daemon(1), air.daemon(2)
        listener = hearer.subscribe("5", "-W", "8")
        attack = air.begin("bad_origin", "--channel", 5, "--seconds", 2, "--rate", 300)
        sender.publish("5", "honest", "--repeat", "100", "--rate", "50")
        attack.communicate(timeout=60)
        messages = heard(listener)
        return f"{len(messages)} of 100 heard, {counter(hearer, 'node_bad_origins')} dropped"
