"""How a run ends, by the truth."""

import numpy as np
import pytest

from mjnav.loop.events import Referee
from mjnav.messages import Contact, WorldState

TOUCH = (Contact("wall", "wall0", 12.4, 0.25),)


def state(x: float, time: float = 0.0, contacts: tuple[Contact, ...] = ()) -> WorldState:
    return WorldState(time, np.array([x, 0.0, 0.0]), np.zeros(2), np.zeros((0, 2)), np.zeros((0, 2)), contacts)


@pytest.mark.parametrize(
    ("truth", "outcome"),
    [
        (state(0.0), None),
        (state(6.0, time=0.5), "goal"),
        (state(5.7 + 1e-9, time=0.5), "goal"),
        (state(5.69, time=0.5), None),
        (state(0.0, time=1.0), "timeout"),
        (state(0.0, time=1.0 - 1e-12), "timeout"),  # a time of whole steps is rounded
        (state(0.0, time=0.998), None),
        (state(0.0, contacts=TOUCH), "collision"),
        (state(6.0, time=1.0), "goal"),
        (state(6.0, time=1.0, contacts=TOUCH), "collision"),
    ],
)
def test_a_collision_counts_before_the_goal_and_the_goal_before_time(room, truth, outcome):
    assert Referee(room()).outcome(truth, on_last_leg=True) == outcome


def test_a_routes_last_point_counts_on_the_last_leg_only(room):
    referee = Referee(room("robot.waypoints=[[3.0, 0.0], [0.0, 0.0]]"))
    assert referee.outcome(state(0.0), on_last_leg=False) is None
    assert referee.outcome(state(0.0), on_last_leg=True) == "goal"
