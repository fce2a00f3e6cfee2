"""Fixtures of the tests with Kilobots behind a daemon."""
from table import stack  # noqa: F401  (a fixture)
