"""What a program of the Python client calls, and what it gets, with a daemon that is a script and
a clock that stands still unless the client waits (docs/python.md)."""
import asyncio

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, FAILURE, GREETING, HELLO, PUBLISH, SENT, SET_POSE,
                             SUBSCRIBE, SUBSCRIBED, UNSUBSCRIBE, advertised)

pytestmark = pytest.mark.logic
PATIENCE_S = 60


@pytest.fixture(name="world")
def meet_world(world):
    world.meet()
    return world


def at(world, time, act):
    """Does something at a time of the daemon's."""
    serve = world.daemon.serve

    def then():
        if world.now >= time and world.daemon.serve is then:
            world.daemon.serve = serve
            act()
            return True
        return serve()
    world.daemon.serve = then


def subscribed(world, *arguments, **options):
    """A subscriber, and the id that the daemon knows it by."""
    subscriber = world.client.subscribe(*arguments, **options)
    return subscriber, world.daemon.newest_id(SUBSCRIBE)


def test_get_waits_for_a_message_and_no_longer_than_it_is_asked(world):
    subscriber, id_ = subscribed(world, "b")
    begin = world.now
    assert subscriber.get(0.5) is None
    assert 0.5 <= world.now - begin < 0.51
    at(world, world.now + 0.3, lambda: world.daemon.deliver(id_, b"one"))
    begin = world.now
    assert subscriber.get(10).text == "one"
    assert 0.3 <= world.now - begin < 0.31
    world.daemon.deliver(id_, b"two")
    world.daemon.deliver(id_, b"three")
    world.settle()
    assert subscriber.get(0).text == "two" and subscriber.get().text == "three"
    assert subscriber.get(0) is None


def test_iteration_waits_for_each_message_until_stop(world):
    subscriber, id_ = subscribed(world, "b")
    texts = []
    for text in ("one", "two"):
        world.daemon.deliver(id_, text)
    for message in subscriber:
        texts.append(message.text)
        if len(texts) == 2:
            at(world, world.now + 1, world.client.stop)
    assert texts == ["one", "two"]
    world.client.stop()  # before anybody waits: the next one returns, once
    assert subscriber.get(5) is None
    world.daemon.deliver(id_, "three")
    assert subscriber.get(5).text == "three"


def test_run_lasts_as_long_as_it_is_asked_or_until_stop(world):
    begin = world.now
    world.client.run(2)
    assert 2 <= world.now - begin < 2.01
    begin = world.now
    world.client.run(0)
    assert world.now == begin
    _, id_ = subscribed(world, "b", lambda message: (world.heard.append(message.text),
                                                     world.client.stop()))
    for time, text in ((0.25, "one"), (0.5, "two")):
        at(world, begin + time, lambda each=text: world.daemon.deliver(id_, each))
        world.client.run()
        assert begin + time <= world.now < begin + time + 0.01
    assert world.heard == ["one", "two"]


def test_a_callback_cannot_wait_and_is_told_so(world):
    refused = []

    def receive(_):
        for wait in (world.client.process, world.client.run):
            with pytest.raises(swarmtalk.BadArgument, match="inside a callback") as raised:
                wait()
            refused.append(raised.value.code)
    _, id_ = subscribed(world, "b", receive)
    world.daemon.deliver(id_, "x")
    world.client.run(0.1)
    assert refused == ["bad_argument"] * 2


def test_a_callback_that_raises_leaves_the_rest_for_the_next_call(world):
    def receive(message):
        world.heard.append(message.text)
        if message.text == "one":
            raise KeyError("mine")
    _, id_ = subscribed(world, "b", receive)
    for text in ("one", "two"):
        world.daemon.deliver(id_, text)
    with pytest.raises(KeyError, match="mine"):
        world.client.run(1)
    assert world.heard == ["one"]
    world.settle()  # the descriptor says that there is more
    assert world.heard == ["one", "two"]


def test_stop_iteration_in_a_callback_comes_out_as_any_exception(world):
    world.daemon.answers[ADVERTISE] = advertised()
    texts = iter(())
    publisher = world.client.advertise("a", sent=lambda _: publisher.send(next(texts)))
    publisher.send("x")
    world.daemon.serve()
    world.daemon.tell(field(SENT, field(1, world.daemon.newest_id(ADVERTISE)) + field(2, 1)))
    with pytest.raises(StopIteration):
        world.client.process()
    _, id_ = subscribed(world, "b", lambda _: next(texts))
    world.daemon.deliver(id_, "x")
    with pytest.raises(StopIteration):
        world.client.process()
    assert world.client.process()


def test_what_a_callback_says_leaves_at_once(world):
    publisher = world.client.advertise("a")
    during = []

    def receive(_):
        assert publisher.send("x") and publisher.send("y")
        world.client.set_pose(1, 0, 0)
        world.daemon.serve()
        during.append([len(world.daemon.of(each)) for each in (PUBLISH, SET_POSE)])
    world.daemon.answers[ADVERTISE] = advertised()
    publisher = world.client.advertise("a")
    _, id_ = subscribed(world, "b", receive)
    world.daemon.deliver(id_, "x")
    world.client.process()
    world.settle()
    assert during == [[2, 1]] and [each[3] for each in world.daemon.of(PUBLISH)] == [b"x", b"y"]


def test_send_refuses_what_the_channel_does_not_carry(world):
    world.daemon.answers[ADVERTISE] = advertised(max_bytes=4, max_ttl=3)
    publisher = world.client.advertise("a")
    assert publisher.channel_number == 5 and publisher.max_message_bytes == 4
    assert publisher.status is None
    assert publisher.send(b"1234", ttl=3)
    with pytest.raises(swarmtalk.BadArgument, match="has 5 bytes; channel a carries at most 4"):
        publisher.send(b"12345")
    with pytest.raises(swarmtalk.BadArgument, match="a TTL of 4; channel a carries at most 3"):
        publisher.send(b"1", ttl=4)
    with pytest.raises(TypeError):
        publisher.send(5)
    world.settle()
    assert [(each[3], each[4]) for each in world.daemon.of(PUBLISH)] == [(b"1234", 3)]


def test_send_says_that_there_is_no_daemon_and_that_a_handle_is_closed(world):
    world.daemon.answers[ADVERTISE] = advertised()
    publisher, other = world.client.advertise("a"), world.client.advertise("b")
    other.close()
    refused = other.send("x")
    assert not refused and (refused.code, refused.text) == ("disconnected",
                                                            "this handle was closed")
    assert other.status.text == "this handle was closed"
    world.daemon.stop()
    # The first notices it, or is lost on its way; then it is known.
    publisher.send("x")
    world.client.process()
    refused = publisher.send("x")
    assert not refused and refused.code == "disconnected" and not publisher.busy()
    assert publisher.status.code == "disconnected" and not world.client.connected
    world.client.close()
    assert publisher.send("x").text == "the Client of this handle is closed"


def test_a_message_whose_write_finds_no_daemon_is_refused_and_not_waited_for(world):
    world.daemon.answers[ADVERTISE] = advertised()
    publisher = world.client.advertise("a", queue=0)
    world.daemon.drop()
    world.daemon.greeting = None
    assert publisher.send("x").code == "disconnected"
    assert publisher.send("x").code == "disconnected"
    world.daemon.greeting = field(HELLO, GREETING)
    world.meet()
    assert not publisher.busy() and publisher.send("y") and publisher.busy()


def test_a_channels_number_is_known_to_both_ends_and_refusals_are_raised(world):
    assert world.client.subscribe("b").channel_number == 5
    world.daemon.answers[SUBSCRIBE] = lambda _: field(FAILURE, field(1, 7) + field(2, "no room"))
    with pytest.raises(swarmtalk.Error, match="^no room$") as raised:
        world.client.subscribe("c")
    assert raised.value.code == "limit"
    del world.daemon.answers[SUBSCRIBE]
    begin = world.now
    with pytest.raises(swarmtalk.Error, match="did not answer in time"):
        world.client.subscribe("d")
    assert 0.99 < world.now - begin < 1.1
    # Neither is registered with the next daemon.
    world.daemon.answers[SUBSCRIBE] = lambda number: field(SUBSCRIBED, field(1, number)
                                                           + field(2, 5))
    before = len(world.daemon.of(SUBSCRIBE))
    world.daemon.drop()
    world.pass_time(0.3)
    assert [each[1] for each in world.daemon.of(SUBSCRIBE)[before:]] == [field(1, "b")]


def test_with_blocks_close_what_they_opened(world):
    with world.client:
        with world.client.subscribe("b") as subscriber:
            id_ = world.daemon.newest_id(SUBSCRIBE)
            assert subscriber.status is None
        assert subscriber.get(0) is None
        world.settle()
        assert [each[1] for each in world.daemon.of(UNSUBSCRIBE)] == [id_]
    assert not world.client.connected
    with pytest.raises(swarmtalk.Error, match="closed"):
        world.client.process()
    world.client.close()  # once more does nothing


def test_errors_without_a_function_are_printed_once_a_second_each(world, capsys):
    printing = swarmtalk.Client("other", world.daemon.path, connect=False)
    try:
        for seconds, codes in ((0, (7, 7, 10)), (0.99, (7,)), (0.02, (7,))):
            world.now += seconds
            for code in codes:
                printing.on_error(swarmtalk._error(swarmtalk._CODES[code], "text %d" % code))
        assert capsys.readouterr().err.splitlines() == [
            "swarmtalk: text 7", "swarmtalk: text 10",
            "swarmtalk: text 7 (3 times since the last line)"]
        printing.on_error(swarmtalk._error(swarmtalk._CODES[7], "text 7"))
    finally:
        printing.close()
    assert capsys.readouterr().err == "swarmtalk: text 7 (1 time since the last line)\n"


@pytest.mark.parametrize("name, words", [
    ("on_messages", "messages are handed to the function"), ("on_eror", "did you mean 'on_error'"),
    ("on_foo", "it has"), ("request_timeouts", "did you mean 'request_timeout'")])
def test_what_is_nearly_an_attribute_of_a_client_is_no_new_one(world, name, words):
    with pytest.raises(AttributeError, match=words):
        setattr(world.client, name, print)
    world.client.mine = 5
    assert world.client.mine == 5
    with pytest.raises(swarmtalk.BadArgument):
        world.client.request_timeout = "long"


def test_a_program_need_not_look_at_losses_of_its_daemon(world):
    world.client.on_disconnect = world.client.on_reconnect = world.client.on_error = None
    world.daemon.drop()
    world.pass_time(0.5)
    assert world.client.connected


def test_a_program_that_ends_without_an_answer_is_told(world, capsys):
    world.daemon.answers[ADVERTISE] = advertised()
    client = world.client
    client.on_error = client._print_once_a_second
    assert client.advertise("a").send("x")
    client.close()
    assert capsys.readouterr().err == ("swarmtalk: swarmtalkd did not answer when this program "
                                       "ended: whether its last messages left is not known\n")


# asyncio: the loop calls process() when the client's descriptor is readable; the daemon is served
# between its turns.

class Turn:
    def __await__(self):
        yield


def in_a_loop(world, scene):
    async def serve():
        while True:
            world.daemon.serve()
            await Turn()

    async def both():
        serving = asyncio.ensure_future(serve())
        try:
            return await asyncio.wait_for(scene(), PATIENCE_S)
        finally:
            serving.cancel()
    return asyncio.run(both())


def test_async_iteration_waits_for_messages_in_their_order_and_ends_with_the_subscriber(world):
    subscriber, id_ = subscribed(world, "b")

    async def scene():
        texts = []
        first = asyncio.ensure_future(subscriber.__anext__())
        second = asyncio.ensure_future(subscriber.__anext__())
        await Turn()
        for text in ("one", "two", "three"):
            world.daemon.deliver(id_, text)
        texts += [(await first).text, (await second).text]
        async for message in subscriber:
            texts.append(message.text)
            asyncio.get_running_loop().call_soon(subscriber.close)
        return texts
    assert in_a_loop(world, scene) == ["one", "two", "three"]


def test_async_send_waits_until_the_message_has_left_or_says_why_it_never_will(world):
    world.daemon.answers[ADVERTISE] = advertised()
    publisher = world.client.advertise("a", sent=True)
    id_ = world.daemon.newest_id(ADVERTISE)

    async def scene():
        one, two = publisher.async_send("1"), publisher.async_send("2")
        await Turn()
        assert not one.done()
        world.daemon.serve()
        world.daemon.tell(field(FAILURE, field(1, 13) + field(2, "no link") + field(4, id_)
                                + field(5, 1)), field(SENT, field(1, id_) + field(2, 2)))
        assert await two is None
        with pytest.raises(swarmtalk.Error, match="no link"):
            await one
        with pytest.raises(swarmtalk.BadArgument):
            publisher.async_send("x" * 11)
    in_a_loop(world, scene)
    with pytest.raises(swarmtalk.BadArgument, match="sent=True"):
        world.client.advertise("a", queue=16).async_send("x")


def test_an_attached_client_goes_over_to_the_next_loop(world):
    subscriber, id_ = subscribed(world, "b")
    for text in ("one", "two"):
        async def scene(each=text):
            assert world.client.attach() is asyncio.get_running_loop()
            coming = asyncio.ensure_future(subscriber.__anext__())
            await Turn()
            world.daemon.deliver(id_, each)
            return (await coming).text
        assert in_a_loop(world, scene) == text
    with pytest.raises(swarmtalk.BadArgument, match="need a running event loop"):
        world.client.attach()
