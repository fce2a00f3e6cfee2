"""Says hello ten times, twice a second, and prints what other robots say."""
import swarmtalk


def receive(message):
    away = ", %.2f m away" % message.distance if message.has_distance else ""
    print("robot %d says %s%s" % (message.sender, message.text, away))


robot = swarmtalk.Client("chatter")
hello = robot.advertise("hello")
robot.subscribe("hello", receive)
for number in range(1, 11):
    sent = hello.send("hello %d" % number)
    if not sent:
        print("not sent: " + sent.text)
    robot.run(0.5)
