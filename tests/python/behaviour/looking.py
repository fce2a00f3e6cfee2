"""What a program can ask of the daemon, and the reserved channels."""
import time

from case import PATIENCE_S, Case, swarmtalk


class Looking(Case):
    configuration = "[reserved]\ndebug = true\nharvest = true\n"

    def test_pose_neighbours_and_status(self):
        robot, other = self.client(0), self.client(1)
        self.assertIsNone(robot.get_pose())
        robot.set_fixed_pose(1, 1, 0)
        robot.sync()
        other.set_fixed_pose(1, 3, 1.5)
        other.sync()
        self.assertEqual(tuple(robot.get_pose())[:3], (1, 1, 0))
        other.advertise("n").send("x")
        deadline = time.time() + PATIENCE_S
        found = robot.neighbours()
        # An earlier frame of it may have been heard, from before it knew where it is.
        while not (found and found[0].pose) and time.time() < deadline:
            time.sleep(0.02)
            found = robot.neighbours()
        neighbour = found[0]
        self.assertEqual((neighbour.node_id, neighbour.link), (2, "test"))
        self.assertAlmostEqual(neighbour.distance, 2.0, 2)
        self.assertAlmostEqual(neighbour.pose.theta, 1.5, 2)
        self.assertFalse(neighbour.duplicate_id)
        status = robot.status()
        self.assertEqual((status.node_id, status.links[0].name), (1, "test"))
        self.assertTrue(status.links[0].up)
        self.assertEqual(robot.node_id, 1)
        self.assertTrue(robot.daemon_name.startswith("swarmtalkd"))

    def test_log_is_heard_on_channel_debug(self):
        subscriber = self.client(1).subscribe("debug")
        self.client(0).log("lost the line")
        self.assertEqual(subscriber.get(PATIENCE_S).text, "lost the line")

    def test_harvest_asks_and_answers(self):
        robot, other, found = self.client(0), self.client(1), []
        mine, its = swarmtalk.Harvest(robot), swarmtalk.Harvest(other)
        its.set("battery", "3.91")
        its.set("bat", b"\x00\x01")
        its.set("other", "no")
        its.set("batgone", "no")
        its.remove("batgone")
        deadline = time.time() + PATIENCE_S
        while len(found) < 2 and time.time() < deadline:
            mine.ask("bat", found.append)
            other.run(0.1)
            robot.run(0.1)
        self.assertEqual([(v.node_id, v.key, v.data) for v in found[:2]],
                         [(2, "bat", b"\x00\x01"), (2, "battery", b"3.91")])
        self.assertEqual(found[1].value, "3.91")
        self.assertIn("1 to 64", self.refusal("bad_argument", mine.set, "", "x"))
        self.assertIn("512", self.refusal("bad_argument", mine.set, "k", "x" * 513))
