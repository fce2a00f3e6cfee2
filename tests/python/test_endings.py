"""What a program is told when it ends, and what is left of its Client then: after close(), after a
fork, and when the daemon says why it ends. With a daemon that is a script and a clock that stands
still unless the client waits."""
import copy
import gc
import os
import pickle
import threading

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, CLIENT_LOSS, DELIVER, DONE, FAILURE, GET_POSE, HELLO, POSE,
                             PUBLISH, SENT, SUBSCRIBE, UNSUBSCRIBE, advertised)

pytestmark = pytest.mark.logic
PATIENCE_S = 60


@pytest.fixture(name="world")
def meet_world(world):
    world.daemon.answers[ADVERTISE] = advertised(60000)
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    world.meet()
    return world


@pytest.fixture(name="printing")
def make_printing(world):
    """A client that prints its errors, as one does whose program sets no functions."""
    world.client.on_error = world.client._print_once_a_second
    return world.client


def lines(capsys):
    return [line[len("swarmtalk: "):] for line in capsys.readouterr().err.splitlines()]


def failed(publisher, number, text, code=12):
    return field(FAILURE, field(1, code) + field(2, text) + field(4, publisher) + field(5, number))


def answer_get_pose_with(world, *envelopes):
    """All that the daemon has to say comes before the answer that the end waits for."""
    def answer(_):
        world.daemon.tell(*envelopes)
        return field(POSE, b"")
    world.daemon.answers[GET_POSE] = answer


def test_the_end_tells_what_was_refused_with_how_often(world, printing, capsys):
    publisher, other = printing.advertise("a"), printing.advertise("b")
    ids = [each[1] for each in world.daemon.requests if each[0] == ADVERTISE]
    for _ in range(4):
        publisher.send("x")
    other.send("x")
    answer_get_pose_with(
        world, failed(ids[0], 1, "no link is up"), failed(ids[0], 2, "too fast", 15),
        failed(ids[0], 3, "no link is up"), failed(ids[0], 4, "newer", 14),
        failed(ids[1], 1, "no link is up"))
    printing.close()
    assert lines(capsys) == ["a message was not sent: no link is up (3 times)",
                             "a message was not sent: too fast"]
    assert len(world.daemon.of(PUBLISH)) == 5


def test_the_end_tells_nothing_when_all_have_left_or_nothing_was_sent(world, printing, capsys):
    publisher = printing.advertise("a", queue=0)
    id_ = world.daemon.newest_id(ADVERTISE)
    assert publisher.send("x")
    answer_get_pose_with(world, field(SENT, field(1, id_) + field(2, 1)))
    printing.close()
    assert lines(capsys) == []
    with swarmtalk.Client("other", world.daemon.path, connect=False) as other:
        world.daemon.drop()
        other.connect()
        other.advertise("a")
        world.daemon.requests.clear()
    assert lines(capsys) == []
    world.daemon.serve()
    assert world.daemon.of(GET_POSE) == [], "it has nothing to wait for"


def test_what_a_closed_publisher_sent_is_told_too(world, printing, capsys):
    publisher = printing.advertise("a")
    id_ = world.daemon.newest_id(ADVERTISE)
    publisher.send("x")
    publisher.send("y")
    world.daemon.serve()
    publisher.close()
    world.daemon.tell(failed(id_, 1, "no link is up"), failed(id_, 2, "newer", 14))
    printing.process()
    assert lines(capsys) == ["a message was not sent: no link is up"]
    other = printing.advertise("b")
    id_ = world.daemon.newest_id(ADVERTISE)
    other.send("x")
    other.close()
    answer_get_pose_with(world, failed(id_, 1, "too fast", 15))
    printing.close()
    assert lines(capsys) == ["a message was not sent: too fast"]


def test_a_program_that_sees_to_its_errors_is_told_of_no_message_at_the_end(world, capsys):
    publisher = world.client.advertise("a")
    publisher.send("x")
    answer_get_pose_with(world, failed(world.daemon.newest_id(ADVERTISE), 1, "no link is up"))
    world.client.close()
    assert lines(capsys) == []


def test_the_end_tells_how_many_refusals_nobody_looked_at(world, printing, capsys):
    publisher = printing.advertise("a", queue=0)
    for count, told in ((0, []), (1, ["since then 1 more of this program's messages was not sent"]),
                        (2, ["since then 2 more of this program's messages were not sent"])):
        with swarmtalk.Client("other", world.daemon.path, connect=False) as client:
            world.daemon.drop()
            client.connect()
            publisher = client.advertise("a", queue=0)
            assert publisher.send("x")
            publisher.send("y")
            client.process()
            (first,) = lines(capsys)
            assert "channel a: a message was not sent, and nobody looked" in first
            for _ in range(count):
                publisher.send("y")
        assert lines(capsys) == told


def test_a_refusal_that_is_kept_and_never_looked_at_is_told_at_the_end(world, printing, capsys):
    publisher = printing.advertise("a", queue=0)
    assert publisher.send("x")
    kept, seen = publisher.send("y"), publisher.send("z")
    assert seen.code == "busy"
    assert lines(capsys) == []
    printing.close()
    (told,) = lines(capsys)
    assert "channel a: a message was not sent, and nobody looked at what send() returned" in told
    del kept
    assert lines(capsys) == [], "it is told once"


def test_a_loss_of_the_daemon_that_no_call_has_told_is_told_at_the_end(world, printing, capsys):
    assert printing.advertise("a").send("x")
    world.daemon.stop()
    with pytest.raises(swarmtalk.Error):
        printing.get_pose()
    printing.close()
    assert lines(capsys) == ["swarmtalkd was gone when this program ended: whether its last "
                             "messages left is not known"]
    # One that was told of is not told again.
    world.daemon.start()
    with swarmtalk.Client("other", world.daemon.path) as client:
        client.on_disconnect = world.told.append
        assert client.advertise("a").send("x")
        world.daemon.stop()
        client.process()
        assert [each.code for each in world.told] == ["disconnected"]
    assert lines(capsys) == []


def test_messages_that_were_never_fetched_are_told_at_the_end(world, capsys):
    looks = {"take": lambda each: each.take(), "get": lambda each: each.get(0), "for": iter,
             "b": lambda each: None}
    for channel, look in looks.items():
        look(world.client.subscribe(channel))
        world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
        world.settle()
    world.client.close()
    (told,) = lines(capsys)
    assert told.startswith("channel b was subscribed to without a function, and its messages were "
                           "never fetched: ")


def test_a_callback_of_a_program_that_never_ran_is_told_at_the_end(world, capsys):
    world.client.subscribe("b", print)
    world.client.subscribe("c", print)
    world.client.close()
    assert lines(capsys) == ["channel b was subscribed to and nothing was heard: call run() or "
                             "process(): callbacks run only inside those"]


@pytest.mark.parametrize("seconds, heard, spoken, told", [
    (3.5, False, "b", True), (2.5, False, "b", False), (3.5, True, "b", False),
    (3.5, False, "c", False)])
def test_a_program_that_spoke_on_a_channel_and_heard_nobody_is_told_at_the_end(
        world, capsys, seconds, heard, spoken, told):
    world.client.advertise(spoken)
    world.client.subscribe("b", world.heard.append)
    id_ = world.daemon.newest_id(SUBSCRIBE)
    world.client.process()
    world.now += seconds
    if heard:
        world.daemon.deliver(id_, "x")
        world.client.process()
    capsys.readouterr()
    world.client.close()
    assert [line.split(":")[0] for line in lines(capsys)] == ["nothing was heard on channel b"] * (
        told)


def test_what_was_lost_here_is_told_to_the_daemon_before_the_end(world):
    publisher = world.client.advertise("a", queue=0)
    world.client.subscribe("b", keep_last=1)
    ids = {each[0]: each[1] for each in world.daemon.requests}
    assert publisher.send("x")
    assert not publisher.send("y") and not publisher.send("y") and not publisher.send("y")
    world.settle()
    for _ in range(3):
        world.daemon.deliver(ids[SUBSCRIBE], "x")
    world.client.get_pose()
    world.client.close()
    world.daemon.serve()
    told = world.daemon.of(CLIENT_LOSS)
    assert sum(each[4] for each in told if each.get(3) == ids[ADVERTISE]) == 3
    assert [each for each in told if 3 not in each] == [{1: ids[SUBSCRIBE], 2: 2}]


def test_a_program_that_only_hears_tells_its_losses_before_the_end(world):
    world.client.subscribe("b", keep_last=1)
    id_ = world.daemon.newest_id(SUBSCRIBE)
    for _ in range(3):
        world.daemon.deliver(id_, "x")
    world.client.get_pose()
    world.client.close()
    world.daemon.serve()
    assert world.daemon.of(CLIENT_LOSS) == [{1: id_, 2: 2}]


def test_what_a_publisher_refused_is_told_to_the_daemon_when_it_is_closed(world):
    publisher = world.client.advertise("a", queue=0)
    id_ = world.daemon.newest_id(ADVERTISE)
    assert publisher.send("x")
    for _ in range(3):
        assert not publisher.send("y")
    publisher.close()
    world.settle()
    told = world.daemon.of(CLIENT_LOSS)
    assert {each[3] for each in told} == {id_} and sum(each[4] for each in told) == 3


def test_nothing_is_called_after_close(world):
    ends = []
    publisher = world.client.advertise("a", sent=ends.append)
    subscriber = world.client.subscribe("b", world.heard.append)
    publisher.send("x")
    world.settle()
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    world.client.close()
    assert (ends, world.heard, world.told) == ([], [], [])
    assert publisher.status.text == subscriber.status.text == "the Client of this handle is closed"
    assert publisher.send("x").text == "the Client of this handle is closed"
    assert not publisher.busy()
    world.client.stop()  # from a signal, say
    for call in (world.client.process, world.client.run, world.client.connect,
                 world.client.get_pose, lambda: world.client.advertise("a")):
        with pytest.raises(swarmtalk.Error, match="this Client is closed"):
            call()
    publisher.close()


def test_stop_of_a_closed_client_writes_into_nobodys_descriptor(world):
    world.client.close()
    pipes = [os.pipe() for _ in range(6)]  # one has the number that the client's had
    try:
        world.client.stop()
        for reading, _ in pipes:
            os.set_blocking(reading, False)
            with pytest.raises(BlockingIOError):
                os.read(reading, 1)
    finally:
        for ends in pipes:
            for each in ends:
                os.close(each)


def test_a_client_belongs_to_the_process_that_made_it(world, monkeypatch):
    publisher = world.client.advertise("a")
    world.settle()
    before = len(world.daemon.requests)
    with monkeypatch.context() as child:
        child.setattr(swarmtalk.os, "getpid", lambda own=os.getpid(): own + 1)
        for call in (world.client.process, world.client.get_pose, publisher.busy,
                     world.client.fileno, lambda: publisher.send("x"),
                     lambda: world.client.log("x"), lambda: world.client.subscribe("b")):
            with pytest.raises(swarmtalk.BadArgument, match="make one after the fork"):
                call()
        world.client.stop()
        with publisher:
            pass
        world.client.close()  # as at the child's end
        assert world.client._incoming == b"" and not world.client._stopped
    world.settle()
    assert world.client.connected and len(world.daemon.requests) == before
    assert publisher.send("x")


def test_an_error_comes_whole_out_of_another_process():
    for error in (swarmtalk.Error("no_daemon", "start it"),
                  swarmtalk.BadArgument("bad_ttl", "less")):
        copied = pickle.loads(pickle.dumps(error))
        assert (type(copied), copied.code, copied.text, str(copied)) == (
            type(error), error.code, error.text, str(error))


def test_a_client_that_is_dropped_leaves_no_descriptor(world):
    def make():
        with swarmtalk.Client("closed", world.daemon.path, connect=False):
            swarmtalk.Client("dropped", world.daemon.path, connect=False).subscribe("a")
        gc.collect()
        return len(os.listdir("/proc/self/fd"))
    assert make() == make()


@pytest.mark.parametrize("copied", [pickle.dumps, copy.deepcopy])
def test_a_client_cannot_be_copied_to_another_process(world, copied):
    world.settle()
    for each in (world.client, world.client.advertise("a"), world.client.subscribe("b", print)):
        with pytest.raises(TypeError, match="make a Client in the function that runs there"):
            copied(each)


@pytest.mark.parametrize("where", ["callback", "on_gap", "sent"])
def test_a_child_that_returns_from_a_function_of_the_program_takes_nothing_of_the_parents(
        world, monkeypatch, where):
    def fork(_):
        child.setattr(swarmtalk.os, "getpid", lambda own=os.getpid(): own + 1)
    world.client.on_gap = fork if where == "on_gap" else None
    publisher = world.client.advertise("a", sent=fork if where == "sent" else None)
    sender = world.daemon.newest_id(ADVERTISE)
    world.client.subscribe("b", fork if where == "callback" else world.heard.append)
    hearer = world.daemon.newest_id(SUBSCRIBE)
    publisher.send("x")
    world.settle()
    with monkeypatch.context() as child:
        world.daemon.tell(*{
            "callback": [field(DELIVER, field(1, hearer))],
            "on_gap": [field(DELIVER, field(1, hearer) + field(16, field(1, 3)))],
            "sent": [field(SENT, field(1, sender) + field(2, 1))]}[where])
        world.daemon.deliver(hearer, "y")
        with pytest.raises(swarmtalk.BadArgument, match="make one after the fork"):
            world.client.run(1)
        assert world.heard == [] and len(world.client._events) == (1 if where != "on_gap" else 2)


def test_at_the_end_of_the_program_every_client_is_closed(world, monkeypatch):
    monkeypatch.setattr(swarmtalk, "_ending", [])
    other = swarmtalk.Client("other", world.daemon.path, connect=False)
    with other._owner:
        inside = threading.Thread(target=swarmtalk._close_all)  # as if a thread were inside it
        inside.start()
        inside.join()
    assert not world.client.connected
    with pytest.raises(swarmtalk.Error, match="this Client is closed"):
        world.client.process()
    assert other.process() is False, "one that a thread is inside of is left to end with it"
    other.close()


def test_a_thread_that_outlives_the_program_ends_without_a_word(world, monkeypatch):
    """As `while True: robot.run(0.1)` in a daemon thread, when main ends."""
    monkeypatch.setattr(swarmtalk, "_ending", [])
    died = []
    monkeypatch.setattr(threading, "excepthook", died.append)
    swarmtalk._close_all()
    thread = threading.Thread(target=lambda: world.client.run(0.1))
    thread.start()
    thread.join()
    assert {each.exc_type for each in died} <= {SystemExit}, "of which threads print nothing"
    del died[:]
    monkeypatch.setattr(swarmtalk, "_ending", [])
    thread = threading.Thread(target=lambda: world.client.run(0.1))
    thread.start()
    thread.join()
    assert [each.exc_value.text for each in died] == ["this Client is closed"]


def test_another_thread_may_send_and_stop_and_nothing_else_meanwhile(world):
    publisher = world.client.advertise("a", queue=0)
    said = []

    def from_another(expected):
        for call in (world.client.process, world.client.get_pose, publisher.close):
            try:
                call()
            except swarmtalk.BadArgument as error:
                said.append(expected in error.text)
        said.append((bool(publisher.send("x")), publisher.busy()))
        world.client.stop()

    def receive(message):
        thread = threading.Thread(target=from_another, args=(message.text,))
        thread.start()
        thread.join()
    world.client.subscribe("b", receive)
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "in run()")
    world.client.run()
    assert said == [True] * 3 + [(True, True)]
    del said[:]
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "in process()")
    world.client.process()
    assert said == [True] * 3 + [(False, True)]


def test_the_owner_waits_for_the_short_look_of_a_thread_that_sends(world):
    """send() of another thread looks for room while the owner is away; then the owner comes."""
    publisher = world.client.advertise("a", queue=0)
    world.settle()
    looking, goes_on = threading.Event(), threading.Event()
    read, reading = world.client._read, world.client._reading

    class Waited:
        """The lock that the owner waits at; the thread goes on when it does."""
        acquire, release = reading.acquire, reading.release

        def __enter__(self):
            goes_on.set()
            reading.acquire()

        def __exit__(self, *_):
            reading.release()

    def slowly():
        looking.set()
        goes_on.wait(PATIENCE_S)
        return read()
    world.client._read, world.client._reading = slowly, Waited()
    thread = threading.Thread(target=lambda: (publisher.send("x"), publisher.send("y")))
    thread.start()
    assert looking.wait(PATIENCE_S)
    assert world.client.process() is True
    thread.join()


def test_a_client_may_be_handed_to_another_thread_between_calls(world):
    publisher = world.client.advertise("a", queue=0)
    assert publisher.send("x") and not publisher.send("y"), "which looks for answers"
    said = []

    def own():
        try:
            said.append(world.client.get_pose())
            world.client.close()
        except swarmtalk.Error as error:
            said.append(error.text)
    thread = threading.Thread(target=own)
    thread.start()
    thread.join()
    assert said == [None]


def test_the_last_words_of_a_daemon_are_read_though_it_reads_no_more(world):
    publisher = world.client.advertise("a")
    world.client.subscribe("b", lambda message: world.heard.append(len(message.data)))
    id_ = world.daemon.newest_id(SUBSCRIBE)
    world.settle()
    for _ in range(3):
        world.daemon.deliver(id_, b"x" * 40000)  # more than one look takes
    world.daemon.tell(field(FAILURE, field(1, 2) + field(2, "that was no frame")))
    world.daemon.stop()
    assert publisher.send("x").code == "disconnected"
    world.settle()
    assert world.heard == [40000] * 3
    assert world.told[0] == ("error", "protocol", "that was no frame")
    assert [each[0] for each in world.told] == ["error", "lost"]


def test_a_handle_that_is_closed_while_it_is_registered_anew_is_unregistered(world):
    world.daemon.answers[UNSUBSCRIBE] = lambda _: field(DONE, b"")
    subscriber, other = world.client.subscribe("b"), world.client.subscribe("c")
    answer = world.daemon.answers.pop(SUBSCRIBE)
    world.daemon.drop()
    world.pass_time(0.3)
    assert not world.client.connected and [each[0] for each in world.daemon.requests][-3:] == [
        HELLO, SUBSCRIBE, SUBSCRIBE]
    ids = [each[1] for each in world.daemon.requests[-2:]]
    subscriber.close()
    world.daemon.tell(*(field(1, each) + answer(each) for each in ids))
    world.settle()
    assert world.client.connected
    assert world.daemon.of(UNSUBSCRIBE) == [{1: ids[0]}]
    assert other.status is None
    assert subscriber.status.text == "this handle was closed"
    world.daemon.tell(*(field(DELIVER, field(1, each) + field(2, "x")) for each in ids))
    world.settle()
    assert len(other.take()) == 1 and subscriber.get(0) is None
