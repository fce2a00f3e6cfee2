"""The kind of each test: `logic`, `clock` or `field` (CONTRIBUTING.md says what each is).

A folder has one, in its CMakeLists.txt; a file (`pytestmark`), a function or one of its parameters
may be marked with another. cmake's function swarmtalk_pytest loads this plugin while it collects,
with the folder's kind in SWARMTALK_KIND, and reads "KIND: TEST" for each test. Where a test of kind
`logic`, or `clock`, does what such a test may not, "not KIND: TEST: WHY" is printed as well;
tools/check refuses that.
"""
import ast
import inspect
import os
import pathlib
import re
import textwrap
import types

KINDS = ("logic", "clock", "field")
# What judges time, or makes several programs run at the same time. Waiting for an event is neither:
# commands.wait_for does that.
CALLS = re.compile(r"\b(time\.sleep|sleep|(?:time\.)?monotonic|perf_counter|Daemons?|Lab"
                   r"|Namespaces?|Player|Tmux|View|Wires?)\(")
WORDS = {"netns", "mmdebstrap"}
HERE = pathlib.Path(__file__).resolve().parent


def kind_of(item):
    """The mark nearest to the test: of its parameters, its function, its file, its folder."""
    own = getattr(getattr(item, "callspec", None), "marks", [])
    for mark in [*own, *item.iter_markers()]:
        if mark.name in KINDS:
            return mark.name
    return os.environ["SWARMTALK_KIND"]


def is_ours(thing):
    """Whether it is a function or class of the tests, other than what waits for events."""
    try:
        path = pathlib.Path(inspect.getfile(thing)).resolve()
    except TypeError:
        return False
    return HERE.parent in path.parents and path != HERE / "commands.py"


def used_by(item):
    """The test's function, its fixtures, and the functions of ours that these call."""
    definitions = item._fixtureinfo.name2fixturedefs  # pylint: disable=protected-access
    left = [item.function, *(each[-1].func for each in definitions.values())]
    found = {}
    while left:
        thing = inspect.unwrap(left.pop())
        if not isinstance(thing, types.FunctionType) or id(thing) in found or not is_ours(thing):
            continue
        found[id(thing)] = thing
        left += [thing.__globals__.get(name) for name in thing.__code__.co_names]
    return found.values()


def forbidden(item, kind):
    """What keeps a test from being of this kind; nothing if it may be."""
    values = getattr(getattr(item, "callspec", None), "params", {}).values()
    if kind != "field" and any(value == "python2.7" for value in values):
        return "a Python 2.7 may have to be fetched"
    if kind != "logic":
        return None
    for function in used_by(item):
        text = textwrap.dedent(inspect.getsource(function))
        called = CALLS.search(text)
        if called:
            return f"{function.__name__} calls {called[1]}()"
        words = {node.value for node in ast.walk(ast.parse(text))
                 if isinstance(node, ast.Constant) and isinstance(node.value, str)}
        for word in sorted(WORDS & words):
            return f"{function.__name__} says '{word}'"
    return None


def pytest_collection_finish(session):
    for item in session.items:
        kind = kind_of(item)
        print(f"{kind}: {item.nodeid}")
        why = forbidden(item, kind)
        if why:
            print(f"not {kind}: {item.nodeid}: {why}")
