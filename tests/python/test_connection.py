"""The Python client's connection: attempts, greeting, requests, losses, with a daemon that is a
script and a clock that stands still, so that nothing depends on how long it takes."""
import gc
import os

import pytest

import swarmtalk
from local_frames import field, frame
from scripted_daemon import (ADVERTISE, ADVERTISED, CLIENT_LOSS, DELIVER, DONE, FAILURE, GREETING,
                             HELLO, PUBLISH, SENT, SUBSCRIBE, UNADVERTISE, UNSUBSCRIBE)

pytestmark = pytest.mark.logic


def times_of_attempts(world, seconds):
    """When the client tried, while the daemon closes each connection at once."""
    times = []

    def close():
        if world.daemon.connection is not None:
            times.append(world.now)
            world.daemon.drop()
    world.pass_time(seconds, close)
    return times


def pauses(times):
    return [later - earlier for earlier, later in zip(times, times[1:])]


def test_the_pauses_between_attempts_grow_to_a_quarter_of_a_second(world):
    world.daemon.greeting = None
    world.daemon.start()
    found = pauses(times_of_attempts(world, 10))
    assert 40 <= len(found) <= 90
    for number, pause in enumerate(found):
        longest = min(0.25, 0.02 * 2**number)
        assert longest / 2 <= pause + 1e-6 and pause <= longest + 0.003, (number, found[:8])


def test_after_a_success_the_pauses_begin_anew(world):
    world.daemon.greeting = None
    world.daemon.start()
    times_of_attempts(world, 3)
    world.daemon.greeting = field(HELLO, GREETING)
    world.pass_time(0.3)
    assert world.client.connected
    world.daemon.greeting = None
    begin = world.now
    world.daemon.drop()
    found = times_of_attempts(world, 0.5)
    assert found[0] - begin <= 0.023 and pauses(found)[0] <= 0.043


def test_a_daemon_that_goes_is_told_once_however_long_it_stays_away(world):
    world.meet()
    for times in (1, 2):
        world.daemon.greeting = None
        world.daemon.drop()
        times_of_attempts(world, 2)
        world.daemon.stop()
        world.pass_time(1)
        world.daemon.greeting = field(HELLO, GREETING)
        world.meet()
        assert [each[0] for each in world.told] == ["lost", "back"] * times, world.told


def test_another_version_is_told_once_and_tried_seldom(world):
    world.daemon.greeting = field(HELLO, field(1, swarmtalk._MAJOR + 1) + field(4, "swarmtalkd 99"))
    world.daemon.start()
    world.pass_time(0.1)
    assert [each[:2] for each in world.told] == [("error", "version_mismatch")]
    assert "swarmtalkd 99" in world.told[0][2] and "update the older" in world.told[0][2]
    assert world.daemon.attempts == 1, "the first pause is as long as the longest"
    world.pass_time(4.9)
    assert 20 <= world.daemon.attempts <= 42 and len(world.told) == 1


def test_a_daemon_that_is_silent_is_told_of_once_and_left_after_the_timeout(world):
    world.daemon.greeting = None
    world.daemon.start()
    world.client.connect_timeout = 1.5
    world.pass_time(1.49)
    assert world.told == [] and world.daemon.attempts == 1
    world.pass_time(4)
    assert [each[:2] for each in world.told] == [("error", "timeout")]
    assert "did not answer within 1.5 s" in world.told[0][2]
    assert world.daemon.attempts >= 3
    world.daemon.greeting = field(HELLO, GREETING)
    world.pass_time(2)
    assert world.client.connected and world.client.node_id == 77


def test_connect_waits_for_the_daemon_or_says_why_not(world):
    with pytest.raises(swarmtalk.Error, match="does not exist") as failed:
        world.client.connect()
    assert failed.value.code == "no_daemon"
    world.daemon.greeting = None
    world.daemon.start()
    begin = world.now
    with pytest.raises(swarmtalk.Error, match="did not answer within 2 s"):
        world.client.connect()
    assert 1.9 < world.now - begin < 2.3
    world.daemon.greeting = field(HELLO, GREETING)
    world.client.connect()
    assert world.client.connected and world.told == []


def test_all_that_is_registered_is_registered_again_with_the_next_daemon(world):
    world.client.process()  # nobody is there
    publisher = world.client.advertise("a")
    subscriber = world.client.subscribe("b", lambda message: world.heard.append(message.text))
    world.told.clear()
    world.meet()
    assert [each[0] for each in world.daemon.requests] == [HELLO, ADVERTISE, SUBSCRIBE]
    assert publisher.status is None and subscriber.status is None
    first = world.daemon.requests[2][1]  # the script's ids are the requests' numbers
    world.daemon.deliver(first, "one")
    world.settle()
    world.daemon.drop()
    world.pass_time(0.3)
    assert [each[0] for each in world.daemon.requests[3:]] == [HELLO, ADVERTISE, SUBSCRIBE]
    second = world.daemon.requests[5][1]
    assert second != first
    world.daemon.deliver(first, "for nobody")
    world.daemon.deliver(second, "two")
    world.settle()
    assert world.heard == ["one", "two"]
    assert world.told == [("lost", "lost swarmtalkd: it closed the connection; reconnecting"),
                          ("back",)]


def test_a_refusal_at_a_new_connection_is_told_and_the_handle_keeps_it(world):
    world.client.process()
    publisher = world.client.advertise("a")
    world.told.clear()
    world.daemon.answers[ADVERTISE] = lambda _: field(FAILURE,
                                                      field(1, 2) + field(2, "no such ttl"))
    world.meet()
    assert [each[0::2] for each in world.told] == [("error", "no such ttl")]
    assert publisher.status.text == "no such ttl"
    assert not publisher.send(b"x")


def test_frames_may_come_in_pieces_and_many_at_once(world):
    world.client.process()
    world.client.subscribe("b", lambda message: world.heard.append(message.text))
    world.meet()
    subscriber = world.daemon.requests[1][1]
    whole = b"".join(frame(field(DELIVER, field(1, subscriber) + field(2, text)))
                     for text in ("one", "two"))
    for byte in whole:
        world.daemon.connection.sendall(bytes([byte]))
        world.client.process()
    assert world.heard == ["one", "two"]
    world.daemon.connection.sendall(whole * 50)
    world.settle()
    assert world.heard == ["one", "two"] * 51


@pytest.mark.parametrize("bytes_", [b"\0\0\0\0", b"\1\0\1\0", b"\xff" * 8,
                                    frame(b"\x6a\xff"), frame(b"\x0d\1"), frame(b"\x07")])
def test_what_is_not_the_protocol_ends_the_connection_with_a_word(world, bytes_):
    world.meet()
    world.daemon.connection.sendall(bytes_)
    world.pass_time(0.3)
    assert world.told == [("lost", "swarmtalkd sent something that is not the protocol"),
                          ("back",)]


def test_what_a_newer_daemon_adds_is_left_alone(world):
    world.client.process()
    world.client.subscribe("b", lambda message: world.heard.append(message.text))
    world.meet()
    subscriber = world.daemon.requests[1][1]
    world.daemon.tell(field(900, "news"), field(DELIVER, field(1, subscriber) + field(2, "x")
                                                + field(800, 5)))
    world.settle()
    assert world.client.connected and world.heard == ["x"]


def advertise(world, **options):
    """A publisher with the script's daemon; (it, its id)."""
    world.daemon.answers[ADVERTISE] = lambda number: field(
        ADVERTISED, field(1, number) + field(2, 5) + field(3, 60000) + field(4, 7))
    publisher = world.client.advertise("a", **options)
    return publisher, next(each[1] for each in reversed(world.daemon.requests)
                           if each[0] == ADVERTISE)


def left(publisher, number):
    return field(SENT, field(1, publisher) + field(2, number))


def failed(publisher, number, text):
    return field(FAILURE, field(1, 5) + field(2, text) + field(4, publisher) + field(5, number))


def test_each_message_has_one_end_and_gives_its_room_back(world):
    world.meet()
    ends = []
    publisher, id_ = advertise(world, queue=2, sent=lambda error: ends.append(
        error and error.text))
    assert [bool(publisher.send(b"%d" % i)) for i in range(4)] == [True, True, True, False]
    assert publisher.busy()
    world.settle()
    assert [each[3] for each in world.daemon.of(PUBLISH)] == [b"0", b"1", b"2"]
    assert [each[2] for each in world.daemon.of(PUBLISH)] == [1, 2, 3]
    world.daemon.tell(left(id_, 1), failed(id_, 2, "lost"), left(id_, 1), left(id_, 9))
    world.settle()
    assert ends == [None, "lost"] and not publisher.busy()
    assert [bool(publisher.send(b"x")) for _ in range(3)] == [True, True, False]
    world.settle()
    world.daemon.drop()
    world.pass_time(0.3)
    assert ends[:2] == [None, "lost"] and len(ends) == 5
    assert all("not connected" in text for text in ends[2:]), ends
    assert publisher.send(b"again"), "the next daemon begins with nothing"


def test_one_word_ends_all_messages_before_it_where_nobody_looks_at_each(world):
    world.meet()
    publisher, id_ = advertise(world, queue=9)
    assert world.daemon.of(ADVERTISE)[0][8] == 2
    assert all([publisher.send(b"x") for _ in range(10)]) and publisher.busy()
    world.settle()
    world.daemon.tell(left(id_, 4))
    world.settle()
    assert [bool(publisher.send(b"x")) for _ in range(5)] == [True] * 4 + [False]


def test_what_was_refused_here_is_told_to_the_daemon_each_once(world):
    world.meet()
    publisher, id_ = advertise(world, queue=1)
    assert [bool(publisher.send(b"x")) for _ in range(7)] == [True] * 2 + [False] * 5
    world.settle()
    assert [each[4] for each in world.daemon.of(CLIENT_LOSS)] == [1]  # without process()
    world.now += 3
    world.client.process()
    world.settle()
    told = world.daemon.of(CLIENT_LOSS)
    assert {each[3] for each in told} == {id_} and sum(each[4] for each in told) == 5
    assert not publisher.send(b"x")
    world.pass_time(3)
    assert sum(each[4] for each in world.daemon.of(CLIENT_LOSS)) == 6


def test_what_a_queue_here_dropped_is_told_to_the_daemon_once(world):
    world.meet()
    subscriber = world.client.subscribe("b", keep_last=2)
    id_ = next(each[1] for each in world.daemon.requests if each[0] == SUBSCRIBE)
    for i in range(5):
        world.daemon.deliver(id_, str(i))
    world.pass_time(1)
    assert world.daemon.of(CLIENT_LOSS) == [{1: id_, 2: 3}]
    assert [message.text for message in subscriber.take()] == ["3", "4"]
    world.daemon.deliver(id_, "5")
    world.pass_time(1)
    assert [(message.text, message.lost_before.client) for message in subscriber.take()] == [
        ("5", 0)]
    assert len(world.daemon.of(CLIENT_LOSS)) == 1
    for i in range(3):
        world.daemon.deliver(id_, str(i))
    world.pass_time(1)
    assert world.daemon.of(CLIENT_LOSS)[1:] == [{1: id_, 2: 1}]


@pytest.mark.parametrize("is_fetched", [True, False])
def test_what_grew_too_old_while_it_waited_here_is_counted_instead(world, is_fetched):
    world.meet()
    receive = None if is_fetched else world.heard.append
    subscriber = world.client.subscribe("b", receive, no_older_than=0.2)
    (wanted,), id_ = world.daemon.of(SUBSCRIBE), world.daemon.newest_id(SUBSCRIBE)
    assert wanted[7] == 200
    at = round(world.now * 1e9)
    for text, received_ns, delay_us in (("one", at, 0), ("two", at + 150_000_000, 0),
                                        ("three", at + 250_000_000, 251_000),
                                        ("four", at + 250_000_000, 199_000)):
        world.daemon.tell(field(DELIVER, field(1, id_) + field(2, text) + field(12, received_ns)
                                + (field(11, delay_us) if delay_us else b"")))
    world.now += 0.25
    world.settle()
    heard = subscriber.take() if is_fetched else world.heard
    assert [(each.text, each.lost_before.client) for each in heard] == [("two", 1), ("four", 1)]
    world.client.process()
    world.settle()
    assert sum(each[2] for each in world.daemon.of(CLIENT_LOSS)) == 2


def test_gaps_are_told_to_the_program_with_the_message_after_them(world):
    world.meet()
    world.client.on_gap = lambda message: world.told.append(message.lost_before.air)
    subscriber = world.client.subscribe("b")
    id_ = world.daemon.newest_id(SUBSCRIBE)
    for lost in (0, 3, 0):
        world.daemon.tell(field(DELIVER, field(1, id_) + field(2, "x")
                                + (field(16, field(1, lost)) if lost else b"")))
    world.settle()
    assert [message.lost_before.air for message in subscriber.take()] == [0, 3, 0]
    assert world.told == [3]


def test_refusals_that_nobody_looks_at_are_told_once_a_second_with_their_number(world, capsys):
    world.meet()
    publisher, _ = advertise(world, queue=1)
    for _ in range(2 + 3):
        publisher.send(b"x")
    world.now += 1
    publisher.send(b"x")
    world.client.process()
    lines = [line for line in capsys.readouterr().err.splitlines() if "not sent" in line]
    assert len(lines) == 2, lines
    assert "a message was not sent, and nobody looked at what send() returned" in lines[0]
    assert "2 messages were not sent, and nobody looked" in lines[1]
    assert "2 messages have not left yet; send more slowly" in lines[1]


def test_a_connection_that_ends_leaves_no_descriptor_behind(world):
    world.meet()

    gc.collect()

    def opened():
        return len(os.listdir("/proc/self/fd"))
    before = opened()
    for _ in range(5):
        world.daemon.drop()
        world.pass_time(0.3)
        assert world.client.connected
    assert opened() == before


def test_what_the_socket_does_not_take_at_once_follows_in_order(world):
    world.meet()
    publisher, _ = advertise(world, queue=1000)
    taken = 0
    while publisher.send(b"%06d" % taken + b"x" * 50000):
        taken += 1
        assert taken < 1000, "a daemon that does not read never makes it wait"
    refused = publisher.send(b"y")
    assert refused.code == "busy" and "does not read" in refused.text
    world.settle()
    assert [each[3][:6] for each in world.daemon.of(PUBLISH)] == [b"%06d" % i
                                                                  for i in range(taken)]
    assert publisher.send(b"y")
    world.settle()
    # The same with the next daemon, which begins with nothing.
    while publisher.send(b"x" * 50000):
        pass
    world.daemon.drop()
    world.pass_time(0.3)
    world.daemon.requests.clear()
    for taken in range(12):
        assert publisher.send(b"%06d" % taken + b"x" * 50000)
    world.settle()
    assert [each[3][:6] for each in world.daemon.of(PUBLISH)] == [b"%06d" % i for i in range(12)]


@pytest.mark.parametrize("told", [None, True, False])
def test_when_a_message_was_sent_is_told_where_the_daemon_has_a_use_for_it(world, told):
    world.meet()
    world.daemon.answers[ADVERTISE] = lambda number: field(
        ADVERTISED, field(1, number) + field(3, 100) + (b"" if told is None else field(5, told)))
    world.client.advertise("a").send(b"x")
    world.settle()
    assert world.daemon.of(PUBLISH)[0].get(5) == (None if told is False else int(
        world.now * 1e9))


def test_a_handle_that_is_closed_is_told_once_and_hears_nothing_more(world):
    world.meet()
    world.daemon.answers[UNSUBSCRIBE] = world.daemon.answers[UNADVERTISE] = lambda _: field(
        DONE, b"")
    subscriber = world.client.subscribe("b", lambda message: world.heard.append(message.text))
    publisher = world.client.advertise("b")
    ids = {each[0]: each[1] for each in world.daemon.requests}
    for each in (subscriber, publisher, subscriber):
        each.close()
    world.daemon.deliver(ids[SUBSCRIBE], "late")
    world.pass_time(1)
    assert world.heard == []
    assert world.daemon.of(UNSUBSCRIBE) == [{1: ids[SUBSCRIBE]}]
    assert world.daemon.of(UNADVERTISE) == [{1: ids[ADVERTISE]}]
    assert not publisher.send(b"x")
    world.daemon.drop()
    world.pass_time(0.3)
    assert [each[0] for each in world.daemon.requests][-1] == HELLO  # and registers neither
