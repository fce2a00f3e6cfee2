"""Daemons that come and go, and what is not one."""
import errno
import os
import select
import socket
import struct
import threading
import time

from case import PATIENCE_S, Case, swarmtalk


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

    def test_a_loss_that_the_program_was_not_told_of_is_told_at_its_end(self):
        robot = self.client(0)
        publisher = robot.advertise("rest")
        self.assertTrue(publisher.send("x"))
        self.daemons[0].kill()
        with self.assertRaises(swarmtalk.Error):
            robot.neighbours()  # it notices, and runs no callback
        robot.close()
        lines = [line for line in self.told.getvalue().splitlines() if "this program ended" in line]
        self.assertEqual(len(lines), 1, self.told.getvalue())
        self.assertIn("was gone when", lines[0])
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
        for path, code in ((folder + "/nothing", "no_daemon"), (plain, "no_daemon"),
                           (dead, "daemon_dead"), ("/" + "x" * 200, "bad_argument")):
            text = self.refusal(code, swarmtalk.Client, "x", path)
            self.assertIn(path, text)
        self.assertIn("name", self.refusal("bad_argument", swarmtalk.Client, 7))

    def test_who_may_not_connect_is_told_what_helps(self):
        path = os.path.join(self.daemons.folder, "open.sock")
        socket.socket(socket.AF_UNIX).bind(path)
        text = swarmtalk._connect_error(errno.EACCES, path).text
        self.assertIn("something else confines the program", text)
        text = swarmtalk._connect_error(errno.EACCES, swarmtalk.DEFAULT_SOCKET + "?").text
        self.assertIn("its folder is closed to this user", text)


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
