"""Scripts of Coachbots."""
import os
import struct
import time

from case import PATIENCE_S, Case, swarmtalk


class Coachbot(object):
    """What coach-os hands to a script: get_pose() gives each pose once."""

    def __init__(self):
        self.poses = []
        self.calls = []

    def get_pose(self):
        return self.poses.pop(0) if self.poses else None

    def get_clock(self):
        return 1.5

    def delay(self, ms=20):
        self.calls.append(("delay", ms))

    def set_vel(self, left, right):
        self.calls.append(("set_vel", left, right))

    def virtual_id(self):
        return 42


class Scripts(Case):
    configuration = "[reserved]\ndebug = true\n"  # else each says that it is off

    def wrap(self, robot, own=None, **options):
        os.environ["SWARMTALK_SOCKET"] = self.daemons[robot].socket
        wrapped = swarmtalk.wrap(own, **options)
        self.clients.append(wrapped.swarm)
        return wrapped

    def received(self, robot):
        deadline = time.time() + PATIENCE_S
        while time.time() < deadline:
            messages = robot.recv_msg()
            if messages:
                return messages
            time.sleep(0.01)
        self.fail("nothing was received")

    def test_messages_have_their_exact_length(self):
        one, other = self.wrap(0), self.wrap(1)
        payload = struct.pack("ffi", 1, 2, 3)
        self.assertEqual(one.recv_msg(), [])
        self.assertIs(other.send_msg(payload), True)
        self.assertEqual(self.received(one), [payload])
        self.assertEqual(one.recv_msg(clear=True), [])
        text = self.refusal("too_long", one.send_msg, b"x" * 20000)
        self.assertIn("at most 16384", text)

    def test_a_script_that_only_sends_is_told_nothing(self):
        one, other = self.wrap(0), self.wrap(1)
        one.send_msg(b"x")
        self.run_until(other.swarm, lambda: other._subscriber._waiting)
        other.delay(-5)
        other.swarm.close()
        self.assertEqual(self.told.getvalue(), "")

    def test_messages_that_are_dropped_in_a_tight_loop_are_counted_and_told(self):
        robot = self.wrap(0)
        deadline = time.time() + PATIENCE_S
        while not robot.dropped:
            self.assertTrue(time.time() < deadline, "nothing is dropped")
            for _ in range(500):
                robot.send_msg(b"x" * 1000)  # False where the daemon is too slow to take it
        self.assertIn("send_msg():", self.told.getvalue())
        self.assertIn("robot.delay(50)", self.told.getvalue())

    def test_poses_are_passed_on_by_themselves(self):
        own = Coachbot()
        robot, watcher = self.wrap(0, own), self.client(0)
        own.poses.append((1.0, 2.0, 0.25))
        robot.send_msg("x")
        robot.swarm.sync()
        self.assertEqual(tuple(watcher.get_pose())[:3], (1.0, 2.0, 0.25))
        self.assertEqual(robot.get_pose(), (1.0, 2.0, 0.25))
        self.assertEqual(robot.get_pose(), (1.0, 2.0, 0.25))  # and again
        own.poses.append((99.0, 2.0, 0.25))
        self.assertEqual(robot.get_pose(), (99.0, 2.0, 0.25))
        self.assertIn("is not passed on", self.told.getvalue())

    def test_what_the_coachbot_can_do_it_still_does(self):
        own = Coachbot()
        robot = self.wrap(0, own)
        robot.set_vel(10, -10)
        robot.delay(100)
        self.assertEqual(own.calls, [("set_vel", 10, -10), ("delay", 100)])
        self.assertEqual(robot.get_clock(), 1.5)
        self.assertEqual((robot.virtual_id(), robot.virtual_id), (42, 42))
        self.assertEqual(robot.id, 1)  # of the daemon: this coach-os tells none
        self.assertIsNone(robot.get_pose())

    def test_messages_from_far_away_can_be_left_out(self):
        near, far = self.wrap(0, None, within=1.0), self.wrap(1)
        near.swarm.set_fixed_pose(0, 0, 0)
        near.swarm.sync()
        for x in (3, 0.5):
            far.swarm.set_fixed_pose(x, 0, 0)
            far.swarm.sync()
            far.send_msg("%g" % x)
            far.delay(50)
        self.assertEqual(self.received(near), [b"0.5"])
        far.send_msg("again")
        deadline = time.time() + PATIENCE_S
        messages = []
        while not messages and time.time() < deadline:
            messages = near.recv()
        self.assertEqual((messages[0].data, messages[0].sender), (b"again", 2))
        self.assertAlmostEqual(messages[0].distance, 0.5, 2)

    def test_without_a_coachbot_it_stands_in(self):
        robot = self.wrap(1)
        self.assertTrue(robot.get_clock() < PATIENCE_S)
        self.assertEqual((robot.virtual_id(), robot.id), (2, 2))
        robot.set_vel(1, 2)
        robot.set_vel(1, 2)
        self.assertEqual(len(self.told.getvalue().splitlines()), 1)
        with self.assertRaises(AttributeError) as caught:
            robot.fly()
        self.assertIn("no 'fly'", str(caught.exception))
        robot.swarm.set_fixed_pose(1, 0.5, 0.25)
        self.assertEqual(robot.get_pose_blocking(), (1, 0.5, 0.25))
