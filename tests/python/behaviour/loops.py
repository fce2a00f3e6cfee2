"""Callbacks, loops, threads and processes."""
import os
import select
import threading
import time

from case import PATIENCE_S, Case, swarmtalk


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

    def test_each_call_of_another_thread_is_refused_while_the_owner_runs(self):
        robot, refused, wrong = self.client(0), [], []
        publisher, subscriber = robot.advertise("calls"), robot.subscribe("calls")
        calls = [robot.connect, robot.process, robot.run, robot.run_once, robot.sync, robot.close,
                 robot.get_pose, robot.neighbours, robot.status, publisher.close, subscriber.close,
                 subscriber.take, subscriber.get, lambda: next(iter(subscriber)), robot.attach,
                 lambda: robot.advertise("x"), lambda: robot.subscribe("x"),
                 lambda: robot.set_pose(0, 0, 0), lambda: robot.set_fixed_pose(0, 0, 0),
                 lambda: robot.log("x"), lambda: swarmtalk.Harvest(robot)]

        def other():
            for call in calls:
                try:
                    call()
                    wrong.append(call)
                except swarmtalk.BadArgument as error:
                    refused.append(error.text)
            self.assertTrue(publisher.send("x"))
            publisher.busy()
            robot.stop()
        thread = threading.Timer(0, other)
        inside = threading.Event()
        robot.subscribe("begin", lambda message: inside.set())
        self.client(1).advertise("begin").send("x")
        self.run_until(robot, inside.is_set)
        with robot._owner:  # as run() holds it
            thread.start()
            thread.join(PATIENCE_S)
        self.assertEqual(wrong, [])
        self.assertEqual(len(refused), len(calls))
        for text in refused:
            self.assertIn("only send(), busy() and stop() may be called meanwhile", text)

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
