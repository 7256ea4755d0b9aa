"""Each kind of fault of a channel's messages: what is heard of values 1, 2, 3, ..., one each 0.1 s."""

import numpy as np
import pytest

from mjnav.rng import stream
from mjnav.scene.faults import (
    BiasWalk,
    ChannelFaults,
    Dropout,
    Late,
    NotANumber,
    Outliers,
    Repeated,
    Stuck,
)
from mjnav.world.faults import FaultyChannel, Message

SHAPE = (1, 2)
NUM = 40


def heard(faults: ChannelFaults, *, seed: int = 1, silent: tuple[int, ...] = ()) -> list[Message | None]:
    """What comes of NUM messages; message k says (k + 1, k + 1)."""
    channel = FaultyChannel("pose", faults, SHAPE, seed)
    sent = [Message(0.1 * k, np.full(SHAPE, k + 1.0), np.zeros(0)) for k in range(NUM)]
    return [channel.pass_on(m.time, None if k in silent else m) for k, m in enumerate(sent)]


def values(messages: list[Message | None]) -> list[float]:
    return [np.nan if m is None else float(m.rows[0, 0]) for m in messages]


TRUE = [k + 1.0 for k in range(NUM)]


def test_a_stuck_value_is_the_last_before_until_the_fault_is_over():
    found = values(heard(ChannelFaults(stuck=Stuck(start=1.0, end=2.0))))
    assert found == [*TRUE[:10], *[10.0] * 10, *TRUE[20:]]


def test_late_messages_come_after_the_delay_with_the_time_at_which_they_were_measured():
    found = heard(ChannelFaults(late=Late(start=1.0, end=2.0, delay=0.25)))
    assert [m is None for m in found[10:14]] == [True, True, True, False]
    assert [m.time for m in found[13:20] if m is not None] == pytest.approx([0.1 * k for k in range(10, 17)])
    assert values(found[:10] + found[20:]) == TRUE[:10] + TRUE[20:]


def test_a_repeated_message_is_the_one_before_with_its_time():
    found = heard(ChannelFaults(repeated=Repeated(share=1.0, start=1.0)))
    assert values(found) == [*TRUE[:10], *[10.0] * (NUM - 10)]
    last = found[-1]
    assert last is not None
    assert last.time == pytest.approx(0.9)


def test_lost_messages_are_those_whose_draw_is_below_the_share():
    draws = stream(1, "fault.pose.dropout").random(NUM)
    found = values(heard(ChannelFaults(dropout=Dropout(share=0.3))))
    assert np.isnan(found).tolist() == (draws < 0.3).tolist()


def test_outliers_are_off_by_their_size_as_often_as_their_share_says():
    channel = FaultyChannel("lidar", ChannelFaults(outliers=Outliers(share=0.2, size=3.0)), (1000, 1), 1)
    found = channel.pass_on(0.0, Message(0.0, np.zeros((1000, 1)), np.zeros(0)))
    assert found is not None
    assert set(found.rows.ravel()) == {0.0, 3.0, -3.0}
    assert np.mean(found.rows != 0.0) == pytest.approx(0.2, abs=4 * np.sqrt(0.2 * 0.8 / 1000))


def test_a_bias_walks_with_its_variance_in_proportion_to_time():
    ends = []
    for seed in range(300):
        last = heard(ChannelFaults(bias_walk=BiasWalk(size=0.5, start=0.5)), seed=seed)[-1]
        assert last is not None
        ends += (last.rows[0] - NUM).tolist()
    time = 0.1 * (NUM - 1) - 0.5
    assert np.std(ends) == pytest.approx(0.5 * np.sqrt(time), rel=4 / np.sqrt(2 * len(ends)))


@pytest.mark.parametrize("kind", [Outliers, NotANumber, Dropout])
def test_what_is_drawn_does_not_depend_on_when_a_fault_lasts_nor_on_messages_before(kind):
    name = {Outliers: "outliers", NotANumber: "nan", Dropout: "dropout"}[kind]
    begun_late = heard(ChannelFaults(**{name: kind(start=2.0, share=0.5)}))
    silent_before = heard(ChannelFaults(**{name: kind(share=0.5)}), silent=tuple(range(20)))
    np.testing.assert_array_equal(values(begun_late[20:]), values(silent_before[20:]))
