"""What becomes of each message that a Python program sends or hears, and what it is told of it.
With a daemon that is a script and a clock that stands still unless the client waits."""
import array
import asyncio
import select
import struct

import pytest

import swarmtalk
from local_frames import field, varint
from scripted_daemon import (ADVERTISE, ADVERTISED, DELIVER, FAILURE, GET_POSE, POSE, PUBLISH,
                             SENT, SUBSCRIBE, advertised)
from test_programs import Turn, in_a_loop

pytestmark = pytest.mark.logic


@pytest.fixture(name="world")
def meet_world(world):
    world.daemon.answers[ADVERTISE] = advertised(60000)
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    world.meet()
    return world


def publisher_of(world, *arguments, **options):
    publisher = world.client.advertise(*arguments, **options)
    return publisher, world.daemon.newest_id(ADVERTISE)


def subscriber_of(world, *arguments, **options):
    subscriber = world.client.subscribe(*arguments, **options)
    return subscriber, world.daemon.newest_id(SUBSCRIBE)


def left(publisher, number):
    return field(SENT, field(1, publisher) + field(2, number))


def failed(publisher, number, text, code=12):
    return field(FAILURE, field(1, code) + field(2, text) + field(4, publisher) + field(5, number))


def test_what_stopped_a_message_is_told_to_a_program_that_does_not_ask(world):
    publisher, id_ = publisher_of(world, "a", queue=9)  # told of in twos
    for _ in range(6):
        assert publisher.send("x")
    world.daemon.tell(failed(id_, 2, "no link is up"), failed(id_, 4, "newer", 14))
    world.settle()
    assert world.told == [("error", "link_down", "no link is up")]
    assert len(publisher._in_flight) == 4, "each ends but one message"
    world.daemon.tell(left(id_, 3))
    world.settle()
    assert len(publisher._in_flight) == 2
    world.daemon.tell(left(id_, 100), left(id_, 6), left(id_ + 50, 1))  # of nothing that waits
    world.settle()
    assert len(publisher._in_flight) == 0 and world.client.connected
    world.client.on_error = None
    publisher.send("x")
    world.daemon.tell(failed(id_, 7, "no link is up"))
    world.settle()
    assert not publisher._in_flight and world.client.connected


def test_each_end_goes_to_the_function_of_its_publisher_and_nowhere_else(world):
    ends = []
    one, first = publisher_of(world, "a", sent=lambda error: ends.append(("one", error)))
    two, second = publisher_of(world, "a", sent=lambda error: ends.append(("two", error)))
    for each in (one, two, one):
        each.send("x")
    world.daemon.tell(left(second, 1), failed(first, 2, "no link is up"), left(first, 1),
                      left(first, 1), left(second, 1))
    world.settle()
    assert [(name, error and error.text) for name, error in ends] == [
        ("two", None), ("one", "no link is up"), ("one", None)]
    assert world.told == []


def test_nothing_is_called_for_a_handle_once_it_is_closed(world):
    ends = []
    publisher, id_ = publisher_of(world, "a", sent=ends.append)
    subscriber, heard_by = subscriber_of(world, "b", world.heard.append)
    publisher.send("x")
    world.daemon.tell(left(id_, 1), field(DELIVER, field(1, heard_by) + field(2, "x")))
    world.client.get_pose()  # has read them
    publisher.close()
    subscriber.close()
    world.settle()
    assert (ends, world.heard) == ([], [])


def test_a_message_that_nobody_waits_for_any_more_leaves_all_the_same(world):
    publisher, id_ = publisher_of(world, "a", sent=True)

    async def scene():
        one, two = publisher.async_send("1"), publisher.async_send("2")
        asyncio.ensure_future(one).cancel()
        await Turn()
        world.daemon.serve()
        world.daemon.tell(left(id_, 1), left(id_, 2))
        assert await two is None and one.cancelled()
    in_a_loop(world, scene)
    assert world.told == [] and not publisher._in_flight


def test_send_takes_bytes_of_every_kind_and_text(world):
    publisher, _ = publisher_of(world, 7)
    for data in (b"\0\xff", bytearray(b"ab"), memoryview(b"xcdx")[1:3], "gr\u00fc\u00df", b""):
        assert publisher.send(data)
    world.settle()
    assert [each.get(3, b"") for each in world.daemon.of(PUBLISH)] == [
        b"\0\xff", b"ab", b"cd", "gr\u00fc\u00df".encode(), b""]
    for data in (None, 5, ["x"], {}):
        with pytest.raises(TypeError, match="is bytes or text, not "):
            publisher.send(data)
    with pytest.raises(TypeError, match=r"array; make bytes of it, with \.tobytes\(\)"):
        publisher.send(array.array("f", [1, 2]))  # and of numpy
    for ttl in (-1, 1.5, "1", True):
        with pytest.raises(swarmtalk.BadArgument):
            publisher.send("x", ttl)


def test_a_frame_as_long_as_the_protocol_carries_is_read(world):
    _, id_ = subscriber_of(world, "b", lambda message: world.heard.append(len(message.data)))
    head = field(1, id_)
    size = 65536 - 4 - 4 - len(head)  # tag and length of the delivery, and of its payload
    envelope = field(DELIVER, head + field(2, b"x" * size))
    assert len(envelope) == 65536
    world.daemon.tell(envelope)
    world.settle()
    assert world.heard == [size]
    world.daemon.tell(field(DELIVER, head + field(2, b"x" * (size + 1))))
    world.pass_time(0.3)
    assert world.told[0] == ("lost", "swarmtalkd sent something that is not the protocol")


def test_one_look_takes_all_that_has_come(world):
    subscriber, id_ = subscriber_of(world, "b")
    for number in range(3):
        world.daemon.deliver(id_, b"%d" % number + b"x" * 40000)
    assert [each.data[:1] for each in subscriber.take()] == [b"0", b"1", b"2"]
    assert subscriber.take() == []


def test_fields_of_every_kind_are_read_over(world):
    """What a newer daemon adds, of any wire type and length."""
    _, id_ = subscriber_of(world, "b", lambda message: world.heard.append(
        (message.text, message.sender, message.hops)))
    news = (varint(900 << 3 | 1) + struct.pack("<d", 1.5) + varint(901 << 3 | 5)
            + struct.pack("<f", 1.5) + field(902, 2**63) + field(903, b"y" * 200))
    world.daemon.tell(news + field(DELIVER, news + field(1, id_) + field(2, "x") + news
                                   + field(4, 300) + field(9, 255)))
    world.settle()
    assert world.heard == [("x", 300, 255)] and world.told == []


def test_on_gap_is_called_before_the_message_with_the_gap(world):
    order = []
    world.client.on_gap = lambda message: order.append(("gap", message.text))
    _, id_ = subscriber_of(world, "b", lambda message: order.append(("message", message.text)))
    for text, lost in (("one", 0), ("two", 2)):
        world.daemon.tell(field(DELIVER, field(1, id_) + field(2, text)
                                + (field(16, field(3, lost)) if lost else b"")))
    world.settle()
    assert order == [("message", "one"), ("gap", "two"), ("message", "two")]


def test_options_of_both_ends_are_asked_for_as_the_manual_names_them(world):
    publisher_of(world, "a", ttl=2, timestamped=True, queue=3, drop_oldest=True, repeat=4,
                 repeat_interval=0.25, redundancy=5)
    publisher_of(world, "a", redundancy="auto", timestamped=False, queue=0, sent=True)
    assert world.daemon.of(ADVERTISE) == [
        {1: field(1, "a"), 2: 2, 3: 1, 4: 3, 5: 1, 6: 4, 7: 250, 9: 5},
        {1: field(1, "a"), 3: 0, 10: 1}]
    subscriber_of(world, 5, within=1.5, known_distance_only=True, keep_last=6,
                  latest_from_each=True, no_older_than=0.75, timestamped=False)
    subscriber_of(world, "b", timestamped=True)
    assert world.daemon.of(SUBSCRIBE) == [
        {1: field(2, 5), 2: 6, 3: struct.pack("<f", 1.5), 4: 1, 5: 0, 6: 1, 7: 750},
        {1: field(1, "b"), 5: 1}]


@pytest.mark.parametrize("told", [True, False])
def test_whether_there_is_redundancy_is_what_the_daemon_says(world, told):
    world.daemon.answers[ADVERTISE] = lambda number: field(
        ADVERTISED, field(1, number) + field(3, 10) + (field(6, 1) if told else b""))
    assert publisher_of(world, "a", redundancy=2)[0].has_redundancy is told
    world.daemon.answers[ADVERTISE] = lambda _: world.daemon.drop() or b""
    world.daemon.tell = lambda *_: None
    assert world.client.advertise("a").has_redundancy is False, "not before it is known"


@pytest.mark.parametrize("queue, every", [(0, None), (6, None), (7, 2), (16, 4), (254, 63),
                                          (255, 64), (1000, 64)])
def test_a_daemon_tells_of_messages_in_quarters_of_the_queue(world, queue, every):
    publisher_of(world, "a", queue=queue)
    publisher_of(world, "a", queue=queue, sent=print)
    publisher_of(world, "a", queue=queue, drop_oldest=True)
    assert [each.get(8) for each in world.daemon.of(ADVERTISE)][:2] == [every, None]
    # drop_oldest of no queue is none.
    assert [each.get(5) for each in world.daemon.of(ADVERTISE)] == [None, None, (queue > 0) or None]


@pytest.mark.parametrize("name, value", [
    ("within", -0.1), ("within", "1"), ("keep_last", 0), ("keep_last", 1.5), ("keep_last", True),
    ("no_older_than", -1), ("no_older_than", 4000001), ("latest_from_each", "no"),
    ("known_distance_only", "no"), ("timestamped", "no"), ("receive", 5),
    ("receive", lambda: None), ("receive", lambda a, b: None)])
def test_what_subscribe_does_not_take(world, name, value):
    with pytest.raises(swarmtalk.BadArgument, match=name):
        world.client.subscribe("b", **{name: value})
    assert world.daemon.of(SUBSCRIBE) == []


@pytest.mark.parametrize("name, value", [
    ("ttl", -1), ("queue", -1), ("queue", 1 << 32), ("repeat", 0), ("repeat_interval", -1),
    ("drop_oldest", "no"), ("redundancy", 13), ("redundancy", -1), ("redundancy", "all"),
    ("sent", 5), ("sent", False), ("sent", lambda: None), ("timestamped", b"no")])
def test_what_advertise_does_not_take(world, name, value):
    with pytest.raises(swarmtalk.BadArgument, match=name):
        world.client.advertise("b", **{name: value})
    assert world.daemon.of(ADVERTISE) == []


@pytest.mark.parametrize("channel", [-1, 65536, 1.5, None, True, b"\xff"])
def test_what_is_no_channel(world, channel):
    for call in (world.client.subscribe, world.client.advertise):
        with pytest.raises(swarmtalk.BadArgument) as raised:
            call(channel)
        assert raised.value.code == "bad_channel"


def test_channels_go_to_65535_and_names_may_be_bytes(world):
    for channel in (0, 65535, b"b", "b"):
        world.client.subscribe(channel)
    assert [each[1] for each in world.daemon.of(SUBSCRIBE)] == [
        field(2, 0), field(2, 65535), field(1, "b"), field(1, "b")]


def test_what_was_chosen_for_a_handle_is_told_and_stays(world):
    publisher, _ = publisher_of(world, "a", ttl=2, queue=3)
    subscriber, _ = subscriber_of(world, "b", keep_last=4)
    assert (publisher.ttl, publisher.queue, subscriber.keep_last) == (2, 3, 4)
    for handle, name, call in ((publisher, "queue", "advertise"), (subscriber, "within",
                                                                   "subscribe")):
        with pytest.raises(AttributeError, match=r"%s is chosen in %s\(" % (name, call)):
            setattr(handle, name, 1)
    with pytest.raises(AttributeError):
        publisher.quue = 3


def test_messages_that_are_fetched_and_messages_that_are_called_for_do_not_mix(world):
    subscriber, _ = subscriber_of(world, "b", print)
    for call in (subscriber.get, subscriber.take, lambda: iter(subscriber), subscriber.__aiter__):
        with pytest.raises(swarmtalk.BadArgument, match="is for a subscriber without a callback; "
                                                        "this one of channel b has one"):
            call()


@pytest.mark.parametrize("call", ["run", "run_for", "run_once"])
@pytest.mark.parametrize("seconds", [-1, "1", float("nan"), True])
def test_how_long_to_run_is_a_number_of_seconds(world, call, seconds):
    with pytest.raises(swarmtalk.BadArgument, match="number of seconds|0 seconds or more"):
        getattr(world.client, call)(seconds)


def test_waits_are_as_long_as_they_may_be(world, monkeypatch):
    waits = []

    def wait(_, timeout):
        waits.append(timeout)
        world.now += 5
        return []
    world.settle()
    with monkeypatch.context() as during:
        during.setattr(swarmtalk, "_interruptible", wait)
        for seconds in (0.5, None, 0):
            world.client.run_once(seconds)
        world.client.run(4)
        assert waits == [0.5, -1, 0, 4], "epoll's seconds; -1: for ever"
        del waits[:]
        del world.daemon.answers[GET_POSE]
        with pytest.raises(swarmtalk.Error, match="did not answer in time"):
            world.client.get_pose()
        assert waits == [1001], "poll's milliseconds, of request_timeout"
    world.settle()
    subscriber_of(world, "b", print)
    world.client.process()
    world.client.request_timeout = 10
    with monkeypatch.context() as during:
        during.setattr(swarmtalk, "_interruptible", wait)
        del waits[:]
        with pytest.raises(swarmtalk.Error, match="did not answer in time"):
            world.client.get_pose()
        assert waits == [3001, 5001], "it looks around after 3 s of silence, whoever waits"


def test_a_call_that_waits_is_woken_by_the_answer(world, monkeypatch):
    woken = []

    def wait(poll, _):
        woken.append([poll(0), world.daemon.serve() and poll(0)])
        return woken[-1][1]
    with monkeypatch.context() as during:
        during.setattr(swarmtalk, "_interruptible", wait)
        assert world.client.get_pose() is None
    own = world.client._socket.fileno()
    assert woken == [[[], [(own, select.POLLIN)]]]


def test_a_message_that_was_refused_has_no_end(world):
    ends = []
    publisher, id_ = publisher_of(world, "a", sent=ends.append, queue=0)
    world.settle()
    assert publisher.send("x") and publisher.send("y").code == "busy"
    world.settle()
    world.daemon.tell(left(id_, 1))
    world.settle()
    world.daemon.stop()
    assert publisher.send("x").code == "disconnected", "the write finds nobody"
    world.client.process()
    assert ends == [None] and [each[0] for each in world.told] == ["lost"]


def test_stop_ends_the_wait_for_a_message_at_once(world):
    subscriber, id_ = subscriber_of(world, "b")
    begin = world.now
    world.client.stop()
    assert subscriber.get(5) is None and world.now == begin
    assert subscriber.get(0.5) is None and world.now > begin, "one stop() ends one wait"


def test_run_once_does_one_thing_or_what_stop_asks(world):
    _, id_ = subscriber_of(world, "b", world.heard.append)
    world.settle()
    world.daemon.deliver(id_, "x")
    begin = world.now
    world.client.run_once(5)
    assert len(world.heard) == 1 and world.now - begin < 0.01
    begin = world.now
    world.client.stop()
    world.client.run_once(5)
    assert world.now == begin


def test_a_misspelt_call_names_the_right_one(world):
    for name, words in (("sleep", "did you mean 'run'"), ("id", "did you mean 'node_id'"),
                        ("send", "a publisher sends"), ("subscrib", "did you mean 'subscribe'"),
                        ("nod_id", "did you mean 'node_id'"), ("xyzzy", "docs/python.md lists")):
        with pytest.raises(AttributeError, match="a Client has no %r; .*%s" % (name, words)):
            getattr(world.client, name)
    with pytest.raises(AttributeError, match="^_mine$"):
        world.client._mine
    with pytest.raises(TypeError, match=r"subscribe\(\) has no option 'witin'; did you mean "
                                        "'within'"):
        world.client.subscribe("b", witin=3)
