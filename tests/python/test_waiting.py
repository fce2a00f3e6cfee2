"""What waits in the Python client for the program, without a daemon: order, policies, losses."""
import random

import pytest

import swarmtalk
from test_client import Recorder

pytestmark = pytest.mark.logic


class Waiting:
    """A subscriber whose messages come when the test says so."""

    def __init__(self, **policy):
        self.client = Recorder()
        wanted = {"receive": None, "within": None, "known_distance_only": False, "keep_last": None,
                  "latest_from_each": False, "no_older_than": None, "timestamped": None} | policy
        self.subscriber = swarmtalk.Subscriber(self.client, "c", **wanted)
        self.count = 0

    def come(self, sender=1, epoch=0, lost=None, is_old=False):
        """The next message, whose data is its number."""
        message = swarmtalk.Message([])
        message.data = b"%d" % self.count
        message.sender, message.epoch = sender, epoch
        message.received_at = -1e6 if is_old else None
        if lost is not None:
            message.lost_before = lost
        self.count += 1
        self.subscriber._put(message, bytearray(), 0)

    def take(self):
        return self.subscriber._pop() if self.subscriber._is_ready() else None

    def read(self):
        message = self.take()
        return message and (int(message.data), message.lost_before.client)

    def read_all(self):
        return list(iter(self.read, None))


def test_without_a_policy_all_are_read_in_the_order_they_came():
    waiting = Waiting()
    for _ in range(5):
        waiting.come()
    assert waiting.read_all() == [(number, 0) for number in range(5)]


@pytest.mark.parametrize("keep", [1, 2, 3])
def test_the_last_ones_are_kept_and_each_loss_is_told_once(keep):
    waiting = Waiting(keep_last=keep)
    for _ in range(2):  # the second time as the first
        begin = waiting.count
        for _ in range(7):
            waiting.come()
        assert waiting.read_all() == [(begin + 7 - keep, 7 - keep)] + [
            (begin + number, 0) for number in range(8 - keep, 7)]
    assert waiting.subscriber._unreported_loss == 2 * (7 - keep)


def test_without_a_callback_or_a_limit_it_keeps_so_many_as_the_manual_says():
    waiting = Waiting()
    for _ in range(swarmtalk.MESSAGES_THAT_WAIT + 3):
        waiting.come()
    read = waiting.read_all()
    assert len(read) == swarmtalk.MESSAGES_THAT_WAIT and read[0] == (3, 3)
    assert {lost for _, lost in read[1:]} == {0}


def test_the_latest_from_each_replaces_its_sender_alone():
    waiting = Waiting(latest_from_each=True)
    for sender, epoch in [(1, 0), (2, 0), (1, 0), (1, 5), (2, 0)]:
        waiting.come(sender, epoch)
    # 0 went for 2, and the next in the row told it; so with 1 and 4.
    assert [number for number, _ in waiting.read_all()] == [2, 3, 4]
    assert waiting.subscriber._unreported_loss == 2


def test_one_that_is_too_old_when_it_is_read_is_a_loss_of_the_next():
    waiting = Waiting(no_older_than=60)
    for is_old in (False, True, True, False, False):
        waiting.come(is_old=is_old)
    assert waiting.read_all() == [(0, 0), (3, 2), (4, 0)]
    waiting.come(is_old=True)
    assert waiting.read_all() == []
    waiting.come()
    assert waiting.read_all() == [(6, 1)]
    assert waiting.subscriber._unreported_loss == 3


def test_what_the_daemon_lost_before_one_that_is_too_old_is_told_by_the_next():
    waiting = Waiting(no_older_than=60)
    waiting.come(is_old=True, lost=swarmtalk.Loss(air=3, late=1))
    waiting.come()
    assert waiting.take().lost_before == swarmtalk.Loss(air=3, client=1, late=1)


def test_what_the_daemon_lost_before_a_message_that_goes_is_told_by_the_next():
    waiting = Waiting(keep_last=1)
    waiting.come(lost=swarmtalk.Loss(air=3, kernel=1))
    waiting.come(lost=swarmtalk.Loss(daemon=2, late=1))
    message = waiting.take()
    assert message.lost_before == swarmtalk.Loss(air=3, kernel=1, daemon=2, client=1, late=1)
    waiting.come()
    assert not waiting.take().lost_before


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("policy", [{}, {"keep_last": 1}, {"keep_last": 4}, {"no_older_than": 60},
                                    {"latest_from_each": True},
                                    {"latest_from_each": True, "keep_last": 2}])
def test_each_message_is_read_or_told_as_lost_exactly_once(policy, seed):
    """Whatever comes and is read in whatever order: nothing twice, nothing in silence."""
    chance, waiting, read = random.Random(seed), Waiting(**policy), []
    for _ in range(200):
        if chance.random() < 0.6:
            waiting.come(chance.randrange(3), chance.randrange(2), is_old=chance.random() < 0.1)
        elif (found := waiting.read()) is not None:
            read.append(found)
    waiting.come()
    read += waiting.read_all()
    numbers = [number for number, _ in read]
    assert numbers == sorted(set(numbers))
    lost = sum(client for _, client in read)
    assert len(read) + lost == waiting.count
    assert waiting.subscriber._unreported_loss == lost
