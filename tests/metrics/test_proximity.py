import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.metrics import social as proximity
from tests.metrics.conftest import make_scenario, make_trajectory

REACH = 0.25 + 0.3


def beside(distances):
    """A robot that stands, and people at these distances between the surfaces, (T + 1, P); NaN is nobody."""
    distances = np.asarray(distances, float)
    people = np.stack([np.where(np.isnan(distances), np.nan, 0.0), distances + REACH], axis=-1)
    return make_trajectory(np.zeros((len(distances), 2)), people=people), make_scenario(num_people=distances.shape[1])


def test_shares_and_mean_by_hand():
    found = proximity.proximity(*beside([[0.4, 9.0], [0.46, 1.0], [5.0, 3.0], [4.0, np.nan], [np.nan, np.nan]]))
    assert found == pytest.approx(((0.4 + 0.46 + 3.0 + 4.0) / 4, 0.6, 0.2, 0.4, 0.6))


def test_without_people_nothing_is_defined_and_with_nobody_there_only_the_shares():
    assert proximity.proximity(make_trajectory([[0, 0]]), make_scenario()) is None
    assert proximity.min_time_to_collision(make_trajectory([[0, 0]]), make_scenario()) is None
    found = proximity.proximity(*beside([[np.nan], [np.nan]]))
    assert found == (None, 1.0, 0.0, 0.0, 0.0)


@given(st.lists(st.floats(0.0, 5.0), min_size=1, max_size=8))
def test_a_larger_space_is_entered_at_least_as_often(distances):
    found = proximity.proximity(*beside(np.array(distances)[:, None]))
    assert found is not None
    compliance, intimate, personal, social = (value or 0.0 for value in found[1:])
    assert 0.0 <= intimate <= personal <= social <= 1.0
    assert intimate <= 1.0 - compliance + 1e-9 <= personal + 2e-9


def meeting(position, walking, speed=0.0):
    """A robot that drives along +x from the origin and a person at a position, for one state."""
    return make_trajectory(
        [[0, 0]], people=[[position]], robot_twist=np.array([[speed, 0.0]]), people_velocity=np.array([[walking]])
    )


@pytest.mark.parametrize(
    ("position", "walking", "speed", "expected"),
    [
        ((4.0, 0.0), (-1.0, 0.0), 0.5, (4.0 - REACH) / 1.5),  # towards each other
        ((4.0, 0.0), (1.0, 0.0), 0.5, None),  # the person is faster
        ((4.0, 0.0), (0.0, 0.0), 0.0, None),  # both stand
        ((4.0, 1.0), (-1.0, 0.0), 0.0, None),  # it passes
        ((0.0, 3.0), (0.0, -1.0), 0.0, 3.0 - REACH),
        ((3.0, 3.0), (0.0, -1.0), 1.0, 3.0 - REACH / np.sqrt(2.0)),  # at right angles
        ((0.5, 0.0), (1.0, 0.0), 0.0, 0.0),  # in contact
        ((np.nan, np.nan), (np.nan, np.nan), 1.0, None),
    ],
)
def test_time_to_collision_by_hand(position, walking, speed, expected):
    found = proximity.min_time_to_collision(meeting(position, walking, speed), make_scenario(num_people=1))
    assert found == (None if expected is None else pytest.approx(expected))
