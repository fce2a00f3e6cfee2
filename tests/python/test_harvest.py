"""Values of programs and questions for them, byte for byte (docs/wire-format.md, harvest), with a
daemon that is a script."""
import struct

import pytest

import swarmtalk
from local_frames import field
from scripted_daemon import ADVERTISE, ADVERTISED, DELIVER, PUBLISH, SENT, SUBSCRIBE

pytestmark = pytest.mark.logic


class Swarm:
    """A program with a Harvest, and all that the others say and hear."""

    def __init__(self, world, max_bytes=16000, max_ttl=7):
        self.world, self.daemon = world, world.daemon
        self.daemon.answers[ADVERTISE] = lambda number: field(
            ADVERTISED, field(1, number) + field(2, 2) + field(3, max_bytes) + field(4, max_ttl))
        self.harvest = swarmtalk.Harvest(world.client)
        self.publisher = self.daemon.newest_id(ADVERTISE)
        self.subscription = self.daemon.newest_id(SUBSCRIBE)
        self.seen = 0

    def say(self, data, sender=9):
        self.daemon.tell(field(DELIVER, field(1, self.subscription) + field(2, data)
                               + field(4, sender) + field(15, 33)))
        self.world.settle()

    def ask(self, prefix, ttl=3, number=0x01020304):
        """What is answered to a question: [(ttl, bytes)]."""
        self.say(struct.pack(">cIB", b"Q", number, ttl) + prefix)
        return self.sent()

    def sent(self):
        self.world.settle()
        published = self.daemon.of(PUBLISH)[self.seen:]
        self.seen += len(published)
        for number in range(self.seen - len(published), self.seen):
            self.daemon.tell(field(SENT, field(1, self.publisher) + field(2, number + 1)))
        self.world.settle()
        return [(each.get(4, 0), each[3]) for each in published]


@pytest.fixture(name="world")
def meet_world(world):
    world.meet()
    return world


HEAD = b"A\x01\x02\x03\x04"


def value(key, text):
    return bytes([len(key)]) + key + struct.pack(">H", len(text)) + text


def test_values_answer_questions_that_begin_like_them_in_their_order(world):
    swarm = Swarm(world)
    for key, text in (("led", "#ff8000"), ("battery", b"\x00\xff"), ("bat", ""), ("x", "1")):
        swarm.harvest.set(key, text)
    swarm.harvest.set("x", "2")
    assert swarm.ask(b"bat") == [(3, HEAD + value(b"bat", b"") + value(b"battery", b"\x00\xff"))]
    assert swarm.ask(b"", ttl=255) == [(7, HEAD + value(b"bat", b"")
                                        + value(b"battery", b"\x00\xff")
                                        + value(b"led", b"#ff8000") + value(b"x", b"2"))]
    swarm.harvest.remove("battery")
    swarm.harvest.remove("nothing")
    assert swarm.ask(b"battery") == []
    assert swarm.ask(b"bat", ttl=0) == [(0, HEAD + value(b"bat", b""))]


def test_what_does_not_fit_into_one_answer_comes_in_the_next(world):
    for max_bytes, most in ((16000, 1000), (600, 600)):
        swarm = Swarm(world, max_bytes)
        swarm.seen = len(world.daemon.of(PUBLISH))
        keys = [b"k%02d" % number for number in range(20)]
        for key in keys:
            swarm.harvest.set(key, b"v" * (100 + int(key[1:])))
        answers = [data for _, data in swarm.ask(b"k")]
        assert len(answers) > 2 and all(each[:5] == HEAD for each in answers)
        assert b"".join(each[5:] for each in answers) == b"".join(
            value(key, b"v" * (100 + int(key[1:]))) for key in keys)
        for each, after in zip(answers, answers[1:]):
            first = 1 + 3 + 2 + struct.unpack(">H", after[9:11])[0]
            assert len(each) <= most < len(each) + first
        swarm.harvest.close()
        assert swarm.ask(b"k") == []


def test_a_value_that_fills_an_answer_by_itself_is_sent_alone(world):
    swarm = Swarm(world, max_bytes=520)
    swarm.harvest.set("a", b"v" * 512)  # 5 + 1 + 1 + 2 + 512 = 521: too long for this channel
    swarm.harvest.set("b", b"v" * 511)
    with pytest.raises(swarmtalk.BadArgument, match="at most 520"):
        swarm.ask(b"a")
    assert swarm.ask(b"b") == [(3, HEAD + value(b"b", b"v" * 511))]


def test_answers_to_the_last_question_are_handed_over_and_no_others(world):
    swarm = Swarm(world)
    found = []
    assert swarm.harvest.ask("bat", found.append, ttl=5)
    (ttl, question), = swarm.sent()
    assert ttl == 5 and question[:1] == b"Q" and question[5:6] == b"\x05"
    assert question[6:] == b"bat"
    answer = b"A" + question[1:5] + value(b"battery", b"3.7") + value(b"bat", b"\xff")
    swarm.say(answer)
    assert [(each.node_id, each.epoch, each.key, each.data) for each in found] == [
        (9, 33, "battery", b"3.7"), (9, 33, "bat", b"\xff")]
    assert found[0].value == "3.7" and not found[0].local
    other = bytes([question[1] ^ 1]) + question[2:5]
    swarm.say(b"A" + other + value(b"battery", b"1"))
    swarm.say(b"")
    swarm.say(b"A" + question[1:5])
    assert len(found) == 2
    # Of one that is cut, those before the cut.
    for size in range(5, len(answer)):
        del found[:]
        swarm.say(answer[:size])
        assert len(found) == (1 if size >= 5 + 13 else 0), size
    del found[:]
    swarm.say(b"A" + question[1:5] + b"\x00\x00\x00" + value(b"b", b"1"))
    assert found == []
    later = []
    swarm.harvest.ask("b", later.append)
    (ttl, second), = swarm.sent()
    assert ttl == 4 and second[1:5] != question[1:5]
    swarm.say(answer)
    assert not found and not later
    swarm.say(b"A" + second[1:5] + value(b"b", b"2"))
    assert [each.value for each in later] == ["2"] and not found


def test_what_harvest_does_not_take_is_said(world):
    with pytest.raises(swarmtalk.BadArgument, match="takes the program's Client"):
        swarmtalk.Harvest("robot")
    harvest = Swarm(world).harvest
    for key in ("", "k" * 65):
        with pytest.raises(swarmtalk.BadArgument, match="has 1 to 64 bytes, not %d" % len(key)):
            harvest.set(key, "x")
    with pytest.raises(swarmtalk.BadArgument, match="at most 512 bytes, not 513"):
        harvest.set("k", "v" * 513)
    harvest.set("k" * 64, "v" * 512)
    for number in range(63):
        harvest.set("k%d" % number, "")
    harvest.set("k0", "again")
    with pytest.raises(swarmtalk.BadArgument, match="at most 64 values"):
        harvest.set("one more", "")
    harvest.remove("k1")
    harvest.set("one more", "")
    with pytest.raises(swarmtalk.BadArgument):
        harvest.ask("k", print, ttl=256)
    with pytest.raises(swarmtalk.BadArgument):
        harvest.ask("k", None)
