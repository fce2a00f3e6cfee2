"""What is sent is heard, with what is known of it."""

from case import PATIENCE_S, Case


class Messages(Case):
    def test_every_length_arrives_exactly_as_sent(self):
        heard, robot = [], self.client(0)
        listener = self.client(1)
        listener.subscribe("length", heard.append)
        publisher = robot.advertise("length")
        sizes = [0, 1, 127, 128, 200, 1400, 16383, publisher.max_message_bytes]
        pattern = bytes(bytearray(range(256))) * 64
        for size in sizes:
            self.assertTrue(publisher.send(pattern[:size]))
        self.run_until(listener, lambda: len(heard) == len(sizes))
        self.assertEqual([m.data for m in heard], [pattern[:size] for size in sizes])
        self.assertEqual([m.sender for m in heard], [1] * len(sizes))
        self.assertEqual([m.message_number for m in heard], list(range(1, len(sizes) + 1)))
        self.assertEqual(heard[0].channel, publisher.channel_number)
        self.assertFalse(heard[0].local)
        self.assertEqual(heard[0].hops, 0)
        self.assertFalse(heard[0].lost_before)
        self.assertTrue(0 <= heard[0].age < PATIENCE_S)

    def test_text_is_sent_as_utf8(self):
        listener = self.client(1)
        subscriber = listener.subscribe(u"gr\u00fc\u00df", keep_last=5)
        self.client(0).advertise(u"gr\u00fc\u00df").send(u"\u00fc\u20ac")
        message = subscriber.get(PATIENCE_S)
        self.assertEqual(message.text, u"\u00fc\u20ac")
        self.assertEqual(message.data, u"\u00fc\u20ac".encode("utf-8"))

    def test_the_channel_may_be_a_number(self):
        subscriber = self.client(1).subscribe(7)
        self.client(0).advertise(7).send(bytearray(b"seven"))
        self.assertEqual(subscriber.get(PATIENCE_S).data, b"seven")
        self.assertEqual(subscriber.channel_number, 7)

    def test_distance_and_bearing_come_from_both_poses_and_are_else_unknown(self):
        robot, listener = self.client(0), self.client(1)
        subscriber = listener.subscribe("where")
        publisher = robot.advertise("where")
        publisher.send("nowhere")
        message = subscriber.get(PATIENCE_S)
        self.assertFalse(message.has_distance or message.has_bearing)
        self.assertFalse(message.distance < 0.5 or message.distance >= 0.5)
        self.assertIsNone(message.sender_pose)
        robot.set_pose(1.0, 2.0, 0.5)
        listener.set_pose(1.0, 1.0, 0.0)
        robot.sync()
        listener.sync()
        publisher.send("here")
        message = subscriber.get(PATIENCE_S)
        self.assertAlmostEqual(message.distance, 1.0, 2)
        self.assertAlmostEqual(message.bearing, 1.571, 2)
        self.assertAlmostEqual(message.sender_pose.y, 2.0, 3)
        self.assertAlmostEqual(message.sender_pose.theta, 0.5, 2)

    def test_another_program_of_the_same_robot_is_heard_as_local(self):
        subscriber = self.client(0).subscribe("c")
        self.client(0).advertise("c").send("x")
        message = subscriber.get(PATIENCE_S)
        self.assertTrue(message.local)
        self.assertEqual(message.distance, 0)

    def test_a_repeated_message_is_heard_once(self):
        subscriber = self.client(1).subscribe("alarm")
        sent, robot = [], self.client(0)
        publisher = robot.advertise("alarm", repeat=3, repeat_interval=0.01, sent=sent.append)
        publisher.send("fire")
        publisher.send("out")
        self.run_until(robot, lambda: len(sent) == 2)
        self.assertEqual(subscriber.get(PATIENCE_S).data, b"fire")
        self.assertEqual(subscriber.get(PATIENCE_S).data, b"out")
        self.assertEqual(sent, [None, None])
        self.assertIsNone(subscriber.get(0.1))

    def test_a_timestamped_channel_tells_the_delay(self):
        subscriber = self.client(1).subscribe("timed", timestamped=True)
        self.client(0).advertise("timed", timestamped=True).send("x")
        message = subscriber.get(PATIENCE_S)
        self.assertTrue(0 <= message.delay < PATIENCE_S)
        self.assertTrue(message.age >= message.delay)

    def test_what_this_program_loses_is_told_and_counted(self):
        heard, gaps = [], []
        listener, robot = self.client(1, "slow"), self.client(0)
        listener.on_gap = gaps.append
        listener.subscribe("burst", heard.append, keep_last=2)
        publisher = robot.advertise("burst", sent=True)
        for number in range(10):
            publisher.send("%d" % number)
        self.run_until(robot, lambda: not publisher._in_flight)
        self.run_until(listener, lambda: heard and heard[-1].data == b"9")
        lost = sum(m.lost_before.total for m in heard)
        self.assertEqual(len(heard) + lost, 10)
        self.assertEqual(gaps, [m for m in heard if m.lost_before])
        counted = [program for program in listener.status().programs if program.name == "slow"][0]
        self.assertEqual(counted.lost_daemon + counted.lost_client, lost)
