"""What the Python client does, with real daemons. Runs on Python 2.7 and 3, by itself:
python3 tests/python/behaviour [-v] [Loops.test_...]. test_client.py runs it with each Python that
there is."""
import unittest

from connecting import Reconnection, Strangers  # noqa: F401
from looking import Looking  # noqa: F401
from loops import Loops  # noqa: F401
from messages import Messages  # noqa: F401
from mistakes import Mistakes  # noqa: F401
from policies import Policies  # noqa: F401
from scripts import Scripts  # noqa: F401
from sending import Sending  # noqa: F401

if __name__ == "__main__":
    unittest.main()
