"""A test with real daemons, and what tests of the Python client have in common."""
import io
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import daemons  # noqa: E402

sys.path.insert(0, daemons.CLIENT)
import swarmtalk  # noqa: E402

PATIENCE_S = 60.0


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
