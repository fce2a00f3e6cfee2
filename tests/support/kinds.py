"""The kind of each test: `logic`, `clock` or `field` (CONTRIBUTING.md says what each is).

A folder has one, in its CMakeLists.txt; a file (`pytestmark`), a function or one of its parameters
may be marked with another. ctest runs a file once for each kind that it has, with this plugin of
pytest's, which takes the tests of that kind alone (swarmtalk_pytest of cmake sets the environment):

    SWARMTALK_PREFIX, SWARMTALK_KIND   the first word of the tests' names, and the folder's kind
    SWARMTALK_RUN                      the kind that runs; all do if it is not set
    SWARMTALK_ONLY                     a regular expression: of these, those whose name it finds
    SWARMTALK_BEGUN                    the file in which the name of the test that began last is
                                       kept: that of the culprit, if pytest does not come to its end

    kinds.py run ARGUMENTS...
        runs pytest with this plugin, in a folder for temporary files of its own; the last argument
        is the file of tests
    kinds.py collect PREFIX KIND LIST
        writes "KIND FILE NAME" for each test of the folder in which it is started into LIST; where
        a test does what one of its kind may not, the line "not KIND: NAME: WHY" as well, which
        tools/check refuses
"""
import ast
import collections
import contextlib
import hashlib
import inspect
import io
import os
import pathlib
import re
import subprocess
import sys
import textwrap
import types

import pytest

KINDS = ("logic", "clock", "field")
# What judges time, or makes several programs run at the same time. Waiting for an event is neither:
# commands.wait_for does that.
CALLS = re.compile(r"\b(time\.sleep|sleep|(?:time\.)?monotonic|perf_counter|Daemons?|Lab"
                   r"|Namespaces?|Player|Tmux|View|Wires?)\(")
WORDS = {"netns", "mmdebstrap"}
HERE = pathlib.Path(__file__).resolve().parent


class DaemonsFirst(subprocess.Popen):
    """A Popen that gives daemons, and a lab with those that it starts, the machine before others,
    where that is allowed: what a daemon is judged by is not what ran beside it."""

    def __init__(self, args, *rest, **options):
        super().__init__(args, *rest, **options)
        words = [args] if isinstance(args, (str, os.PathLike)) else args
        names = {pathlib.PurePath(str(word)).name for word in words}
        if "swarmtalkd" in names or {"swarmtalk-lab", "up"} <= names:
            with contextlib.suppress(OSError):
                os.sched_setscheduler(self.pid, os.SCHED_RR, os.sched_param(1))


def name_of(nodeid, prefix):
    """The name of a test among all: "python.client.cpp_hears_python" for
    "test_client.py::test_cpp_hears_python"."""
    script, *words = nodeid.split("::")
    words = [pathlib.PurePath(script).stem, *words]
    return ".".join([prefix, *(word.removeprefix("test_") for word in words)])


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
    """The test's function, its fixtures, and the functions and methods of ours that these name."""
    definitions = item._fixtureinfo.name2fixturedefs  # pylint: disable=protected-access
    left = [item.function, *(each[-1].func for each in definitions.values())]
    found, methods, names = {}, {}, {"__init__", "__enter__", "__exit__"}
    while left:
        thing = inspect.unwrap(left.pop())
        if id(thing) in found or not is_ours(thing):
            continue
        found[id(thing)] = thing
        if isinstance(thing, type):
            methods |= {id(part): part for part in vars(thing).values()
                        if isinstance(part, types.FunctionType)}
        elif isinstance(thing, types.FunctionType):
            names |= {*thing.__code__.co_names}
            left += [thing.__globals__.get(name) for name in thing.__code__.co_names]
        left += [part for part in methods.values() if part.__name__ in names]
        methods = {each: part for each, part in methods.items() if part.__name__ not in names}
    return [thing for thing in found.values() if isinstance(thing, types.FunctionType)]


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


def pytest_configure():
    if os.environ.get("SWARMTALK_RUN") == "clock":
        subprocess.Popen = DaemonsFirst


def pytest_collection_modifyitems(config, items):
    run, only = os.environ.get("SWARMTALK_RUN"), os.environ.get("SWARMTALK_ONLY", "")
    if run:
        prefix = os.environ["SWARMTALK_PREFIX"]
        chosen = [item for item in items if kind_of(item) == run
                  and re.search(only, name_of(item.nodeid, prefix))]
        config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
        items[:] = chosen


def pytest_collection_finish(session):
    if "SWARMTALK_LIST" not in os.environ:
        return
    with open(os.environ["SWARMTALK_LIST"], "w", encoding="utf-8") as out:
        for item in session.items:
            if item.path.parent != pathlib.Path.cwd():
                raise pytest.UsageError(f"{item.path}: tests are in the folder itself")
            kind, name = kind_of(item), name_of(item.nodeid, os.environ["SWARMTALK_PREFIX"])
            print(kind, item.path.name, name, file=out)
            why = forbidden(item, kind)
            if why:
                print(f"not {kind}: {name}: {why}", file=out)


def pytest_runtest_logstart(nodeid, location):  # pylint: disable=unused-argument
    begun = os.environ.get("SWARMTALK_BEGUN")
    if begun:
        pathlib.Path(begun).parent.mkdir(parents=True, exist_ok=True)
        pathlib.Path(begun).write_text(name_of(nodeid, os.environ["SWARMTALK_PREFIX"]),
                                       encoding="utf-8")


def pytest_sessionfinish(session, exitstatus):
    """Where none of a file's tests were asked for, that is no failure."""
    if os.environ.get("SWARMTALK_ONLY") and exitstatus == 5:
        session.exitstatus = 0


def collect(prefix, kind, into):
    """Writes the list of this folder's tests, and prints "FILE KIND COUNT" for each kind of a file.

    @return pytest's exit status
    """
    into = pathlib.Path(into)
    into.parent.mkdir(parents=True, exist_ok=True)
    os.environ.update(SWARMTALK_COLLECTING="1", SWARMTALK_PREFIX=prefix, SWARMTALK_KIND=kind,
                      SWARMTALK_LIST=str(into))
    for name in ("SWARMTALK_RUN", "SWARMTALK_ONLY", "SWARMTALK_BEGUN"):
        os.environ.pop(name, None)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        status = pytest.main(["-q", "--collect-only", "-p", "no:cacheprovider", "."],
                             plugins=[sys.modules[__name__]])
    if status != 0:
        print(said.getvalue()[-3000:], file=sys.stderr)
        return status
    counts = collections.Counter(
        " ".join(line.split(" ", 2)[1::-1])
        for line in into.read_text(encoding="utf-8").splitlines() if not line.startswith("not "))
    for each, count in sorted(counts.items()):
        print(each, count)
    return 0


def own_folder(script):
    """What no other file of tests, no other kind and no other checkout has, be it at the same path:
    pytest's common folder is cleared by what runs beside it. A short one, since the path of a Unix
    socket has at most 107 bytes."""
    build = os.stat(os.environ["SWARMTALK_BUILD"])
    words = (build.st_dev, build.st_ino, os.environ["SWARMTALK_PREFIX"],
             os.environ["SWARMTALK_RUN"], script)
    return "/tmp/swarmtalk-test-" + hashlib.sha256(repr(words).encode()).hexdigest()[:8]


def main():
    if sys.argv[1:2] == ["collect"] and len(sys.argv) == 5:
        sys.exit(collect(*sys.argv[2:]))
    if sys.argv[1:2] == ["run"]:
        sys.exit(pytest.main([*sys.argv[2:], "--basetemp", own_folder(sys.argv[-1])],
                             plugins=[sys.modules[__name__]]))
    sys.exit(__doc__)


if __name__ == "__main__":
    main()
