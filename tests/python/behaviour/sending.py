"""What becomes of what is sent."""
import time

from case import PATIENCE_S, Case


class Sending(Case):
    def test_two_sends_in_a_row_both_arrive(self):
        subscriber = self.client(1).subscribe("two")
        publisher = self.client(0).advertise("two")
        publisher.send("a")
        publisher.send("b")
        self.assertEqual([subscriber.get(PATIENCE_S).data for _ in range(2)], [b"a", b"b"])
        self.assertEqual(self.told.getvalue(), "")

    def test_without_a_queue_the_second_says_why_on_stderr_once(self):
        publisher = self.client(0).advertise("two", queue=0, repeat=10, repeat_interval=1)
        publisher.send("a")
        for _ in range(100):
            publisher.send("b")
        lines = self.told.getvalue().splitlines()
        self.assertEqual(len(lines), 1, lines)
        for words in ("swarmtalk: channel two:", "not sent", "queue", "drop_oldest=True"):
            self.assertIn(words, lines[0])

    def test_a_program_that_only_sends_and_sleeps_is_heard(self):
        subscriber = self.client(1).subscribe("s", keep_last=100)
        publisher = self.client(0).advertise("s")
        for number in range(60):
            publisher.send("%d" % number)
            time.sleep(0.005)
        self.assertEqual([subscriber.get(PATIENCE_S).text for _ in range(60)],
                         ["%d" % number for number in range(60)])
        self.assertEqual(self.told.getvalue(), "")

    def test_the_daemon_counts_refusals_by_program_and_channel(self):
        robot, watcher = self.client(0, "refused"), self.client(0, "watcher")

        def counted():
            status = watcher.status()
            program = [each for each in status.programs if each.name == "refused"]
            channel = [each for each in status.channels if each.name == "counted"]
            return [sum(each.refused for each in found) for found in (program, channel)]
        publisher = robot.advertise("counted", queue=0)
        refused = sum(not publisher.send("x" * 16000) for _ in range(50))
        self.assertTrue(refused > 1)
        self.assertTrue(counted()[0] >= 1, "a program that never runs is counted, too")
        robot.process()
        self.run_until(watcher, lambda: counted() == [refused, refused])

    def test_who_looks_at_the_refusal_is_not_told(self):
        publisher = self.client(0).advertise("two", queue=0, repeat=10, repeat_interval=1)
        self.assertTrue(publisher.send("a"))
        self.assertTrue(publisher.busy())
        second = publisher.send("b")
        self.assertFalse(second)
        self.assertEqual(second.code, "busy")
        del second
        self.assertEqual(self.told.getvalue(), "")

    def test_drop_oldest_tells_of_what_was_dropped(self):
        robot, ends = self.client(0), []
        publisher = robot.advertise("n", queue=2, drop_oldest=True, repeat=3, repeat_interval=0.05,
                                    sent=lambda error: ends.append(error and error.code))
        for number in range(6):
            self.assertTrue(publisher.send("%d" % number))
        self.run_until(robot, lambda: len(ends) == 6)
        self.assertEqual(sorted(ends, key=str), [None] * 3 + ["dropped"] * 3)

    def test_mistakes_raise_a_sentence(self):
        robot = self.client(0)
        publisher = robot.advertise("m")
        self.assertEqual(self.refusal("too_long", publisher.send, b"x" * 16385),
                         "the message has 16385 bytes; channel m carries at most 16384")
        self.assertIn("TTL of 300", self.refusal("bad_ttl", publisher.send, "x", ttl=300))
        self.assertIn("0 to 65535", self.refusal("bad_channel", robot.subscribe, 70000))
        self.assertIn("not UTF-8", self.refusal("bad_channel", robot.subscribe, b"\xff\xfe"))
        self.assertIn("not None", self.refusal("bad_channel", robot.subscribe, None))
        self.assertIn("0 metres", self.refusal("bad_argument", robot.subscribe, "m", within=-1))
        self.assertIn("1 or more", self.refusal("bad_argument", robot.subscribe, "m", keep_last=0))
        self.assertIn("32.767", self.refusal("bad_pose", robot.set_pose, 40, 0, 0))
        self.assertIn("finite", self.refusal("bad_pose", robot.set_pose, float("nan"), 0, 0))
        self.assertIn("three numbers", self.refusal("bad_pose", robot.set_pose, "a", 0, 0))
        self.assertIn("function", self.refusal("bad_argument", robot.subscribe, "m", 3))
        self.assertIn("queue", self.refusal("bad_argument", robot.advertise, "m", queue=-1))
        with self.assertRaises(TypeError) as caught:
            publisher.send(42)
        self.assertIn("bytes or text, not int", str(caught.exception))
        with self.assertRaises(ValueError):  # a BadArgument is one
            publisher.send(b"x" * 20000)
        self.assertTrue(publisher.send("all is well"))

    def test_what_the_daemon_refuses_raises_too(self):
        robot = self.client(0)
        text = self.refusal("bad_channel", robot.advertise, "debug")
        self.assertIn("debug", text)
        self.assertIn("[reserved]", text)
        keep = robot.advertise("t", timestamped=True)
        self.refusal("channel_conflict", robot.advertise, "t", timestamped=False)
        self.assertTrue(keep.send("x"))

    def test_a_closed_publisher_answers(self):
        with self.client(0).advertise("c") as publisher:
            pass
        self.assertEqual(publisher.send("x").code, "disconnected")
