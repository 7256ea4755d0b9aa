from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics import social
from mjnav.metrics.social import Detour, detour
from mjnav.motion.social_force import FORMS, accelerations
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Wall, Waypoints
from tests.metrics.conftest import make_scenario, make_trajectory

LAW = FORMS["moussaid"]._replace(cut=100.0, drive=0.0, lookahead=0.0, obstacle_strength=0.0)


def pushed(position, velocity):
    """The force on each of two bodies by the kernel that people decide with, (2, 2)."""
    nothing = np.zeros((2, 2))
    everyone, seen = np.arange(2), np.ones(2, bool)
    return accelerations(
        np.array(position), np.array(velocity), np.full(2, 0.3), everyone, nothing, np.array(velocity), seen, ~seen, -1,
        np.zeros((0, 3)), np.zeros((0, 6)), LAW,
    )  # fmt: skip


def test_the_law_is_the_one_that_people_decide_with():
    rng = np.random.default_rng(5)
    for position, velocity in zip(rng.normal(0.0, 1.5, (50, 2, 2)), rng.normal(0.0, 1.0, (50, 2, 2)), strict=True):
        on_first, on_second = pushed(position, velocity)
        found = social.pair_force(position[1] - position[0], velocity[0] - velocity[1])
        assert found == pytest.approx(on_first, rel=1e-9, abs=1e-12)
        assert -found == pytest.approx(on_second, rel=1e-9, abs=1e-12)


def test_forces_and_work_by_hand():
    # Everybody stands: D = e, B = gamma, theta = 0, so the force is A exp(-d / gamma) along e.
    people = np.tile([[1.0, 0.0], [-1.0, 0.0]], (3, 1, 1))
    people[1, 1] = np.nan  # one of them is away at the second tick
    things = {"walls": (Wall((-5.0, 2.0), (5.0, 2.0), 0.2),), "pillars": (Pillar((0.0, -4.0), radius=0.5),)}
    scenario = make_scenario(num_people=2, **things)
    found = social.social_forces(make_trajectory(np.zeros((3, 2)), people=people), scenario)
    one = 2.1 * np.exp(-1.0 / 0.35)
    work = 0.4 * one + 0.2 * 10.0 * np.exp(-(1.9 - 0.25) / 0.2)
    assert found == pytest.approx((0.1 * 3 * one, 0.1 * one, work))  # on the robot, those from both sides cancel


REACH = 0.25 + 0.3


def beside(distances):
    """A robot that stands, and people at these distances between the surfaces, (T + 1, P); NaN is nobody."""
    distances = np.asarray(distances, float)
    people = np.stack([np.where(np.isnan(distances), np.nan, 0.0), distances + REACH], axis=-1)
    return make_trajectory(np.zeros((len(distances), 2)), people=people), make_scenario(num_people=distances.shape[1])


def test_shares_and_mean_by_hand():
    found = social.proximity(*beside([[0.4, 9.0], [0.46, 1.0], [5.0, 3.0], [4.0, np.nan], [np.nan, np.nan]]))
    assert found == pytest.approx(((0.4 + 0.46 + 3.0 + 4.0) / 4, 0.6, 0.2, 0.4, 0.6))


def test_without_people_nothing_is_defined_and_with_nobody_there_only_the_shares():
    assert social.proximity(make_trajectory([[0, 0]]), make_scenario()) is None
    assert social.min_time_to_collision(make_trajectory([[0, 0]]), make_scenario()) is None
    found = social.proximity(*beside([[np.nan], [np.nan]]))
    assert found == (None, 1.0, 0.0, 0.0, 0.0)


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
    found = social.min_time_to_collision(meeting(position, walking, speed), make_scenario(num_people=1))
    assert found == (None if expected is None else pytest.approx(expected))


def compared(people, with_robot, without):
    """The detour of people who are at these places (T + 1, P, 2) with the robot and without it."""
    scenario = replace(make_scenario(), people=tuple(people))
    with_robot = np.asarray(with_robot, float)
    return detour(
        make_trajectory(np.zeros((len(with_robot), 2)), people=with_robot), np.asarray(without, float), scenario
    )


def test_the_way_round_the_robot_by_hand():
    walker = Person((0.0, 0.0), Waypoints(((2.0, 0.0),), loop=False))
    without = [[0, 0], [1, 0], [2, 0], [2, 0], [2, 0]]
    round_it = [[0, 0], [0, 1], [1, 1], [2, 1], [2, 0]]
    found = compared([walker], np.array(round_it)[:, None], np.array(without)[:, None])
    assert (found.path_m, found.delay_s) == pytest.approx((4.0 - 2.0, 0.2))
    assert found.displacement_m == pytest.approx((0.0 + np.sqrt(2.0) + np.sqrt(2.0) + 1.0 + 0.0) / 5.0)


def test_a_route_is_compared_up_to_the_last_waypoint_reached_in_both():
    walker = Person((0.0, 0.0), Waypoints(((1.0, 0.0), (2.0, 0.0), (4.0, 0.0)), loop=False))
    without = np.column_stack([[0.0, 1.0, 2.0, 3.0, 4.0], np.zeros(5)])
    held_up = np.column_stack([[0.0, 0.5, 1.0, 1.5, 2.0], np.zeros(5)])
    found = compared([walker], held_up[:, None], without[:, None])
    assert (found.path_m, found.delay_s) == pytest.approx((0.0, 0.2))


def test_without_waypoints_only_the_places_are_compared_and_only_while_they_are_there_in_both():
    walker = Person((0.0, 0.0), ConstantVelocity((1.0, 0.0)))
    nobody = [np.nan, np.nan]
    without = np.array([nobody, [0, 0], [1, 0], nobody, [5, 5]])[:, None]
    pushed = np.array([nobody, [0, 0], [1, 0.5], [2, 0.5], [3, 0.5]])[:, None]
    assert compared([walker], pushed, without) == Detour(None, None, 0.25)


def test_nobody_has_none():
    assert compared([], np.zeros((3, 0, 2)), np.zeros((3, 0, 2))) == Detour()


def test_without_people_there_are_none_and_without_things_none_of_theirs():
    assert social.social_forces(make_trajectory([[0, 0]] * 3), make_scenario()) is None
    scenario = replace(make_scenario(num_people=1))
    found = social.social_forces(make_trajectory([[0, 0]] * 3, people=[[[2.0, 0.0]]] * 3), scenario)
    assert found is not None
    on_people, on_robot, work = found
    assert work == on_people + on_robot
