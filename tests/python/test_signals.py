"""A signal's handler that sends, asks, closes or raises, at each place where Python lets one run
while the client is at work: nothing is lost without a word, nothing comes twice, nothing hangs."""
import asyncio
import gc
import os
import sys

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, CLIENT_LOSS, DONE, GET_POSE, POSE, PUBLISH, SENT, SET_POSE,
                             SUBSCRIBE, UNADVERTISE, UNSUBSCRIBE, World, advertised)

pytestmark = pytest.mark.logic
interruptible = swarmtalk._interruptible  # World replaces it


class Raised(OSError, ValueError):
    """Of the kinds that the client catches from what it calls."""


class Strike:
    """Calls a handler once, at the n-th place in the client's file where Python could: after a
    call of what is written in C, and where a function begins."""
    watch = sys.setprofile

    def __init__(self, place, handler):
        self.left, self.handler, self.where = place, handler, ""

    def is_place(self, frame, event):
        return event in ("call", "c_return")

    def __call__(self, frame, event, _):
        if frame.f_globals is not vars(swarmtalk):
            return None
        if self.is_place(frame, event):
            self.left -= 1
            if self.left == 0:
                self.watch(None)
                self.where = f"{frame.f_code.co_name}(), line {frame.f_lineno}, {event}"
                self.handler()
        return self

    def during(self, scene):
        """Plays a scene. Whether the handler raised in it."""
        self.watch(self)
        try:
            scene()
        except Raised:
            return True
        finally:
            self.watch(None)
        return False


class StrikeBetweenStatements(Strike):
    """As a Python before 3.10 could, which lets a handler in between any two of them."""
    watch = sys.settrace

    def is_place(self, frame, event):
        return event == "line"


class Stage:
    """A robot program with a publisher and a subscriber; its daemon takes what it sends at once,
    and has three messages for it."""

    def __init__(self, world, receive=None):
        self.world, self.client = world, world.client
        world.daemon.answers[ADVERTISE] = advertised(1000)
        world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
        world.daemon.start()
        world.pass_time(0.3, step=0.1)
        self.ends, self.sent, self.asked = [], [], []
        self.publisher = self.client.advertise("a", queue=2, sent=self.ends.append)
        self.publisher_id = world.daemon.newest_id(ADVERTISE)
        self.subscriber = self.client.subscribe("b", receive)
        self.told_of = 0
        for text in ("1", "2", "3"):
            world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), text)

    def send(self, text):
        taken = self.publisher.send(text)
        self.sent.append((text, bool(taken)))
        return taken

    def published(self):
        """What the daemon has got: [(number, text)]."""
        return [(each[2], each[3].decode()) for each in self.world.daemon.of(PUBLISH)]

    def answer(self):
        """The daemon takes what was published, and says of each that it has left."""
        self.world.daemon.serve()
        for number, _ in self.published()[self.told_of:]:
            self.told_of += 1
            if self.world.daemon.connection is not None:
                self.world.daemon.tell(field(SENT, field(1, self.publisher_id)
                                             + field(2, number)))

    def talk(self):
        """Sends, which has to look for answers, and runs."""
        for text in ("x", "y", "z", "u"):
            self.send(text)
            self.answer()
        self.client.process()
        self.client.process()

    def end(self):
        """The program goes on after what has happened, and all that is under way arrives."""
        assert self.send("bye")
        for _ in range(3):
            self.answer()
            self.world.settle()

    def check_what_was_sent(self, extra=()):
        numbers = [number for number, _ in self.published()]
        texts = [text for _, text in self.published()]
        assert numbers == sorted(set(numbers)), numbers
        assert len(set(texts)) == len(texts), "each once"
        taken = [text for text, is_taken in self.sent if is_taken]
        assert set(taken) <= set(texts) and texts[-1] == "bye"
        assert len(set(texts) - set(taken)) <= 1, "but one of which the program knows nothing"
        assert set(extra) <= set(texts)
        assert self.ends == [None] * len(texts), "each ends once"
        assert not self.publisher._in_flight and not self.publisher.busy()


def strike_all(tmp_path, monkeypatch, make, scene, handler, check, kind=Strike):
    """Plays a scene again and again, and strikes one place later each time, until it is over
    before. Returns how many places there were."""
    for place in range(1, 100000):
        with monkeypatch.context() as patches:
            world = World(patches, tmp_path / "s")
            strike = kind(place, lambda: handler(stage))
            try:
                stage = make(world)
                has_raised = strike.during(lambda: scene(stage))
                if strike.left > 0:
                    return place - 1
                check(stage, has_raised)
            except AssertionError as error:
                raise AssertionError(f"struck at place {place}, {strike.where}: {error}") from error
            finally:
                world.daemon.stop()
                world.client.on_error = world.client.on_disconnect = None
                world.client.close()
    raise AssertionError("the scene never ends")


def with_callback(world):
    return Stage(world, lambda message: world.heard.append(message.data.decode()))


def do_raise(_):
    raise Raised("by a handler")


@pytest.mark.parametrize("kind", [Strike, StrikeBetweenStatements])
def test_what_a_handler_raises_loses_nothing_and_repeats_nothing(tmp_path, monkeypatch, kind):
    def check(stage, has_raised):
        assert has_raised
        stage.end()
        assert stage.world.heard == ["1", "2", "3"] and stage.world.told == []
        stage.check_what_was_sent()
    places = strike_all(tmp_path, monkeypatch, with_callback, Stage.talk, do_raise, check, kind)
    assert places > 300


def test_what_a_handler_sends_is_sent_once_wherever_it_strikes(tmp_path, monkeypatch):
    def handler(stage):
        stage.asked.append(bool(stage.publisher.send("handler")))

    def check(stage, _):
        stage.end()
        assert stage.world.heard == ["1", "2", "3"] and stage.world.told == []
        assert len(stage.asked) == 1
        stage.check_what_was_sent(["handler"] if stage.asked[0] else [])
    assert strike_all(tmp_path, monkeypatch, with_callback, Stage.talk, handler, check) > 300


def test_a_handler_that_asks_in_the_middle_of_a_call_is_told_that_it_may_not(tmp_path, monkeypatch):
    said = set()

    def handler(stage):
        try:
            stage.client.get_pose()
            stage.asked.append("answered")
        except swarmtalk.BadArgument as error:
            stage.asked.append(error.text)

    def check(stage, _):
        said.update(stage.asked)
        stage.end()
        assert stage.world.heard == ["1", "2", "3"] and stage.world.told == []
        stage.check_what_was_sent()
    strike_all(tmp_path, monkeypatch, with_callback, Stage.talk, handler, check)
    (sentence,) = said - {"answered"}  # where the program only sends, it is not inside
    assert "its handler may call send(), busy(), stop() and close() only" in sentence
    assert "answered" in said


def test_a_handler_may_close_the_client_wherever_it_strikes(tmp_path, monkeypatch):
    def scene(stage):
        try:
            stage.talk()
        except swarmtalk.Error as error:
            assert error.text == "this Client is closed"

    def check(stage, _):
        assert stage.publisher.send("bye").text == "the Client of this handle is closed"
        stage.answer()
        texts = [text for _, text in stage.published()]
        taken = [text for text, is_taken in stage.sent if is_taken]
        assert texts == taken, "what was taken is there, once"
        assert len(stage.world.heard) == len(set(stage.world.heard))
        with pytest.raises(swarmtalk.Error, match="this Client is closed"):
            stage.client.process()

    def make(world):
        stage = with_callback(world)
        stage.client.on_error = None
        return stage
    strike_all(tmp_path, monkeypatch, make, scene, lambda stage: stage.client.close(), check)


def test_a_message_that_is_fetched_is_not_lost_when_a_handler_raises(tmp_path, monkeypatch):
    def fetch(stage):
        stage.asked.append(stage.subscriber.get(5).data.decode())
        for message in stage.subscriber.take():
            stage.asked.append(message.data.decode())

    def check(stage, has_raised):
        assert has_raised
        stage.world.settle()
        stage.asked.extend(each.data.decode() for each in stage.subscriber.take())
        assert stage.asked == ["1", "2", "3"]
    strike_all(tmp_path, monkeypatch, Stage, fetch, do_raise, check)


def test_poses_are_told_on_after_a_handler_has_raised(tmp_path, monkeypatch):
    def tell(stage):
        for x in (1, 2):
            stage.client.set_pose(x, 0, 0)
        stage.client.sync()

    def check(stage, has_raised):
        assert has_raised
        stage.client.set_pose(9, 0, 0)
        stage.client.sync()
        assert stage.world.daemon.poses()[-1] == 9

    def make(world):
        world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
        return with_callback(world)
    strike_all(tmp_path, monkeypatch, make, tell, do_raise, check)


def test_a_timeout_of_an_alarms_handler_comes_out_as_it_is():
    def wait(_):
        raise TimeoutError  # without arguments
    with pytest.raises(TimeoutError):
        interruptible(wait, 0)


def test_a_client_finds_its_daemon_again_wherever_a_handler_raises(tmp_path, monkeypatch):
    def lose(stage):
        stage.world.daemon.drop()
        for _ in range(3):
            stage.client.process()
            stage.world.now += 0.3
            stage.world.daemon.serve()
        stage.client.process()

    def check(stage, has_raised):
        assert has_raised
        stage.world.pass_time(6, step=0.1)
        assert stage.client.connected
        stage.publisher_id = stage.world.daemon.newest_id(ADVERTISE)
        stage.told_of = len(stage.published())
        del stage.ends[:]
        assert stage.send("bye")
        stage.answer()
        stage.world.settle()
        assert stage.published()[-1][1] == "bye" and stage.ends == [None]
        del stage.world.heard[:]
        stage.world.daemon.deliver(stage.world.daemon.newest_id(SUBSCRIBE), "again")
        stage.world.settle()
        assert stage.world.heard == ["again"]
    strike_all(tmp_path, monkeypatch, with_callback, lose, do_raise, check)


def registered(stage, kind, end):
    """The ids that the daemon knows, of those of one kind."""
    gone = [each[1] for each in stage.world.daemon.of(end)]
    assert len(gone) == len(set(gone)), "each is ended once"
    return {each[1] for each in stage.world.daemon.requests if each[0] == kind} - set(gone)


def with_ends(world):
    for kind in (UNSUBSCRIBE, UNADVERTISE):
        world.daemon.answers[kind] = lambda _: field(DONE, b"")
    return Stage(world)


def test_what_is_not_made_because_a_handler_raised_stays_registered_nowhere(tmp_path, monkeypatch):
    kinds = ((SUBSCRIBE, UNSUBSCRIBE), (ADVERTISE, UNADVERTISE))
    left_over = []

    def make_two(stage):
        stage.asked.append(stage.client.subscribe("c"))
        stage.asked.append(stage.client.advertise("c"))

    def check(stage, _):
        stage.world.settle()
        known = [len(registered(stage, *each)) for each in kinds]
        count = sum(known) - 2 - len(stage.asked)
        assert count == len(stage.client._handles) - 2 - len(stage.asked)
        left_over.append(count)
        (stage.asked or [stage.client.subscribe("d")])[0].close()
        stage.client.sync()
    places = strike_all(tmp_path, monkeypatch, with_ends, make_two, do_raise, check)
    assert places > 150
    # Of each, from where it is made to where the call has returned.
    assert sum(left_over) < 12 and set(left_over) == {0, 1}


def test_what_was_closed_half_is_closed_by_the_next_close(tmp_path, monkeypatch):
    def close(stage):
        stage.subscriber.close()
        stage.publisher.close()

    def check(stage, _):
        close(stage)
        stage.client.sync()
        assert not registered(stage, SUBSCRIBE, UNSUBSCRIBE)
        assert not registered(stage, ADVERTISE, UNADVERTISE)
        assert stage.client._handles == [] and not stage.publisher.send("x")
        assert not stage.client._subscribers and not stage.client._publishers
    strike_all(tmp_path, monkeypatch, with_ends, close, do_raise, check)


def test_a_client_that_was_closed_half_is_closed_by_the_next_close(tmp_path, monkeypatch):
    def check(stage, _):
        client = stage.client
        client.close()
        for each in opened[stage]:
            with pytest.raises(OSError):
                os.fstat(each)
        assert client._handles == [] and client._socket is None and not client._opened

    def make(world):
        stage = with_callback(world)
        client = stage.client
        opened[stage] = [client._timer, client._wake_read, client._wake_write, client.fileno(),
                         client._socket.fileno()]
        stage.send("x")
        return stage
    opened = {}
    strike_all(tmp_path, monkeypatch, make, lambda stage: stage.client.close(), do_raise, check)


@pytest.mark.parametrize("kind", [Strike, StrikeBetweenStatements])
def test_a_client_that_is_not_made_because_a_handler_raised_leaves_no_descriptor(tmp_path,
                                                                                 monkeypatch, kind):
    def make(stage):
        stage.asked.append(swarmtalk.Client("other", stage.world.daemon.path, connect=False))

    def check(stage, has_raised):
        assert has_raised and not stage.asked
        assert len(os.listdir("/proc/self/fd")) == stage.descriptors

    def begin(world):
        stage = with_callback(world)
        gc.collect()  # what is left of the places before
        stage.descriptors = len(os.listdir("/proc/self/fd"))
        return stage
    assert strike_all(tmp_path, monkeypatch, begin, make, do_raise, check, kind) > 20


@pytest.mark.parametrize("kind", [Strike, StrikeBetweenStatements])
def test_each_message_that_was_dropped_is_counted_once(tmp_path, monkeypatch, kind):
    def fill(stage):
        stage.client.get_pose()

    def check(stage, _):
        fill(stage)
        messages = stage.subscriber.take()
        stage.client.process()
        assert [each.data for each in messages] == [b"6"]
        assert messages[0].lost_before.client == 5
        stage.world.daemon.serve()
        assert sum(each[2] for each in stage.world.daemon.of(CLIENT_LOSS)) == 5

    def make(world):
        stage = Stage(world)
        stage.subscriber._keep_last = 1
        for text in ("4", "5", "6"):
            world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), text)
        return stage
    strike_all(tmp_path, monkeypatch, make, fill, do_raise, check, kind)


def test_asyncio_gets_each_message_once_when_a_handler_raises(tmp_path, monkeypatch):
    """Each step as a task does it: what is awaited gives a future, or ends with the message."""
    loop = asyncio.new_event_loop()

    def step(stage, coming):
        try:
            return next(coming)
        except StopIteration as end:
            stage.asked.append(end.value.data)

    def fetch(stage):
        for _ in range(3):
            coming = stage.subscriber.__anext__().__await__()
            while step(stage, coming) is not None:
                stage.client.process()

    def check(stage, _):
        assert len(stage.subscriber._futures) < 2
        stage.world.settle()
        while len(stage.asked) < 3:
            assert step(stage, stage.subscriber.__anext__().__await__()) is None
        assert stage.asked == [b"1", b"2", b"3"] and not stage.subscriber._waiting

    def make(world):
        stage = Stage(world)
        world.client._loop = loop
        return stage
    strike_all(tmp_path, monkeypatch, make, fetch, do_raise, check)
    loop.close()


def test_no_exception_vanishes_where_a_refusal_is_thrown_away(tmp_path, monkeypatch):
    def flood(stage):
        for _ in range(5):
            stage.publisher.send("x")

    def check(stage, has_raised):
        assert has_raised
        flood(stage)
    unraisable = []
    monkeypatch.setattr(sys, "unraisablehook", unraisable.append)
    strike_all(tmp_path, monkeypatch, Stage, flood, do_raise, check)
    assert not unraisable


def test_what_an_alarm_raises_while_a_line_is_printed_is_not_swallowed(monkeypatch):
    def scene():
        swarmtalk._print_error("a line")
    strike = Strike(2, lambda: do_raise(None))
    assert strike.during(scene) and "_print_error" in strike.where


def test_get_of_a_client_that_was_closed_says_so(tmp_path, monkeypatch):
    with monkeypatch.context() as patches:
        world = World(patches, tmp_path / "s")
        subscriber = Stage(world).subscriber
        assert subscriber.get(0).data == b"1"
        world.client.close()
        assert [each.data for each in subscriber] == [b"2", b"3"], "a loop goes to the end"
        with pytest.raises(swarmtalk.Error, match="this Client is closed"):
            subscriber.get()
        world.daemon.stop()


class Refusing(Raised, swarmtalk.Error):
    """What a handler lets out that calls what it may not."""
    code, text = "disconnected", "by a handler"


def do_refuse(_):
    raise Refusing("by a handler")


class Beginner:
    """A program that has not connected yet."""

    def __init__(self, world):
        world.daemon.start()
        self.client = world.client


@pytest.mark.parametrize("make, scene", [
    (Beginner, lambda stage: stage.client.subscribe("c")),
    (with_callback, lambda stage: (stage.send("x"), stage.client.close()))],
    ids=["the first subscribe()", "close()"])
def test_what_a_handler_raises_is_not_taken_for_a_failure_of_the_daemon(tmp_path, monkeypatch,
                                                                        make, scene):
    def check(stage, has_raised):
        assert has_raised
    assert strike_all(tmp_path, monkeypatch, make, scene, do_refuse, check) > 100
