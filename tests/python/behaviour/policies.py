"""What a subscriber leaves out."""
import time

from case import PATIENCE_S, Case, daemons, swarmtalk


class Policies(Case):
    def heard_with(self, **policy):
        """What is heard of five messages, the third from a robot far away, after a while."""
        near, far, listener = self.client(0), self.client(0), self.client(1)
        listener.set_fixed_pose(0, 0, 0)
        listener.sync()
        subscriber = listener.subscribe("p", **policy)
        publisher = near.advertise("p", sent=True)
        for index, x in enumerate([0.2, 0.3, 3.0, 0.4, 0.5]):
            far.set_fixed_pose(x, 0, 0)
            far.sync()
            publisher.send("%d" % index)
            self.run_until(near, lambda: not publisher._in_flight)
        end = self.client(0).advertise("end")
        ended = self.client(1).subscribe("end")
        end.send("")
        self.assertIsNotNone(ended.get(PATIENCE_S))
        return [m.data for m in subscriber.take()]

    def test_without_a_policy_all_are_heard_in_order(self):
        self.assertEqual(self.heard_with(), [b"0", b"1", b"2", b"3", b"4"])

    def test_keep_last(self):
        self.assertEqual(self.heard_with(keep_last=2), [b"3", b"4"])

    def test_latest_from_each(self):
        self.assertEqual(self.heard_with(latest_from_each=True), [b"4"])

    def test_within(self):
        self.assertEqual(self.heard_with(within=1.0), [b"0", b"1", b"3", b"4"])

    def test_no_older_than(self):
        listener = self.client(1)
        subscriber = listener.subscribe("old", no_older_than=0.2)
        publisher = self.client(0).advertise("old")
        publisher.send("old")
        time.sleep(0.5)
        publisher.send("new")
        message = subscriber.get(PATIENCE_S)
        self.assertEqual(message.data, b"new")
        self.assertEqual(message.lost_before.total, 1)

    def test_known_distance_only(self):
        with daemons.Daemons(2) as others:  # robots without a pose
            listener = swarmtalk.Client("l", others[1].socket)
            only, any_ = listener.subscribe("k", known_distance_only=True), listener.subscribe("k")
            robot = swarmtalk.Client("r", others[0].socket)
            robot.advertise("k").send("x")
            self.assertEqual(any_.get(PATIENCE_S).data, b"x")
            self.assertEqual(only.take(), [])
            robot.close()
            listener.close()
