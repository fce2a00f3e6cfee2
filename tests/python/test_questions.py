"""What a program of the Python client asks the daemon and waits for: poses, sync() and questions.
With a daemon that is a script and a clock that stands still unless the client waits."""
import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import (ADVERTISE, DONE, FAILURE, GET_POSE, GET_STATUS, POSE, PUBLISH,
                             SET_POSE, STATUS, advertised)

pytestmark = pytest.mark.logic


def test_sync_raises_the_first_refusal_since_the_last_sync_once(world):
    world.meet()
    world.client.sync()
    refused = iter("abcde")
    world.daemon.answers[SET_POSE] = lambda _: field(FAILURE, field(1, 10)
                                                     + field(2, next(refused)))
    for words in ("a", "c"):
        for _ in range(2):
            world.client.set_pose(1, 2, 0)
            world.settle()
        with pytest.raises(swarmtalk.Error, match="^%s$" % words) as raised:
            world.client.sync()
        assert raised.value.code == "bad_pose"
        world.client.sync()
    assert [each[2] for each in world.told] == list("abcd")
    del world.daemon.answers[SET_POSE]
    world.client.set_pose(1, 2, 0)
    begin = world.now
    with pytest.raises(swarmtalk.Error, match="did not answer in time"):
        world.client.sync()
    assert 0.99 < world.now - begin < 1.1


def test_a_question_that_is_not_answered_is_given_up_and_its_late_answer_is_nobodys(world):
    world.meet()
    begin = world.now
    with pytest.raises(swarmtalk.Error, match="did not answer in time"):
        world.client.get_pose()
    assert 0.99 < world.now - begin < 1.1
    late = world.daemon.newest_id(GET_POSE)
    world.daemon.answers[GET_POSE] = lambda _: field(FAILURE, field(1, 1) + field(2, "none yet"))
    world.daemon.tell(field(1, late) + field(POSE, b""))
    with pytest.raises(swarmtalk.Error, match="none yet"):
        world.client.get_pose()
    del world.daemon.answers[GET_POSE]
    with pytest.raises(swarmtalk.Error, match="did not answer in time"):
        world.client.get_pose()
    world.client.sync()  # waits for no question that was given up


def test_requests_are_numbered_from_one_again_after_the_last_number(world):
    world.meet()
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    world.client._last_request = 0xFFFFFFFE
    for _ in range(3):
        assert world.client.get_pose() is None
    assert [each[1] for each in world.daemon.requests[-3:]] == [0xFFFFFFFF, 1, 2]


def test_of_poses_that_many_wait_for_answers_to_the_newest_follows_once(world):
    """64 go out at once, as those of a program that ends then."""
    world.meet()
    for x in range(67):
        world.client.set_pose(x / 10.0, 0, 0)
    world.daemon.serve()
    sent = [round(each * 10) for each in world.daemon.poses()]
    assert sent == list(range(64))
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.daemon.tell(field(1, world.daemon.newest_id(SET_POSE)) + field(DONE, b""))
    world.pass_time(1)
    assert [round(each * 10) for each in world.daemon.poses()][64:] == [66]


def test_poses_of_a_program_that_does_nothing_else_go_on(world):
    world.meet()
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    for x in range(200):
        world.client.set_pose(x / 10.0, 0, 0)
        world.daemon.serve()
    assert len(world.daemon.poses()) == 200


def test_the_newest_pose_goes_out_at_the_end_and_a_refusal_of_it_is_told(world, capsys):
    world.meet()
    world.client.on_error = world.client._print_once_a_second
    world.daemon.answers[GET_POSE] = lambda _: field(POSE, b"")
    for x in range(70):
        world.client.set_pose(x / 10.0, 0, 0)
    world.daemon.answers[SET_POSE] = lambda _: field(FAILURE, field(1, 1) + field(2, "too far"))
    world.client.close()
    assert round(world.daemon.poses()[-1] * 10) == 69
    assert "too far" in capsys.readouterr().err


def test_a_pose_that_is_refused_is_told_and_the_next_one_is_sent(world):
    world.meet()
    world.daemon.answers[SET_POSE] = lambda _: field(FAILURE, field(1, 1) + field(2, "too far"))
    world.client.set_pose(1, 0, 0)
    world.settle()
    world.client.set_pose(2, 0, 0)
    world.settle()
    assert world.daemon.poses() == [1, 2]
    assert [each[2] for each in world.told] == ["too far"] * 2


def test_a_pose_that_waited_for_a_daemon_that_went_is_not_sent_to_the_next(world):
    world.meet()
    for _ in range(64):
        world.client.set_pose(1, 0, 0)
    world.client.set_pose(2, 0, 0)
    world.settle()
    world.daemon.drop()
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.pass_time(0.5)
    assert set(world.daemon.poses()) == {1}
    world.client.set_pose(3, 0, 0)
    world.settle()
    assert world.daemon.poses()[64:] == [3]


def test_a_question_ends_at_once_when_the_daemon_goes(world):
    world.meet()
    begin = world.now
    world.daemon.answers[GET_POSE] = lambda _: world.daemon.drop() or b""
    world.daemon.tell = lambda *_: None
    with pytest.raises(swarmtalk.Error, match="not connected to swarmtalkd") as raised:
        world.client.get_pose()
    assert raised.value.code == "disconnected" and world.now - begin < 0.01


def test_what_was_asked_of_a_daemon_that_went_is_not_waited_for_at_the_next(world):
    world.meet()
    world.client.set_pose(1, 0, 0)
    world.client.set_pose(2, 0, 0)
    world.settle()
    world.daemon.drop()
    world.pass_time(0.3)
    begin = world.now
    world.client.sync()
    assert world.now == begin
    assert [each[0] for each in world.told] == ["lost", "back"]


def test_sync_waits_for_the_newest_pose_and_says_when_the_daemon_went(world):
    world.meet()
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    for x in range(66):
        world.client.set_pose(x / 10.0, 0, 0)
    world.client.sync()
    assert round(world.daemon.poses()[-1] * 10) == 65 and len(world.daemon.poses()) == 65
    world.daemon.answers[SET_POSE] = lambda _: world.daemon.drop() or b""
    world.daemon.tell = lambda *_: None
    world.client.set_pose(4, 0, 0)
    with pytest.raises(swarmtalk.Error, match="lost swarmtalkd: it closed the connection"):
        world.client.sync()


def test_a_pose_and_a_fixed_pose_go_out_as_they_are(world):
    world.meet()
    world.daemon.answers[SET_POSE] = lambda _: field(DONE, b"")
    world.client.set_pose(1, -2.5, 0.5)
    world.client.sync()
    world.client.set_fixed_pose(-32.767, 32.767, -6.25)
    world.client.sync()
    floats = swarmtalk.struct.Struct("<f")
    assert [[floats.unpack(each[number])[0] for number in (1, 2, 3)]
            for each in world.daemon.of(SET_POSE)] == [
        [1, -2.5, 0.5], [floats.unpack(floats.pack(each))[0] for each in (-32.767, 32.767, -6.25)]]
    assert [each.get(4) for each in world.daemon.of(SET_POSE)] == [None, 1]


@pytest.mark.parametrize("pose", [(32.768, 0, 0), (0, -32.768, 0), (0, 0, 1e39),
                                  (float("nan"), 0, 0), (0, float("nan"), 0), (0, 0, float("inf")),
                                  ("1", 0, 0), (0, None, 0), (0, 0, True)])
def test_a_pose_that_cannot_be_is_refused_here(world, pose):
    world.meet()
    for call in (world.client.set_pose, world.client.set_fixed_pose):
        with pytest.raises(swarmtalk.BadArgument) as raised:
            call(*pose)
        assert raised.value.code == "bad_pose"
    world.settle()
    assert world.daemon.of(SET_POSE) == []


def test_neighbours_and_status_are_handed_on(world):
    world.meet()
    world.daemon.answers[30] = lambda _: field(31, field(1, field(2, 9)) + field(2, 5)
                                               + field(1, field(2, 10) + field(5, 1500)))
    assert [(each.node_id, each.age, type(each).__name__) for each in world.client.neighbours()
            ] == [(9, 0, "Neighbour"), (10, 1.5, "Neighbour")]
    counter = field(1, "frames") + field(2, 3)
    world.daemon.answers[GET_STATUS] = lambda _: field(STATUS, field(2, 77) + field(9, counter))
    status = world.client.status()
    assert (status.node_id, status.counters, status.links) == (77, {"frames": 3}, [])


def test_what_a_neighbour_needs_to_be_heard_is_told_once(world, capsys):
    world.meet()
    world.daemon.answers[30] = lambda _: field(31, b"")
    assert (world.client.neighbours(), world.client.neighbours()) == ([], [])
    assert capsys.readouterr().err.count("beacon_ms") == 1


def test_answers_may_come_in_another_order_than_the_questions(world):
    world.meet()
    refusal = field(FAILURE, field(1, 10) + field(2, "first"))
    world.client.set_pose(1, 0, 0)
    first = world.daemon.serve() and world.daemon.newest_id(SET_POSE)
    world.daemon.answers[GET_POSE] = lambda number: (
        world.daemon.tell(field(1, first) + refusal) or field(POSE, field(4, 1)))
    assert world.client.get_pose() is None
    with pytest.raises(swarmtalk.Error, match="^first$"):
        world.client.sync()


@pytest.mark.parametrize("switched_on", [True, False])
def test_log_sends_lines_to_the_debug_channel_and_opens_it_once(world, capsys, switched_on):
    world.meet()
    world.daemon.answers[ADVERTISE] = advertised(100) if switched_on else lambda _: field(
        FAILURE, field(1, 5) + field(2, "channel debug is off"))
    if not switched_on:
        assert world.client.log("zero") is world.client.log("one") is False
        told = capsys.readouterr().err
        assert told == "swarmtalk: log lines stay on this robot: channel debug is off\n"
        world.daemon.answers[ADVERTISE] = advertised(100)  # from now on it is
    for line in ("one", "two"):
        assert world.client.log(line) is True
    world.settle()
    asked = world.daemon.of(ADVERTISE)
    assert len(asked) == (1 if switched_on else 3)
    assert asked[-1] == {1: field(1, "debug"), 2: 4, 4: 16, 5: 1}
    assert [each[3] for each in world.daemon.of(PUBLISH)] == [b"one", b"two"]
    world.daemon.tell(field(FAILURE, field(1, 14) + field(2, "x") + field(
        4, world.daemon.newest_id(ADVERTISE)) + field(5, 1)))
    world.settle()
    assert world.told == []
