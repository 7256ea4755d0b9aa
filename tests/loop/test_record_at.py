"""The tick at a moment, of a run that goes no further."""

import pytest

from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import record_at

KINEMATIC = ("physics.engine=kinematic",)


@pytest.fixture(scope="module")
def short():
    """It reaches its goal within two seconds."""
    return load_scenario("crossing1", (*KINEMATIC, "robot.goal=[0.9, 0.0]", "control.rate=5"))


@pytest.fixture(scope="module")
def whole(short):
    """All ticks of `short`, and when it ended."""
    records = []
    result = Episode(short, watch=records.append).run()
    assert result.summary["outcome"] == "goal"
    return records, result.summary["time_s"]


@pytest.mark.parametrize(
    ("time", "tick"), [(0.0, 0), (0.1999, 0), (0.2, 1), (0.6, 3), (0.6000001, 3), (0.79, 3), (1.0, 5)]
)
def test_it_is_the_tick_then_or_the_last_before(short, whole, time, tick):
    record, expected = record_at(short, time), whole[0][tick]
    assert record.tick == tick
    assert record.truth.time == pytest.approx(0.2 * tick)
    assert (record.observation.robot_pose == expected.observation.robot_pose).all()
    assert (record.decision.v, record.decision.omega) == (expected.decision.v, expected.decision.omega)


def test_after_the_end_of_a_run_there_is_none(short, whole):
    _, end = whole
    with pytest.raises(InvalidValue, match=rf"time: found .*; allowed: 0 to {end:g} s: there the run ended \(goal\)"):
        record_at(short, end + 0.05)
