"""Messages whose names were chosen to share one bucket of an unseeded hash table."""
from stranger import Air, counter
from wires import heard

TITLE = "200 frames/s of 60 messages with chosen names for 5 s, 120 honest messages"
REFERENCE = "13 of 120 heard, 27 to 30 us a packet (0.6 without)"


def cpu_s(robot):
    with open(f"/proc/{robot.daemon.pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / 100


def measure():
    with Air() as air:
        sender, hearer = air.daemon(1), air.daemon(2)
        listener = hearer.subscribe("5", "-W", "10")
        before, packets = cpu_s(hearer), counter(hearer, "packets_received")
        attack = air.begin("chosen_keys", "--rate", 200, "--seconds", 5)
        sender.publish("5", "honest", "--repeat", 120, "--rate", 30)
        attack.communicate(timeout=60)
        spent, packets = cpu_s(hearer) - before, counter(hearer, "packets_received") - packets
        count = len(heard(listener, timeout=60))
        return (f"{count} of 120 heard, {1e6 * spent / packets:.1f} us a packet "
                "with its system calls")
