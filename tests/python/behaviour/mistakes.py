"""Mistakes of programs, told where they are made."""
from __future__ import print_function

import functools

from case import Case, swarmtalk


class Mistakes(Case):
    def test_text_is_no_number(self):
        robot = self.client(0)
        for call, arguments, options in (
                (robot.subscribe, ("m",), {"within": "3"}),
                (robot.subscribe, ("m",), {"no_older_than": "1"}),
                (robot.subscribe, ("m",), {"keep_last": "3"}),
                (robot.advertise, ("m",), {"queue": "3"}), (robot.run, ("3",), {}),
                (robot.subscribe("m").get, ("3",), {}), (robot.run_once, (b"3",), {})):
            self.assertIn("3" if not options.get("no_older_than") else "1",
                          self.refusal("bad_argument", call, *arguments, **options))
        self.assertIn("three numbers, not '1'; make a number of the text with float()",
                      self.refusal("bad_pose", robot.set_pose, "1", 0, 0))

    def test_a_callback_that_does_not_take_one_argument_is_refused_at_once(self):
        robot = self.client(0)

        def show():
            pass

        def compare(one, other):
            pass
        for wrong in (show, compare, lambda: None, lambda a, b: None):
            self.assertIn("one argument, the message",
                          self.refusal("bad_argument", robot.subscribe, "m", wrong))
        self.assertIn("the error", self.refusal("bad_argument", robot.advertise, "m", sent=show))
        harvested = []
        for good in (harvested.append, lambda m, more=1: None, lambda *all: None, print,
                     functools.partial(compare, 1)):
            robot.subscribe("m", good).close()
        self.assertIn("one argument", self.refusal("bad_argument", robot.subscribe, "m", self.id))

    def test_a_misspelt_option_names_the_nearest(self):
        robot = self.client(0)
        with self.assertRaises(TypeError) as caught:
            robot.subscribe("m", wihtin=2)
        self.assertIn("has no option 'wihtin'; did you mean 'within'?", str(caught.exception))
        with self.assertRaises(TypeError) as caught:
            robot.advertise("m", zzzzzz=2)
        self.assertIn("it has channel, ttl", str(caught.exception))

    def test_a_robot_that_is_alone_is_told_so_at_the_end(self):
        robot, other = self.client(0), self.client(1)
        for client in (robot, other):
            client.subscribe("alone", lambda message: None)
            client.process()
            client._first_run_at -= swarmtalk._RUN_WITHIN_S
        robot.advertise("alone").send("x")
        self.run_until(other, lambda: other._has_heard)
        other.advertise("alone")
        other.close()
        self.assertEqual(self.told.getvalue(), "")
        robot.close()
        self.assertIn("nothing was heard on channel alone: a program does not hear itself",
                      self.told.getvalue())

    def test_handles_that_pile_up_are_told_once(self):
        robot = self.client(0)
        for _ in range(12):
            robot.subscribe("loop")
        self.assertEqual(self.told.getvalue().count("subscribe() was called 10 times"), 1)
        for _ in range(12):
            robot.advertise("loop").close()
        self.assertNotIn("advertise()", self.told.getvalue())

    def test_a_pose_in_degrees_is_told_once(self):
        robot = self.client(0)
        robot.set_pose(0, 0, 6.28)
        self.assertEqual(self.told.getvalue(), "")
        for _ in range(3):
            robot.set_pose(0, 0, 90)
        self.assertEqual(self.told.getvalue().count("math.radians(90)"), 1)

    def test_a_program_that_sends_and_does_not_run_is_told_early_and_once(self):
        robot = self.client(0)
        robot.subscribe("quiet", lambda message: None)
        publisher = robot.advertise("m", queue=1, drop_oldest=True)
        publisher.send("x")
        self.assertEqual(self.told.getvalue(), "")
        robot._subscribed_at -= swarmtalk._RUN_WITHIN_S
        for _ in range(3):
            publisher.send("x")
        robot.close()
        self.assertEqual(self.told.getvalue().count("run() was not called since"), 1)
        self.assertEqual(self.told.getvalue().count("\n"), 1)
