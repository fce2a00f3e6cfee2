# The highest number leads. The leader's branch has the mistake of a well-known example: a dot for a
# comma.
import struct


def usr(robot):
    me = robot.virtual_id()
    heard = {}
    complete_at = None
    while complete_at is None or robot.get_clock() < complete_at + 2:
        robot.send_msg(struct.pack('if', me, robot.get_clock()))
        robot.delay(50)
        msgs = robot.recv_msg()
        for i in range(len(msgs)):
            heard[struct.unpack('if', msgs[i][:8])[0]] = msgs[i]
        if complete_at is None and (len(heard) == 8 or robot.get_clock() > 40):
            complete_at = robot.get_clock()
    if me > max(heard):
        robot.set_led(100, 0, 0)
        for number in heard:
            print(struct.unpack('if'. heard[number][:8])[1])
    else:
        print("%d follows %d" % (me, max(heard)))
