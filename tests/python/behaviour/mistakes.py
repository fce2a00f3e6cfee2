"""Mistakes of programs, told where they are made."""
from __future__ import print_function

import functools

from case import Case, daemons, swarmtalk


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

    def test_who_only_listens_is_told_once_when_nobody_is_around(self):
        robot, quiet = self.client(0), swarmtalk._QUIET_S
        try:
            swarmtalk._QUIET_S = 0.05
            robot.subscribe("alone", lambda message: None)
            with daemons.Daemons(1) as lonely:
                listener = swarmtalk.Client("listener", lonely[0].socket)
                listener.subscribe("silence")
                self.run_until(listener, self.told.getvalue)
                listener.run(0.2)
                listener.close()
        finally:
            swarmtalk._QUIET_S = quiet
        self.assertEqual(self.told.getvalue().count("\n"), 1)
        self.assertIn("nothing was heard on channel silence: no other robot is around, and a "
                      "program does not hear itself", self.told.getvalue())

    def test_who_misspells_a_channel_is_told_the_one_that_there_is(self):
        robot, quiet = self.client(0), swarmtalk._QUIET_S
        self.client(0, "other").advertise("chatter")
        self.client(1).advertise("elsewhere").send("x")
        self.run_until(robot, robot.neighbours)
        try:
            swarmtalk._QUIET_S = 0.05
            robot.subscribe("chatter_2")
            robot.subscribe("chater")
            self.run_until(robot, self.told.getvalue)
            robot.run(0.2)
        finally:
            swarmtalk._QUIET_S = quiet
        self.assertEqual(self.told.getvalue(),
                         "swarmtalk: nothing was heard on channel chater: nobody publishes it as "
                         "far as this robot knows; did you mean 'chatter'?\n")

    def test_who_only_listens_is_not_told_where_robots_are_around(self):
        robot, other, quiet = self.client(0), self.client(1), swarmtalk._QUIET_S
        other.advertise("elsewhere").send("x")
        self.run_until(robot, robot.neighbours)
        asked, ask = [], robot._look_around
        object.__setattr__(robot, "_look_around", lambda: (asked.append(1), ask()))
        try:
            swarmtalk._QUIET_S = 0.05
            robot.subscribe("silence")
            self.run_until(robot, lambda: asked)
            robot.sync()
        finally:
            swarmtalk._QUIET_S = quiet
        self.assertEqual(self.told.getvalue(), "")

    def test_a_wildcard_is_told(self):
        robot = self.client(0)
        robot.subscribe("#")
        robot.subscribe("robots/+")
        self.assertEqual(self.told.getvalue().count("\n"), 1)
        self.assertIn("'#' is the name of one channel: there are no wildcards",
                      self.told.getvalue())

    def test_digits_in_quotes_are_told_to_be_a_name(self):
        robot = self.client(0)
        robot.advertise(5)
        robot.subscribe("five")
        self.assertEqual(self.told.getvalue(), "")
        for _ in range(2):
            robot.subscribe("5")
        self.assertEqual(self.told.getvalue(), "swarmtalk: channel \"5\" is a name here, and not "
                         "channel number 5; for the number leave out the quotes\n")

    def test_messages_that_are_never_fetched_are_told(self):
        robot, other = self.client(0), self.client(1)
        never, looked = robot.subscribe("fetch"), robot.subscribe("fetch")
        other.advertise("fetch").send("x")
        self.run_until(robot, lambda: looked._waiting and never._waiting)
        looked.take()
        robot.close()
        self.assertEqual(self.told.getvalue().count("channel fetch was subscribed to without a "
                                                    "function"), 1)

    def test_arguments_that_make_no_sense_have_their_sentence(self):
        robot, path = self.client(0), self.daemons[0].socket
        publisher = robot.advertise("m")
        for wanted, call, arguments, options in (
                ("ttl must be 0 or more, not -1", robot.advertise, ("m",), {"ttl": -1}),
                ("ttl must be 0 or more, not -1", publisher.send, ("x", -1), {}),
                ('redundancy must be 0 to 12, or "auto", not \'aut\'', robot.advertise, ("m",),
                 {"redundancy": "aut"}),
                ("seconds must be 0 seconds or more, or None, not -1", robot.run, (-1,), {}),
                ("seconds must be 0 seconds or more, or None, not nan", robot.run,
                 (float("nan"),), {}),
                ("timeout must be 0 seconds or more", robot.run_once, (-1,), {}),
                ("timeout must be 0 seconds or more", robot.subscribe("m").get, (-1,), {}),
                ("must not be empty", swarmtalk.Client, ("", path), {}),
                ("drop_oldest must be True or False, not 'no'", robot.advertise, ("m",),
                 {"drop_oldest": "no"}),
                ("timestamped must be True or False", robot.subscribe, ("m",),
                 {"timestamped": "no"}),
                ("connect must be True or False", swarmtalk.Client, ("x", path, "no"), {}),
                ("swarmtalk.Harvest(robot)", swarmtalk.Harvest, ("robot",), {}),
                ("socket_path is the path of the daemon's socket, as text, not 5",
                 swarmtalk.Client, ("x", 5), {})):
            self.assertIn(wanted, self.refusal("bad_argument", call, *arguments, **options))
        with self.assertRaises(TypeError) as caught:
            publisher.send(5)
        self.assertIn("a message is bytes or text, not int", str(caught.exception))

    def test_attributes_that_do_not_exist_name_what_does(self):
        robot = self.client(0)
        publisher, subscriber = robot.advertise("m"), robot.subscribe("m")
        for thing, name, wanted in (
                (robot, "on_mesage", "the function that subscribe(channel, function) gets"),
                (robot, "on_eror", "a Client has no 'on_eror'; did you mean 'on_error'?"),
                (robot, "conect_timeout", "did you mean 'connect_timeout'?"),
                (publisher, "ttl", "ttl is chosen in advertise(..., ttl=...), and stays"),
                (subscriber, "within", "within is chosen in subscribe(..., within=...)"),
                (subscriber, "on_message", "no attribute 'on_message'")):
            with self.assertRaises(AttributeError) as caught:
                setattr(thing, name, lambda: None)
            self.assertIn(wanted, str(caught.exception))
        for name, wanted in (("send", "a publisher sends: hello = robot.advertise"),
                             ("neighbors", "did you mean 'neighbours'?"), ("zzz", "python.md")):
            with self.assertRaises(AttributeError) as caught:
                getattr(robot, name)
            self.assertIn(wanted, str(caught.exception))
        with self.assertRaises(AttributeError) as caught:
            swarmtalk.Message([]).distance_m
        self.assertIn("did you mean 'distance'?", str(caught.exception))
        with self.assertRaises(AttributeError) as caught:
            robot.status().node
        self.assertIn("a Record has no 'node'; did you mean 'node_id'?", str(caught.exception))
        self.assertNotIn("_owned", repr(robot.neighbours))
        robot.state = "a program may keep values of its own here"
        robot.on_gap = robot.on_reconnect = None
        for name, wrong in (("on_error", 5), ("on_disconnect", lambda: None),
                            ("on_reconnect", 5), ("request_timeout", "1")):
            self.assertIn(name, self.refusal("bad_argument", setattr, robot, name, wrong))

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
        self.assertIn("the heading of a pose is in radians; 90 is more", self.told.getvalue())

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
