"""What the Python client keeps and what it forgets when its daemon goes and the next one comes.
With a daemon that is a script and a clock that stands still unless the client waits."""
import select
import socket
import types

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, CLIENT_LOSS, DELIVER, GREETING, HELLO, PUBLISH, SENT,
                             SUBSCRIBE, advertised)

pytestmark = pytest.mark.logic
PATIENCE_S = 60


@pytest.fixture(name="world")
def answer_world(world):
    world.daemon.answers[ADVERTISE] = advertised(60000)
    return world


def reconnect(world):
    world.daemon.drop()
    world.pass_time(0.3)
    assert world.client.connected


def ids_of(world, kind):
    return [each[1] for each in world.daemon.requests if each[0] == kind]


def test_nobody_at_the_start_is_told_once_and_another_reason_again(world):
    assert world.client.process() is False
    world.pass_time(2)
    assert [each[:2] for each in world.told] == [("error", "no_daemon")]
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as left:
        left.bind(str(world.daemon.path))
    world.pass_time(2)
    assert [each[:2] for each in world.told[1:]] == [("error", "daemon_dead")]
    world.meet()
    assert len(world.told) == 2, "the first connection is no news"
    assert world.client.process() is True


def test_why_there_is_no_daemon_is_raised_by_what_needs_one(world):
    world.client.process()
    with pytest.raises(swarmtalk.Error, match="does not exist"):
        world.client.get_pose()
    world.daemon.greeting = None
    world.daemon.start()
    world.pass_time(0.3)
    with pytest.raises(swarmtalk.Error) as raised:
        world.client.get_pose()
    assert raised.value.text == "not connected to swarmtalkd; reconnecting", "it is there by now"
    world.daemon.greeting = field(HELLO, GREETING)
    world.daemon.drop()
    world.pass_time(0.5)
    assert world.client.connected
    world.daemon.stop()
    world.client.process()
    with pytest.raises(swarmtalk.Error, match="lost swarmtalkd: it closed the connection"):
        world.client.get_pose()


def test_the_first_handle_connects_or_says_why_not_and_waits(world):
    publisher = world.client.advertise("a")
    assert [each[:2] for each in world.told] == [] and publisher.status.code == "disconnected"
    assert world.client.process() is False
    assert [each[:2] for each in world.told] == [("error", "no_daemon")]
    world.pass_time(1)
    assert len(world.told) == 1
    world.meet()
    assert publisher.status is None and len(ids_of(world, ADVERTISE)) == 1
    other = swarmtalk.Client("other", world.daemon.path, connect=False)
    world.daemon.drop()
    assert other.advertise("b").status is None and other.connected
    other.close()


def test_nothing_is_taken_while_the_daemon_is_away(world):
    world.meet()
    publisher = world.client.advertise("a", queue=0)
    subscriber = world.client.subscribe("b")
    world.daemon.stop()
    world.client.process()
    for _ in range(2):
        assert publisher.send("x").code == "disconnected"
    assert not publisher.busy()
    assert publisher.status.code == subscriber.status.code == "disconnected"
    world.meet()
    assert publisher.status is None and subscriber.status is None
    assert world.daemon.of(PUBLISH) == [], "what was refused is not sent later"
    assert world.daemon.of(CLIENT_LOSS) == []
    assert publisher.send("y")
    world.settle()
    assert [each[3] for each in world.daemon.of(PUBLISH)] == [b"y"]


def test_what_the_daemon_before_called_something_is_nothing_to_the_next(world):
    world.meet()
    publisher, subscriber = world.client.advertise("a", queue=0), world.client.subscribe("b")
    old = ids_of(world, ADVERTISE) + ids_of(world, SUBSCRIBE)
    assert publisher.send("x")
    world.settle()
    reconnect(world)
    new = [ids_of(world, ADVERTISE)[-1], ids_of(world, SUBSCRIBE)[-1]]
    assert not set(old) & set(new)
    assert publisher.send("y"), "what was on its way is not waited for"
    assert publisher.busy()
    world.settle()
    (number,) = [each[2] for each in world.daemon.of(PUBLISH) if each[3] == b"y"]
    world.daemon.tell(field(SENT, field(1, old[0]) + field(2, number)),
                      field(DELIVER, field(1, old[1]) + field(2, "old")))
    world.settle()
    assert publisher.busy() and subscriber.take() == []
    assert [each[1] for each in world.daemon.of(PUBLISH)] == [old[0], new[0]]
    world.daemon.tell(field(SENT, field(1, new[0]) + field(2, number)),
                      field(DELIVER, field(1, new[1]) + field(2, "new")))
    world.settle()
    assert not publisher.busy() and [each.text for each in subscriber.take()] == ["new"]


def test_half_a_frame_of_the_daemon_before_is_forgotten(world):
    world.meet()
    world.daemon.connection.sendall(b"\x20\0\0\0half")
    world.settle()
    reconnect(world)
    assert [each[0] for each in world.told] == ["lost", "back"]


def test_what_waits_to_be_fetched_stays_and_losses_here_are_told_to_the_next_daemon(world):
    world.meet()
    subscriber = world.client.subscribe("b", keep_last=1)
    for _ in range(3):
        world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    world.daemon.stop()  # before it is told
    with pytest.raises(swarmtalk.Error):
        world.client.get_pose()
    world.meet()
    id_ = world.daemon.newest_id(SUBSCRIBE)
    assert world.daemon.of(CLIENT_LOSS) == [{1: id_, 2: 2}]
    world.daemon.deliver(id_, "y")
    world.settle()
    assert world.daemon.of(CLIENT_LOSS)[1:] == [{1: id_, 2: 1}]
    assert [(each.text, each.lost_before.client) for each in subscriber.take()] == [("y", 3)]


def test_calls_during_the_registration_wait_for_it(world):
    world.meet()
    publisher = world.client.advertise("a")
    answer = world.daemon.answers.pop(ADVERTISE)
    world.daemon.drop()
    world.pass_time(0.3)
    assert not world.client.connected and publisher.send("x").code == "disconnected"
    assert [each[0] for each in world.told] == ["lost"]
    subscriber = world.client.subscribe("b")  # joins those that are registered
    assert subscriber.status is None and not world.client.connected
    world.daemon.tell(field(1, world.daemon.newest_id(ADVERTISE))
                      + answer(world.daemon.newest_id(ADVERTISE)))
    world.settle()
    assert world.client.connected and publisher.send("x")
    assert [each[0] for each in world.told] == ["lost", "back"]


def test_a_daemon_that_does_not_answer_registrations_is_left(world):
    world.meet()
    world.client.advertise("a")
    answer = world.daemon.answers.pop(ADVERTISE)
    world.daemon.drop()
    world.pass_time(0.3)
    attempts = world.daemon.attempts
    world.pass_time(1.6)
    assert world.daemon.attempts == attempts
    world.daemon.answers[ADVERTISE] = answer
    world.pass_time(0.5)
    assert world.daemon.attempts == attempts + 1 and world.client.connected
    assert [each[:2] for each in world.told] == [
        world.told[0], ("error", "timeout"), ("back",)], world.told


def test_a_pause_is_half_to_all_of_what_it_may_be(world, monkeypatch):
    asked = []
    monkeypatch.setattr(swarmtalk.random, "uniform", lambda least, most: asked.append(
        (least, most)) or most)
    world.client.process()
    times = []
    attempt = world.client._attempt
    monkeypatch.setattr(world.client, "_attempt", lambda: times.append(world.now) or attempt())
    begin = world.now
    world.pass_time(1.5)
    assert set(asked) == {(0.5, 1)}
    expected, at = [], begin
    for pause in (0.02, 0.04, 0.08, 0.16, 0.25, 0.25, 0.25, 0.25):
        at += pause
        expected.append(at)
    assert times == pytest.approx(expected, abs=0.009)


# The timer itself, without the clock that stands still.

def test_a_timer_is_set_in_seconds_and_nanoseconds(monkeypatch):
    made = []
    monkeypatch.setattr(swarmtalk, "_libc", types.SimpleNamespace(
        timerfd_settime=lambda fd, flags, value, old: made.append((fd, flags, value._obj[:], old))))
    for seconds in (1000.5, 0.25, 0, -1, None):
        swarmtalk._set_timer(7, seconds)
    assert made == [(7, 0, [0, 0, 1000, 500000000], None), (7, 0, [0, 0, 0, 250000000], None),
                    (7, 0, [0, 0, 0, 1], None), (7, 0, [0, 0, 0, 1], None),
                    (7, 0, [0, 0, 0, 0], None)]


def test_an_event_loop_is_woken_for_the_next_attempt(tmp_path):
    with swarmtalk.Client("x", tmp_path / "s", connect=False) as client:
        client.on_error = None
        assert client.process() is False
        for _ in range(3):
            assert select.select([client], [], [], PATIENCE_S)[0], "nothing woke it"
            assert client.process() is False
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as daemon:
            daemon.bind(str(tmp_path / "s"))
            daemon.listen(1)
            assert select.select([client], [], [], PATIENCE_S)[0], "nothing woke it"
            client.process()
            assert select.select([daemon], [], [], PATIENCE_S)[0], "it did not try"


def test_a_timer_that_cannot_be_made_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(swarmtalk, "_libc", types.SimpleNamespace(
        timerfd_create=lambda clock, flags: -1))
    with pytest.raises(swarmtalk.Error, match="cannot make a Client") as raised:
        swarmtalk.Client("x", tmp_path / "s", connect=False)
    assert raised.value.code == "system"
