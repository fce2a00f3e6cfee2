"""Why the Python client cannot connect, in words that help, and what it leaves behind then. With a
daemon that is a script and a clock that stands still unless the client waits."""
import errno
import gc
import os
import pathlib
import pwd
import resource
import socket
import stat
import subprocess
import sys
import types

import pytest

import swarmtalk
from daemons import CLIENT
from local_frames import field
from scripted_daemon import FAILURE, GET_POSE, GREETING, HELLO, POSE

pytestmark = pytest.mark.logic


@pytest.fixture(name="socket_of")
def make_socket_of(monkeypatch):
    """Whom a socket that the kernel denies seems to belong to; None: its folder is closed."""
    groups, users = {0: "root", 50: "robots"}, {0: "root", 1000: "ada"}

    def named(names, attribute):
        return lambda number: types.SimpleNamespace(**{attribute: names[number]})

    def refuse(path, uid=0, gid=50, mode=0o660, number=errno.EACCES):
        def look(_):
            if uid is None:
                raise PermissionError(errno.EACCES, "closed")
            return types.SimpleNamespace(st_uid=uid, st_gid=gid, st_mode=stat.S_IFSOCK | mode)
        with monkeypatch.context() as during:
            during.setattr("grp.getgrgid", named(groups, "gr_name"))
            during.setattr(pwd, "getpwuid", named(users, "pw_name"))
            during.setattr(swarmtalk.os, "stat", look)
            return swarmtalk._connect_error(number, path)
    return refuse


@pytest.mark.parametrize("owner, words", [
    ({}, "join group robots: sudo usermod -aG robots $USER, then log in again"),
    ({"uid": 1000}, "join group robots: "), ({"mode": 0o620}, "join group robots: "),
    ({"gid": 0}, "it is for root alone: run the program as root (sudo), or name a group for it"),
    ({"mode": 0o606}, "it is for root alone: run the program as root (sudo), "),
    ({"gid": 51}, "it is for root alone: "),
    ({"uid": 1000, "mode": 0o600}, "it is for ada alone: run the program as ada, or name"),
    ({"uid": 1001, "gid": 0}, "it is for uid 1001 alone: run the program as uid 1001, or"),
    ({"uid": None}, "its folder is closed to this user: run the program as the user who started")])
@pytest.mark.parametrize("number", [errno.EACCES, errno.EPERM])
def test_who_may_not_connect_is_told_who_may(socket_of, owner, words, number):
    error = socket_of("/tmp/s", number=number, **owner)
    assert error.code == "no_permission"
    assert error.text.startswith("no permission for /tmp/s; " + words), error.text


def test_a_program_that_may_connect_and_cannot_is_told_that_something_confines_it(socket_of,
                                                                                  monkeypatch):
    monkeypatch.setattr(swarmtalk.os, "access", lambda path, mode: True)
    error = socket_of("/tmp/s")
    assert error.code == "no_permission"
    assert "; this user may use it, so something else confines the program" in error.text


def test_the_installed_folder_is_open_to_the_group_that_the_package_makes(socket_of):
    error = socket_of(swarmtalk.DEFAULT_SOCKET, uid=None)
    assert error.text.endswith("; join group swarmtalk: sudo usermod -aG swarmtalk $USER, then log "
                               "in again")


def test_beside_a_lab_a_program_is_told_how_to_run_as_its_robot(socket_of, monkeypatch, tmp_path):
    monkeypatch.setenv("SWARMTALK_LAB", "told")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = tmp_path / "swarmtalk-lab/told"
    folder.mkdir(parents=True)
    for is_up in (False, True):
        told = socket_of(swarmtalk.DEFAULT_SOCKET, number=errno.ENOENT).text
        assert told.endswith("; a lab is up, and as its robot 1 a program runs with: swarmtalk-lab "
                             "exec 1 -- PROGRAM") == is_up, told
        (folder / "lab.json").write_text("{}")
    assert "lab" not in socket_of("/tmp/s", number=errno.ENOENT).text
    monkeypatch.delenv("SWARMTALK_LAB")
    assert socket_of(swarmtalk.DEFAULT_SOCKET, number=errno.ENOENT).text.endswith(
        ": swarmtalk-lab --name told exec 1 -- PROGRAM")


def test_the_installed_daemon_is_started_with_systemctl(socket_of, monkeypatch):
    monkeypatch.setenv("SWARMTALK_LAB", "none")
    standard = swarmtalk.DEFAULT_SOCKET
    gone = socket_of(standard, number=errno.ENOENT)
    assert gone.code == "no_daemon" and gone.text.endswith("; start it with: systemctl start "
                                                           "swarmtalkd")
    dead = socket_of(standard, number=errno.ECONNREFUSED)
    assert dead.code == "daemon_dead" and dead.text.endswith("; start it with: systemctl restart "
                                                             "swarmtalkd")
    other = socket_of("/tmp/s", number=errno.ENOMEM)
    assert (other.code, other.text) == ("system",
                                        "cannot connect to /tmp/s: Cannot allocate memory")


def failure(world):
    with pytest.raises(swarmtalk.Error) as raised:
        world.client.connect()
    return raised.value


def test_what_is_at_the_place_of_the_socket_is_told(world):
    path = world.daemon.path
    begin = world.now
    assert failure(world).code == "no_daemon" and "does not exist" in failure(world).text
    path.write_text("")
    assert failure(world).code == "no_daemon" and "is not a socket" in failure(world).text
    world.client._path = str(path / "s")
    assert failure(world).code == "no_daemon" and "does not exist" in failure(world).text
    world.client._path = str(path)
    path.unlink()
    path.mkdir()
    assert failure(world).code == "no_daemon" and "is not a socket" in failure(world).text
    path.rmdir()
    for kind, code in ((socket.SOCK_DGRAM, "no_daemon"), (socket.SOCK_STREAM, "daemon_dead")):
        with socket.socket(socket.AF_UNIX, kind) as left:
            left.bind(str(path))
            error = failure(world)
        path.unlink()
        assert error.code == code
    assert "is there but nobody listens" in error.text
    assert error.text.endswith("start swarmtalkd for that socket")
    assert world.now == begin, "it does not wait for what will not come by itself"
    assert world.told == [], "what connect() raises is told by nothing else"


def test_a_path_that_is_too_long_is_a_mistake_of_the_program(world):
    world.client._path = "/" + "x" * 200
    error = failure(world)
    assert isinstance(error, swarmtalk.BadArgument)
    assert error.text == "socket path too long: /" + "x" * 200
    world.pass_time(1)
    assert world.told == [], "what connect() raises is told by nothing else"


def test_a_socket_that_is_taken_away_while_it_is_looked_at_is_gone(world):
    error = swarmtalk._connect_error(errno.ECONNREFUSED, str(world.daemon.path))
    assert error.code == "no_daemon" and "does not exist" in error.text


@pytest.fixture(name="no_descriptor")
def make_no_descriptor():
    """Descriptors stay, and there are no new ones from now on; called, it gives them back."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    yield lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_program_without_a_descriptor_left_is_told_and_finds_its_daemon_later(
        world, no_descriptor):
    world.pass_time(2, step=0.1)
    ((kind, code, text),) = world.told
    assert (kind, code) == ("error", "system") and "raise the limit" in text
    no_descriptor()
    world.daemon.start()
    world.pass_time(0.5)
    assert world.client.connected and len(world.told) == 1


def test_no_client_is_made_without_descriptors(tmp_path, no_descriptor):
    assert no_descriptor
    with pytest.raises(swarmtalk.Error, match="raise the limit") as raised:
        swarmtalk.Client("x", tmp_path / "s")
    assert raised.value.code == "system"


@pytest.mark.parametrize("patched, words", [
    (["epoll"], "call gevent's patch_all(select=False)"), ([], "does not exist")])
def test_after_gevents_patch_of_select_the_remedy_is_told(tmp_path, patched, words):
    """patch_all() takes names out of the module, as here."""
    program = ("import select, sys\nfor name in %r: delattr(select, name)\n"
               "sys.path.insert(0, %r)\nimport swarmtalk\n"
               "try: swarmtalk.Client('x', %r)\n"
               "except swarmtalk.Error as error: sys.exit(error.text)"
               % (patched, CLIENT, str(tmp_path / "s")))
    done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True,
                          timeout=60)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert words in done.stderr


def test_a_daemon_whose_backlog_is_full_is_waited_for(world):
    world.daemon.start()
    serve, world.daemon.serve = world.daemon.serve, lambda: False
    world.daemon.listening.listen(0)
    others = []
    try:
        with pytest.raises(BlockingIOError):
            while True:
                others.append(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
                others[-1].setblocking(False)
                others[-1].connect(str(world.daemon.path))
        begin = world.now
        error = failure(world)
        assert error.code == "timeout" and "accepts no connections; it is stopped" in error.text
        assert 1.99 < world.now - begin < 2.01
    finally:
        for each in others:
            each.close()
    world.daemon.serve = serve
    world.client.connect()
    assert world.client.connected and world.told == []


def test_attempts_that_fail_leave_nothing_behind(world, recwarn):
    gc.collect()
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        assert failure(world).code == "no_daemon"
    assert len(os.listdir("/proc/self/fd")) == before
    assert [each for each in recwarn if each.category is ResourceWarning] == []


def test_no_descriptor_is_inherited_by_programs_that_are_started_or_outlives_close(world):
    world.meet()
    client = world.client
    opened = [client._timer, client._wake_read, client._wake_write, client.fileno(),
              client._socket.fileno()]
    assert not any(map(os.get_inheritable, opened))
    client.close()
    for each in opened:
        with pytest.raises(OSError):
            os.fstat(each)


def test_a_daemon_that_refuses_a_client_says_why(world):
    world.daemon.greeting = field(FAILURE, field(1, 7) + field(2, "too many clients"))
    world.daemon.start()
    error = failure(world)
    assert (error.code, error.text) == ("limit", "too many clients")
    assert not world.client.connected
    world.pass_time(2)
    assert world.told == [], "it was told by connect()"
    # In the background it is told once.
    world.client._reported_failure = None
    world.pass_time(2)
    assert world.told == [("error", "limit", "too many clients")]
    world.daemon.greeting = field(HELLO, GREETING)
    world.pass_time(0.5)
    assert world.client.connected and world.told[1:] == []
    # and again when it happens again
    world.daemon.greeting = field(FAILURE, field(1, 7) + field(2, "too many clients"))
    world.daemon.drop()
    world.pass_time(2)
    assert [each[0] for each in world.told] == ["error", "lost", "error"]


def test_an_older_daemon_that_refuses_the_version_is_tried_seldom(world):
    world.daemon.greeting = field(FAILURE, field(1, 1) + field(2, "update one of the two"))
    world.daemon.start()
    world.pass_time(0.1)
    assert world.told == [("error", "version_mismatch", "update one of the two")]
    assert world.daemon.attempts == 1


def test_the_greeting_has_version_and_name_and_is_followed_by_the_daemons(world):
    world.daemon.start()
    world.client.connect()
    (hello,) = world.daemon.of(HELLO)
    assert hello == {1: 1, 2: 2, 4: b"test"}
    assert (world.client.node_id, world.client.daemon_name) == (77, "swarmtalkd 9")
    world.client.connect()
    assert len(world.daemon.of(HELLO)) == 1, "it is connected"
    world.daemon.greeting = field(HELLO, field(1, 1) + field(2, 9) + field(4, "swarmtalkd 10")
                                  + field(5, 78))
    world.daemon.drop()
    world.pass_time(0.3)
    assert (world.client.node_id, world.client.daemon_name) == (78, "swarmtalkd 10")


def test_the_first_call_that_needs_the_daemon_connects(world):
    world.daemon.start()
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    assert not world.client.connected
    assert world.client.get_pose() is None and world.client.connected
    world.daemon.stop()
    world.pass_time(0.3)
    with pytest.raises(swarmtalk.Error, match="does not exist") as raised:
        world.client.get_pose()
    assert raised.value.code == "no_daemon"
    world.client.close()
    with pytest.raises(swarmtalk.Error, match="this Client is closed"):
        world.client.get_pose()


@pytest.mark.parametrize("kind", [swarmtalk.Error, KeyboardInterrupt, KeyError])
def test_a_client_that_cannot_connect_is_no_client(tmp_path, monkeypatch, kind):
    def fail(_):
        raise kind("system", "by connect()")
    gc.collect()
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(swarmtalk.Error, match="does not exist"):
        swarmtalk.Client("x", tmp_path / "s")
    monkeypatch.setattr(swarmtalk.Client, "connect", fail)
    with pytest.raises(kind, match="by connect"):
        swarmtalk.Client("x", tmp_path / "s")
    assert len(os.listdir("/proc/self/fd")) == before


@pytest.mark.parametrize("name, words", [
    (None, "is text, not None"), (5, "is text, not 5"), ("", "must not be empty"),
    ("\u00fc" * 513, "at most 1024 bytes"), ("x" * 1025, "at most 1024 bytes")])
def test_what_is_no_name_of_a_client_is_told(tmp_path, name, words):
    with pytest.raises(swarmtalk.BadArgument, match=words):
        swarmtalk.Client(name, tmp_path / "s", connect=False)


def test_where_the_socket_is_comes_from_the_program_then_from_the_environment(monkeypatch):
    def path(*given):
        with swarmtalk.Client("x" * 1024, *given, connect=False) as client:
            return client._path
    monkeypatch.setenv("SWARMTALK_SOCKET", "/from/environment")
    assert path("/given") == path(b"/given") == path(pathlib.Path("/given")) == "/given"
    assert path("/\xe9") == path("/\xe9".encode()) == "/\xe9"
    assert path() == path(None) == "/from/environment"
    monkeypatch.delenv("SWARMTALK_SOCKET")
    assert path() == "/run/swarmtalk/swarmtalkd.sock"
    with pytest.raises(swarmtalk.BadArgument, match="as text, not 5"):
        path(5)
    for wrong, words in (("\0nobody", "zero byte"), (b"/a\0b", "zero byte"),
                         ("/\ud800", "give it as bytes")):
        with pytest.raises(swarmtalk.BadArgument, match=words):
            path(wrong)
