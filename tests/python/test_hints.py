"""The one line that the Python client prints for each of the common mistakes (docs/python.md,
rules). With a daemon that is a script and a clock that stands still unless the client waits."""
import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, DONE, FAILURE, GET_STATUS, SET_POSE, STATUS, SUBSCRIBE,
                             advertised)

pytestmark = pytest.mark.logic
NEIGHBOURS = 31
SOMEBODY = field(NEIGHBOURS, field(1, field(2, 9)))


@pytest.fixture(name="world")
def meet_world(world):
    world.daemon.answers[GET_STATUS] = lambda _: field(STATUS, b"")
    world.daemon.answers[30] = lambda _: field(NEIGHBOURS, b"")
    world.daemon.answers[ADVERTISE] = advertised(100)
    world.meet()
    return world


def asked(world, kind=GET_STATUS):
    return len(world.daemon.of(kind))


def lines(capsys):
    return [line[len("swarmtalk: "):] for line in capsys.readouterr().err.splitlines()]


def test_handles_that_pile_up_are_told_once(world, capsys):
    for number in range(swarmtalk._MANY_HANDLES - 1):
        world.client.subscribe("b")
        world.client.subscribe("c%d" % number)
        world.client.advertise("b")
    assert lines(capsys) == []
    for _ in range(2):
        world.client.subscribe("b")
    assert lines(capsys) == [
        "channel b: subscribe() was called %d times, and all of them are kept; call it "
        "once, before the loop, or close() what it returned" % swarmtalk._MANY_HANDLES]
    world.client.advertise("b")
    assert lines(capsys) == [
        "channel b: advertise() was called %d times, and all of them are kept; call it once, "
        "before the loop, or close() what it returned" % swarmtalk._MANY_HANDLES]


@pytest.mark.parametrize("around, hint", [
    (b"", True), (field(1, field(2, 9)), False), (field(1, field(2, 9) + field(13, 1)), True),
    (field(1, field(2, 9) + field(13, 1)) + field(1, field(2, 10)), False), (field(2, 3), True)])
def test_a_program_that_hears_nothing_is_told_once_that_it_is_alone(world, capsys, around, hint):
    world.daemon.answers[30] = lambda _: field(NEIGHBOURS, around)
    world.client.subscribe("b", lambda message: None)
    world.pass_time(10, step=0.01)
    assert asked(world) == 1
    told = lines(capsys)
    assert len(told) == hint and all("no other robot is around" in line for line in told)
    world.daemon.drop()
    world.pass_time(10, step=0.01)
    assert world.client.connected and "around" not in capsys.readouterr().err
    assert asked(world) == (1 if hint else 2), "on each connection, until it was told"


@pytest.mark.parametrize("channels, hint", [
    ([("position", 1)], True), ([("position", 0)], True), ([("something", 1)], False),
    ([("positon", 1), ("position", 1)], False), ([("positon", 0), ("position", 1)], True)])
def test_a_program_that_misspelt_a_channel_is_told_the_right_one(world, capsys, channels, hint):
    known = b"".join(field(8, field(1, 5) + field(2, name) + field(3, publishers))
                     for name, publishers in channels)
    world.daemon.answers[GET_STATUS] = lambda _: field(STATUS, known)
    world.daemon.answers[30] = lambda _: SOMEBODY
    world.client.subscribe("positon", lambda message: None)
    world.pass_time(10, step=0.01)
    told = lines(capsys)
    assert len(told) == hint and all("did you mean 'position'?" in line for line in told)
    world.daemon.drop()
    world.pass_time(10, step=0.01)
    assert lines(capsys) == [], "it is told once"


def ask_after(world, seconds=10):
    world.pass_time(seconds, step=0.01)
    return asked(world)


def test_after_3_s_of_silence_it_is_looked_what_is_wrong_and_not_before(world):
    world.client.subscribe("b", print)
    world.settle()
    assert ask_after(world, 2.9) == 0 and ask_after(world, 0.2) == 1


def test_who_hears_something_on_each_channel_is_told_nothing(world, capsys):
    for _ in range(2):
        world.client.subscribe("b", world.heard.append)
        world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    assert ask_after(world) == 0
    world.client.subscribe("c", print)  # that one is watched on the next connection
    world.daemon.drop()
    assert ask_after(world) == 1
    assert asked(world, 30) == 0, "it has heard somebody"
    assert lines(capsys) == []


def test_who_listens_to_nothing_but_questions_is_told_nothing(world, capsys):
    world.client.advertise("b")
    swarmtalk.Harvest(world.client)
    assert ask_after(world) == 0
    assert lines(capsys) == []


@pytest.mark.parametrize("kind", [GET_STATUS, 30])
def test_a_daemon_that_refuses_to_tell_is_not_asked_again(world, capsys, kind):
    world.daemon.answers[kind] = lambda _: field(FAILURE, field(1, 11) + field(2, "what?"))
    world.client.subscribe("b", print)
    assert ask_after(world) == 1 and asked(world, 30) == 1
    assert world.client.connected and world.told == []
    assert ["no other robot is around" in line for line in lines(capsys)] == [True] * (kind != 30)


@pytest.mark.parametrize("kind", [GET_STATUS, 30])
@pytest.mark.parametrize("change", ["hears", "closes", "is told"])
def test_what_happens_meanwhile_counts(world, capsys, kind, change):
    subscriber = world.client.subscribe("positon", world.heard.append)
    id_ = world.daemon.newest_id(SUBSCRIBE)
    misspelt = field(STATUS, field(8, field(2, "position") + field(3, 1)))
    answer = {GET_STATUS: misspelt, 30: field(NEIGHBOURS, b"")}[kind]
    del world.daemon.answers[kind]
    assert ask_after(world) == 1 and lines(capsys) == []
    number = world.daemon.newest_id(kind)
    if change == "hears":
        world.daemon.deliver(id_, "x")
    elif change == "closes":
        subscriber.close()
    else:
        world.daemon.tell(field(FAILURE, field(1, 12) + field(2, "no link is up")))
    world.daemon.tell(field(1, number) + answer)
    world.pass_time(1, step=0.01)
    assert lines(capsys) == [] and world.client.connected
    assert [each[0] for each in world.told] == ["error"] * (change == "is told")


@pytest.mark.parametrize("channel, known, told", [
    ("positon", [field(2, "position") + field(6, 5)], True),  # published by nobody here
    ("robot_1", [field(2, "robot_2") + field(3, 1)], False),  # differs in a number: on purpose
    ("positon", [field(2, "positon") + field(6, 5), field(2, "position") + field(3, 1)], False),
    ("positon", [field(2, "positon") + field(3, 1), field(2, "position") + field(3, 1)], False),
    (1234, [field(2, "1235") + field(3, 1)], False), ("positon", [field(3, 1)], False)])
def test_what_is_misspelt_and_what_is_not(world, capsys, channel, known, told):
    world.daemon.answers[30] = lambda _: SOMEBODY
    status = b"".join(field(8, each) for each in known)
    world.daemon.answers[GET_STATUS] = lambda _: field(STATUS, status)
    world.client.subscribe(channel, print)
    world.pass_time(10, step=0.01)
    assert ["did you mean 'position'?" in line for line in lines(capsys)] == [True] * told


def test_of_several_channels_the_silent_one_is_the_misspelt_one(world, capsys):
    known = field(8, field(2, "position")) + field(8, field(2, "led"))
    world.daemon.answers[GET_STATUS] = lambda _: field(STATUS, known)
    world.client.subscribe("posision", world.heard.append)
    world.daemon.deliver(world.daemon.newest_id(SUBSCRIBE), "x")
    world.client.subscribe("position", print)
    world.client.subscribe("leds", print)
    world.pass_time(10, step=0.01)
    (told,) = lines(capsys)
    assert told.startswith("nothing was heard on channel leds: nobody publishes it")
    assert told.endswith("did you mean 'led'?")


def test_digits_as_a_name_are_told_once(world, capsys):
    for channel in (5, "5a"):
        world.client.subscribe(channel, print)
    assert lines(capsys) == []
    for channel in ("5", "6"):
        world.client.advertise(channel)
    assert lines(capsys) == ["channel \"5\" is a name here, and not channel number 5; for the "
                             "number leave out the quotes"]


@pytest.mark.parametrize("call", ["subscribe", "advertise"])
def test_wildcards_are_told_once(world, capsys, call):
    world.client.subscribe("a.b/c", print)
    world.client.subscribe(5, print)
    assert lines(capsys) == []
    getattr(world.client, call)("robots/+/#")
    world.client.subscribe("b/*", print)
    (told,) = lines(capsys)
    assert told.startswith("'robots/+/#' is the name of one channel: there are no wildcards; ")


def test_a_function_that_was_called_instead_of_passed_is_told_once(world, capsys):
    world.client.subscribe("b")
    world.client.subscribe("b", print)
    assert lines(capsys) == []
    for _ in range(2):
        assert world.client.subscribe("b", (lambda: None)()).receive is None
    (told,) = lines(capsys)
    assert told.startswith("channel b: the function that subscribe() got is None; pass the "
                           "function itself, print, not what it returns, print()")
    with pytest.raises(swarmtalk.BadArgument):
        world.client.subscribe("b", 5)


@pytest.mark.parametrize("does", ["send", "pose", "nothing"])
def test_a_callback_without_run_is_told_once_after_3_s(world, capsys, does):
    publisher = world.client.advertise("a")
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    act = {"send": lambda: publisher.send("x"), "pose": lambda: world.client.set_pose(1, 2, 3),
           "nothing": lambda: None}[does]
    world.client.process()
    world.client.subscribe("b")  # fetched: it needs no run()
    world.now += 5
    act()
    world.client.subscribe("c", print)
    world.now += 2
    world.client.subscribe("d", print)
    world.now += 0.9
    act()
    assert lines(capsys) == []
    world.now += 0.2
    act()
    act()
    told = lines(capsys)
    assert len(told) == (does != "nothing")
    assert all(each.startswith("channel c was subscribed to 3 s ago, and run() was not called "
                               "since: ") for each in told)
    world.client.close()
    assert len(lines(capsys)) == (does == "nothing"), "it is told once"


def test_a_program_that_runs_is_not_told_to_run(world, capsys):
    publisher = world.client.advertise("a")
    world.client.subscribe("c", print)
    world.client.run(0)
    world.now += 5
    publisher.send("x")
    assert lines(capsys) == []


def test_a_heading_in_degrees_is_told_once(world, capsys):
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    for theta in (6.2832, -6.2832, 0):
        world.client.set_pose(0, 0, theta)
    assert lines(capsys) == []
    for theta in (-90, 180):
        world.client.set_pose(0, 0, theta)
        world.client.sync()
    (told,) = lines(capsys)
    assert told.startswith("the heading of a pose is in radians; -90 is more than a whole turn")
