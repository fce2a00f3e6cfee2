# Blinks when its clock has run around or a neighbour blinks, after Strogatz; text messages.
import random

PERIOD = 1.0


def get_id(robot):
    fn = robot.virtual_id
    return fn() if callable(fn) else fn


def usr(robot):
    my_id = get_id(robot)
    random.seed(my_id)
    phase = random.random() * PERIOD
    last = robot.get_clock()
    seen = set()
    blinks = 0
    while robot.get_clock() < 40 and (len(seen) < 8 or blinks < 4):
        now = robot.get_clock()
        phase += now - last
        last = now
        if phase > PERIOD:
            phase = 0
            blinks += 1
            robot.set_led(100, 100, 0)
            robot.send_msg("id:%d;t:%.3f;" % (my_id, now))
        for msg in robot.recv_msg(clear=True):
            fields = dict(part.split(":") for part in msg.decode().split(";") if part)
            seen.add(int(fields["id"]))
            phase += 0.05 * phase
        robot.delay(20)
    print("%d saw %d blink, blinked %s" % (my_id, len(seen), "often" if blinks > 3 else "rarely"))
