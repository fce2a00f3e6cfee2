"""What the Python client does, with real daemons. Runs on Python 2.7 and 3, by itself;
test_client.py runs it with each Python that there is."""
from __future__ import print_function

import io
import os
import select
import socket
import struct
import sys
import threading
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import daemons  # noqa: E402

sys.path.insert(0, daemons.CLIENT)
import swarmtalk  # noqa: E402

PATIENCE_S = 10.0


class Case(unittest.TestCase):
    configuration = ""

    @classmethod
    def setUpClass(cls):
        cls.daemons = daemons.Daemons(2, cls.configuration)

    @classmethod
    def tearDownClass(cls):
        cls.daemons.close()

    def setUp(self):
        self.real_stderr, sys.stderr = sys.stderr, io.StringIO() if sys.version_info[0] > 2 \
            else __import__("StringIO").StringIO()
        self.told = sys.stderr
        self.clients = []

    def tearDown(self):
        for client in self.clients:
            client.close()
        sys.stderr = self.real_stderr

    def client(self, robot=0, name="test", **options):
        client = swarmtalk.Client(name, self.daemons[robot].socket, **options)
        self.clients.append(client)
        return client

    def run_until(self, client, condition):
        deadline = time.time() + PATIENCE_S
        while not condition():
            self.assertTrue(time.time() < deadline, "waited too long")
            client.run_once(0.05)

    def refusal(self, code, call, *arguments, **options):
        """The sentence with which a call is refused."""
        with self.assertRaises(swarmtalk.Error) as caught:
            call(*arguments, **options)
        self.assertEqual(caught.exception.code, code)
        self.assertEqual(str(caught.exception), caught.exception.text)
        return caught.exception.text


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
        self.assertIn("1 to", self.refusal("bad_argument", robot.subscribe, "m", keep_last=0))
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
        text = self.refusal("bad_channel", robot.log, "x")
        self.assertIn("debug", text)
        self.assertIn("[reserved]", text)
        keep = robot.advertise("t", timestamped=True)
        self.refusal("channel_conflict", robot.advertise, "t", timestamped=False)
        self.assertTrue(keep.send("x"))

    def test_a_closed_publisher_answers(self):
        with self.client(0).advertise("c") as publisher:
            pass
        self.assertEqual(publisher.send("x").code, "disconnected")


class Loops(Case):
    def test_iteration_waits_for_each_until_stop(self):
        listener, robot = self.client(1), self.client(0)
        publisher, heard = robot.advertise("i"), []
        subscriber = listener.subscribe("i")
        for word in ("a", "b", "c"):
            publisher.send(word)
        for message in subscriber:
            heard.append(message.text)
            if len(heard) == 3:
                listener.stop()
        self.assertEqual(heard, ["a", "b", "c"])
        self.assertIsNone(subscriber.get(0.05))

    def test_a_callback_that_throws_throws_out_of_run_and_the_rest_is_heard(self):
        listener, robot, heard = self.client(1), self.client(0), []

        def receive(message):
            heard.append(message.data)
            if len(heard) == 1:
                raise KeyError("mine")
        listener.subscribe("t", receive)
        publisher = robot.advertise("t")
        publisher.send("1")
        publisher.send("2")
        with self.assertRaises(KeyError):
            self.run_until(listener, lambda: False)
        self.run_until(listener, lambda: len(heard) == 2)

    def test_a_callback_may_send_and_register_but_not_run(self):
        listener, robot, refused, answers = self.client(1), self.client(0), [], []
        robot_hears = robot.subscribe("answer")

        def receive(message):
            listener.advertise("answer").send(message.data + b"!")
            for call in (listener.run, listener.process, listener.run_once):
                refused.append(self.refusal("bad_argument", call))
            answers.append(True)
        listener.subscribe("ask", receive)
        robot.advertise("ask").send("x")
        self.run_until(listener, lambda: answers)
        self.assertEqual(robot_hears.get(PATIENCE_S).data, b"x!")
        self.assertEqual(len(refused), 3)
        self.assertIn("inside a callback", refused[0])

    def test_an_event_loop_of_ones_own_needs_only_the_descriptor(self):
        listener, heard = self.client(1), []
        listener.subscribe("fd", heard.append)
        robot = self.client(0)
        publisher = robot.advertise("fd")
        for number in range(3):
            publisher.send("%d" % number)
            deadline = time.time() + PATIENCE_S
            while len(heard) == number and time.time() < deadline:
                if select.select([listener], [], [], PATIENCE_S)[0]:
                    listener.process()
        self.assertEqual(len(heard), 3)
        self.run_until(listener, lambda: True)
        self.assertEqual(select.select([listener], [], [], 0)[0], [])

    def test_other_threads_may_send_and_stop_and_no_more(self):
        robot, subscriber = self.client(0), self.client(1).subscribe("thread")
        publisher, refused = robot.advertise("thread", queue=100), []

        def other():
            for _ in range(20):
                publisher.send("x")
            try:
                robot.process()
            except swarmtalk.Error as error:
                refused.append(error.text)
            robot.stop()
        thread = threading.Thread(target=other)
        thread.start()
        robot.run(PATIENCE_S)
        thread.join()
        self.assertEqual(len([subscriber.get(PATIENCE_S) for _ in range(20)]), 20)
        if refused:  # else it was between two runs
            self.assertIn("another thread", refused[0])

    def test_a_child_of_fork_is_told(self):
        robot = self.client(0)
        child = os.fork()
        if child == 0:
            try:
                robot.process()
            except swarmtalk.Error as error:
                os._exit(7 if "fork" in error.text else 1)
            os._exit(2)
        self.assertEqual(os.waitpid(child, 0)[1] >> 8, 7)
        self.assertTrue(robot.process())

    def test_a_program_that_never_runs_its_callbacks_is_told(self):
        robot = self.client(0)
        robot.subscribe("quiet", lambda message: None)
        robot.close()
        self.assertIn("channel quiet was subscribed to", self.told.getvalue())
        self.assertIn("call run()", self.told.getvalue())


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


class Reconnection(Case):
    def test_handles_live_on_when_the_daemon_is_killed_and_started_again(self):
        robot, listener, words, heard = self.client(0), self.client(1), [], []
        robot.on_disconnect = lambda error: words.append(error.code)
        robot.on_reconnect = lambda: words.append("again")
        publisher = robot.advertise("r")
        hears = robot.subscribe("r2", heard.append)
        self.daemons[0].kill()
        self.run_until(robot, lambda: words)
        self.assertEqual(publisher.send("x").code, "disconnected")
        self.refusal("disconnected" if robot._failure is None else robot._failure.code,
                     robot.neighbours)
        self.daemons[0].start()
        # By the descriptor alone, as an event loop of one's own would.
        deadline = time.time() + PATIENCE_S
        while "again" not in words and time.time() < deadline:
            if select.select([robot], [], [], PATIENCE_S)[0]:
                robot.process()
        self.assertEqual(words, ["disconnected", "again"])
        self.assertIsNone(hears.status)
        subscriber = listener.subscribe("r")
        self.assertTrue(publisher.send("back"))
        self.assertEqual(subscriber.get(PATIENCE_S).data, b"back")
        listener.advertise("r2").send("hello")
        self.run_until(robot, lambda: heard)

    def test_a_message_on_its_way_ends_with_an_error_when_the_daemon_goes(self):
        robot, ends = self.client(0), []
        robot.on_disconnect = None
        publisher = robot.advertise("slow", repeat=10, repeat_interval=1, sent=ends.append)
        publisher.send("x")
        self.daemons[0].kill()
        self.run_until(robot, lambda: ends)
        self.assertEqual(ends[0].code, "disconnected")
        self.daemons[0].start()

    def test_a_program_may_start_before_the_daemon(self):
        self.daemons[0].kill()
        heard = []
        robot = self.client(0, connect=False)
        robot.subscribe("early", heard.append)
        robot.run(0.05)
        self.assertIn("cannot reach swarmtalkd", self.told.getvalue())
        self.assertEqual(len(self.told.getvalue().splitlines()), 1)
        self.daemons[0].start()
        self.run_until(robot, lambda: robot.connected)
        self.client(1).advertise("early").send("x")
        self.run_until(robot, lambda: heard)

    def test_each_way_not_to_connect_has_its_sentence(self):
        folder = self.daemons.folder
        plain = os.path.join(folder, "plain")
        open(plain, "w").close()
        dead = os.path.join(folder, "dead.sock")
        socket.socket(socket.AF_UNIX).bind(dead)
        for path, code in ((folder + "/nothing", "no_daemon"), (plain, "bad_argument"),
                           (dead, "daemon_dead"), ("/" + "x" * 200, "bad_argument")):
            text = self.refusal(code, swarmtalk.Client, "x", path)
            self.assertIn(path, text)
        self.assertIn("name", self.refusal("bad_argument", swarmtalk.Client, 7))


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


class Impostor(object):
    """Something that listens where a daemon should."""

    def __init__(self, folder, answer):
        self.path = os.path.join(folder, "impostor.sock")
        if os.path.exists(self.path):
            os.unlink(self.path)
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.bind(self.path)
        self.socket.listen(1)
        self.answer = answer
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self):
        connection, _ = self.socket.accept()
        connection.sendall(self.answer)
        connection.close()
        self.socket.close()


class Strangers(Case):
    def answered(self, code, answer):
        impostor = Impostor(self.daemons.folder, answer)
        text = self.refusal(code, swarmtalk.Client, "x", impostor.path)
        impostor.thread.join()
        return text

    def test_what_is_no_daemon_is_told(self):
        frames = [b"\x00\x00\x00\x00", b"\xff\xff\xff\xff", b"\x02\x00\x00\x00\x12\x7f",
                  b"\x01\x00\x00\x00\x07", b"\x02\x00\x00\x00\x18\x01",
                  b"\x0c\x00\x00\x00\x08" + b"\xff" * 11]
        for frame in frames:
            self.assertIn("not the protocol", self.answered("protocol", frame))

    def test_another_major_is_told_with_both(self):
        hello = b"\x12\x0b\x08\x09\x10\x03\x22\x05other"
        text = self.answered("version_mismatch", struct.pack("<I", len(hello)) + hello)
        self.assertIn("9.3", text)
        self.assertIn("1.2", text)
        self.assertIn("update the older", text)

    def test_a_refusal_on_the_door_is_read_before_the_connection_ends(self):
        refusal = b"\x1a\x08\x08\x07\x12\x04full"
        self.assertEqual(self.answered("limit", struct.pack("<I", len(refusal)) + refusal), "full")


if __name__ == "__main__":
    unittest.main()
