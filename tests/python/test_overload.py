"""A Python program that is too slow, or a daemon that is: what goes first, and who is told. With a
daemon that is a script and a clock that stands still unless the client waits."""
import asyncio
import select

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, CLIENT_LOSS, DELIVER, DONE, FAILURE, GET_POSE, POSE,
                             PUBLISH, SENT, SET_POSE, SUBSCRIBE, advertised)
from test_programs import Turn, in_a_loop

pytestmark = pytest.mark.logic


@pytest.fixture(name="world")
def meet_world(world):
    world.daemon.answers[ADVERTISE] = advertised(60000)
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    world.meet()
    return world


def test_of_what_comes_while_a_call_waits_the_oldest_messages_go_and_are_counted(
        world, monkeypatch):
    monkeypatch.setattr(swarmtalk, "_EVENTS_MAX", 4)
    heard = []
    for name in "bc":
        world.client.subscribe(name, lambda message: heard.append(
            (message.text, message.lost_before.client)))
    b, c = [each[1] for each in world.daemon.requests if each[0] == SUBSCRIBE]
    world.daemon.tell(field(FAILURE, field(1, 12) + field(2, "no link is up")))  # is no message
    for id_, text in ((b, "b1"), (c, "c1"), (b, "b2")):
        world.daemon.deliver(id_, text)
    world.client.get_pose()  # reads all of it and calls nobody
    assert heard == [] and world.told == []
    for text in ("c2", "c3"):
        world.daemon.deliver(c, text)
    world.daemon.tell(field(FAILURE, field(1, 12) + field(2, "none still")))
    world.client.get_pose()
    world.client.process()
    assert heard == [("b2", 1), ("c2", 1), ("c3", 0)]
    assert [each[2] for each in world.told] == ["no link is up", "none still"]
    world.settle()
    assert sorted((each[1], each[2]) for each in world.daemon.of(CLIENT_LOSS)) == [(b, 1), (c, 1)]


def test_an_error_that_the_daemon_tells_unasked_is_told_once(world):
    world.daemon.tell(field(FAILURE, field(1, 12) + field(2, "no link is up")),
                      field(FAILURE, field(1, 99) + field(2, "news")), field(FAILURE, field(1, 7)))
    world.settle()
    assert world.told == [("error", "link_down", "no link is up"), ("error", "protocol", "news"),
                          ("error", "limit", "swarmtalkd refused: limit")]


def test_stop_never_waits_however_often_it_is_called(world):
    for times in (1000, 5000, 70000):  # more than is read at once, more than a pipe holds
        for _ in range(times):
            world.client.stop()
        begin = world.now
        world.client.run()
        assert world.now == begin, "all of them end one run()"
        world.client.process()
        assert not select.select([world.client], [], [], 0)[0], "an event loop would spin"


def test_the_descriptor_is_quiet_when_nothing_is_to_be_done(world):
    def is_readable():
        return bool(select.select([world.client], [], [], 0)[0])
    world.settle()
    assert not is_readable()
    world.client.stop()
    assert is_readable()
    world.client.process()
    assert not is_readable()
    subscriber = world.client.subscribe("b", world.heard.append)
    world.settle()
    assert not is_readable()
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    assert is_readable()
    world.client.get_pose()  # has read it; the callback has not been called
    assert is_readable() and not world.heard
    world.client.process()
    assert not is_readable() and len(world.heard) == 1
    subscriber.close()


def test_a_message_is_refused_while_the_daemon_reads_nothing_and_counted_once_it_does(world):
    publisher = world.client.advertise("a", queue=1000)
    id_ = world.daemon.newest_id(ADVERTISE)
    taken = refused = 0
    while publisher.send(b"x" * 50000):
        taken += 1
    assert publisher.busy()
    for _ in range(4):
        refused += not publisher.send(b"x" * 50000)
    assert refused == 4
    world.settle()
    assert not publisher.busy()
    world.pass_time(2)
    told = world.daemon.of(CLIENT_LOSS)
    assert {each[3] for each in told} == {id_} and sum(each[4] for each in told) == 5
    assert len(world.daemon.of(PUBLISH)) == taken


def test_publishers_are_counted_each_by_itself(world):
    one, two = world.client.advertise("a", queue=0), world.client.advertise("a", queue=1)
    ids = [each[1] for each in world.daemon.requests if each[0] == ADVERTISE]
    assert [bool(one.send("x")) for _ in range(3)] == [True, False, False]
    assert [bool(two.send("x")) for _ in range(3)] == [True, True, False]
    assert one.busy() and two.busy()
    world.settle()
    world.daemon.tell(field(SENT, field(1, ids[1]) + field(2, 1)))
    world.settle()
    assert one.busy() and not two.busy()
    world.pass_time(2)
    told = world.daemon.of(CLIENT_LOSS)
    assert [sum(each[4] for each in told if each[3] == id_) for id_ in ids] == [2, 1]
    assert all(each[4] > 0 for each in told), "of nothing nothing is told"


def test_a_program_that_only_sends_finds_room_without_running(world):
    publisher = world.client.advertise("a", queue=0)
    id_ = world.daemon.newest_id(ADVERTISE)
    for number in range(1, 4):
        assert publisher.send("x")
        world.daemon.serve()
        world.daemon.tell(field(SENT, field(1, id_) + field(2, number)))
        if number == 2:
            assert not publisher.busy()
    assert world.told == []


def test_what_send_reads_while_it_looks_for_room_is_handed_over(world):
    publisher = world.client.advertise("a", queue=0)
    world.client.subscribe("b", world.heard.append)
    world.settle()
    assert publisher.send("x")
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    assert not publisher.send("y") and not world.heard
    assert select.select([world.client], [], [], 0)[0], "an event loop must come by"
    world.settle()
    assert len(world.heard) == 1


def test_where_the_oldest_is_dropped_none_is_refused(world):
    publisher = world.client.advertise("a", queue=1, drop_oldest=True)
    assert all([publisher.send("x") for _ in range(10)]) and not publisher.busy()
    world.settle()
    assert len(world.daemon.of(PUBLISH)) == 10, "the daemon drops"


def test_callbacks_of_a_program_that_only_sends_do_not_pile_up(world, monkeypatch):
    monkeypatch.setattr(swarmtalk, "_EVENTS_MAX", 100)
    ends = []
    publisher = world.client.advertise("a", queue=1, drop_oldest=True, sent=ends.append)
    id_ = world.daemon.newest_id(ADVERTISE)
    refused = None
    for number in range(1, 1000):
        refused = publisher.send("x")
        if not refused:
            break
        world.daemon.serve()
        world.daemon.tell(field(SENT, field(1, id_) + field(2, number)))
    assert refused.code == "busy" and "call run() or process()" in refused.text
    assert not ends and 100 <= len(world.client._events) < 200
    world.settle()
    assert len(ends) >= 100
    assert publisher.send("x")


def send_in_vain(world, publisher, code):
    """One message, of which the daemon says that it never left."""
    assert publisher.send("x")
    world.daemon.serve()
    id_, number = [(each[1], each[2]) for each in world.daemon.of(PUBLISH)][-1]
    world.daemon.tell(field(FAILURE, field(1, code) + field(2, "why") + field(4, id_)
                            + field(5, number)))


def test_failures_of_a_program_that_only_sends_do_not_pile_up_and_are_told(world, monkeypatch):
    monkeypatch.setattr(swarmtalk, "_EVENTS_MAX", 10)
    publisher = world.client.advertise("a", queue=1)
    for _ in range(50):
        send_in_vain(world, publisher, 12)
        assert len(world.client._events) <= 20
    world.daemon.tell(field(FAILURE, field(1, 12) + field(2, "no link is up")))
    world.client.get_pose()  # reads all of it and calls nobody
    world.settle()
    *each, rest = world.told
    assert each == [("error", "link_down", "why")] * 20
    assert rest[1] == "limit" and rest[2].startswith("31 more failures ")
    assert rest[2].endswith("no link is up")
    send_in_vain(world, publisher, 12)
    world.settle()
    assert world.told[-1] == ("error", "link_down", "why")


def test_failures_that_were_too_many_are_told_at_the_end(world, monkeypatch, capsys):
    monkeypatch.setattr(swarmtalk, "_EVENTS_MAX", 10)
    world.client.on_error = world.client._print_once_a_second
    publisher = world.client.advertise("a", queue=1)
    for _ in range(50):
        send_in_vain(world, publisher, 12)
    world.client.close()
    first, rest = capsys.readouterr().err.splitlines()
    assert first.endswith("why (20 times)") and "30 more failures " in rest


def test_nothing_is_kept_of_messages_that_were_dropped_as_asked(world):
    publisher = world.client.advertise("a", queue=1, drop_oldest=True)
    for _ in range(100):
        send_in_vain(world, publisher, 14)
    assert len(publisher._in_flight) < 100, "it has looked"
    assert len(world.client._events) == 0


def test_what_threads_and_calls_queue_is_written_when_there_is_room_again(world):
    publisher = world.client.advertise("a", queue=1000)
    while publisher.send(b"x" * 50000):
        pass
    before = len(world.daemon.of(PUBLISH))
    world.client.process()  # writes nothing: the daemon has not read
    assert len(world.daemon.of(PUBLISH)) == before
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.client.set_pose(1, 2, 3)
    world.client.sync()  # waits for the daemon to read all that is before it
    assert world.daemon.poses() == [1]


# asyncio

@pytest.mark.parametrize("what", ["publisher", "client"])
def test_async_send_ends_with_its_publisher(world, what):
    publisher = world.client.advertise("a", queue=5)
    world.meet()

    async def scene():
        waiting = [publisher.async_send("1"), publisher.async_send("2")]
        (publisher if what == "publisher" else world.client).close()
        with pytest.raises(swarmtalk.Error, match="closed before it was known") as raised:
            await waiting[1]
        assert raised.value.code == "disconnected" and waiting[0].done()
    asyncio.run(scene())


def test_async_send_raises_a_refusal_and_forgets_the_message(world):
    publisher = world.client.advertise("a", queue=0, sent=True)
    id_ = world.daemon.newest_id(ADVERTISE)

    async def scene():
        first = publisher.async_send("1")
        with pytest.raises(swarmtalk.Error, match="1 message has not left yet") as raised:
            publisher.async_send("2")
        assert raised.value.code == "busy" and not isinstance(raised.value, swarmtalk.BadArgument)
        await Turn()
        world.daemon.serve()
        world.daemon.tell(field(SENT, field(1, id_) + field(2, 1)))
        await first
        second = publisher.async_send("3")
        await Turn()
        world.daemon.serve()
        world.daemon.drop()
        with pytest.raises(swarmtalk.Error, match="not connected") as raised:
            await second
        assert raised.value.code == "disconnected"
    in_a_loop(world, scene)
    assert [each[3] for each in world.daemon.of(PUBLISH)] == [b"1", b"3"]


def test_an_iteration_that_is_cancelled_takes_no_message(world):
    subscriber = world.client.subscribe("b")
    id_ = world.daemon.newest_id(SUBSCRIBE)

    async def scene():
        waiting = [asyncio.ensure_future(subscriber.__anext__()) for _ in range(3)]
        await Turn()
        waiting[0].cancel()
        waiting[1].cancel()
        await Turn()
        world.daemon.deliver(id_, "one")
        assert (await waiting[2]).text == "one"
        world.daemon.deliver(id_, "two")
        return (await subscriber.__anext__()).text
    assert in_a_loop(world, scene) == "two"


def test_a_task_that_is_cancelled_just_when_its_message_comes_does_not_lose_it(world):
    """As wait_for() does."""
    subscriber = world.client.subscribe("b")
    id_ = world.daemon.newest_id(SUBSCRIBE)

    async def scene():
        async def wait():
            return await subscriber.__anext__()
        task, other = asyncio.ensure_future(wait()), asyncio.ensure_future(wait())
        await Turn()
        world.daemon.deliver(id_, "one")
        world.client.process()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        return (await other).text
    assert in_a_loop(world, scene) == "one"


def test_an_iteration_goes_on_waiting_when_what_came_was_too_old(world):
    subscriber = world.client.subscribe("b", no_older_than=1)
    id_ = world.daemon.newest_id(SUBSCRIBE)

    async def scene():
        waiting = asyncio.ensure_future(subscriber.__anext__())
        await Turn()
        for text, age in (("old", 2), ("new", 0)):
            world.daemon.tell(field(DELIVER, field(1, id_) + field(2, text) + field(
                12, int((world.now - age) * 1e9))))
            for _ in range(3):
                await Turn()
        message = await waiting
        return message.text, message.lost_before.client
    assert in_a_loop(world, scene) == ("new", 1)


def test_iterations_end_when_the_client_is_closed(world):
    subscriber = world.client.subscribe("b")

    async def scene():
        waiting = asyncio.ensure_future(subscriber.__anext__())
        await Turn()
        world.client.close()
        with pytest.raises(StopAsyncIteration):
            await waiting
        return [message async for message in subscriber]
    assert in_a_loop(world, scene) == []


def test_an_event_loop_that_ends_takes_its_readers_along(world):
    """The client goes over to a loop while the one of before is left open."""
    loops = [asyncio.new_event_loop() for _ in range(2)]
    try:
        for loop in loops:
            assert world.client.attach(loop) is loop and world.client.attach(loop) is loop
        assert not loops[0].remove_reader(world.client.fileno())
        assert loops[1]._selector.get_key(world.client.fileno())
        fileno = world.client.fileno()
        world.client.close()
        assert not loops[1].remove_reader(fileno)
    finally:
        for loop in loops:
            loop.close()


def test_a_client_in_a_loop_that_runs_goes_over_to_no_other(world):
    other = asyncio.new_event_loop()

    async def scene():
        world.client.attach()
        with pytest.raises(swarmtalk.BadArgument, match="attached to another event loop"):
            world.client.attach(other)
    try:
        in_a_loop(world, scene)
    finally:
        other.close()


def test_what_nobody_waits_for_any_more_takes_no_message(world):
    """A future of a loop that has ended."""
    subscriber = world.client.subscribe("b")
    id_ = world.daemon.newest_id(SUBSCRIBE)

    async def turn():
        await Turn()

    async def hear():
        world.client.attach()
        return (await subscriber.__anext__()).text
    for is_attached in (True, False):
        loop = asyncio.new_event_loop()
        waiting = loop.create_task(hear())
        loop.run_until_complete(turn())
        loop.close()
        world.daemon.deliver(id_, "x")
        if is_attached:
            assert in_a_loop(world, hear) == "x"
        else:
            world.client.process()
            assert [each.text for each in subscriber.take()] == ["x"]
        waiting._log_destroy_pending = False


def test_outside_a_coroutine_the_loop_of_before_is_taken_while_it_is_open(world):
    loop = asyncio.new_event_loop()
    try:
        assert world.client.attach(loop) is loop
        assert world.client.attach() is loop
    finally:
        loop.close()
    with pytest.raises(swarmtalk.BadArgument, match="need a running event loop"):
        world.client.attach()
