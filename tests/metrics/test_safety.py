from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav import load_scenario
from mjnav.messages import Contact
from mjnav.metrics import safety
from mjnav.metrics.effort import heading_change
from mjnav.metrics.progress import ROWS, path_length
from mjnav.scene.faults import Faults, Kidnapping
from mjnav.scene.people import SocialForce
from mjnav.scene.spec import ConstantVelocity, LaneSpec, Person, Pillar, Table, Wall
from tests.metrics.conftest import make_scenario, make_trajectory

coordinates = st.floats(-10, 10)
routes = arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=coordinates)


@pytest.mark.parametrize("num", [ROWS, ROWS + 1, ROWS + 2, 2 * ROWS + 2])  # of states
def test_an_encounter_in_whichever_step_of_a_long_run_is_seen(trajectory_through, scenario_with, num):
    scenario = scenario_with(num_people=1)
    for step in {0, ROWS - 2, min(ROWS - 1, num - 2), min(ROWS, num - 2), num - 2}:
        people = np.full((num, 1, 2), 50.0)
        people[step], people[step + 1] = [-30.0, 1.0], [30.0, 1.0]
        trajectory = trajectory_through(np.zeros((num, 2)), people=people)
        assert safety.clearances(trajectory, scenario).least == pytest.approx(1.0 - 0.3 - 0.25)


def test_people_and_things_are_told_apart_and_who_is_not_there_is_at_no_distance(trajectory_through, scenario_with):
    scenario = scenario_with(num_people=2, pillars=(Pillar((2.0, 3.0), radius=0.4),))
    nobody = [np.nan, np.nan]
    people = [[nobody, nobody], [[1.0, 2.0], nobody], [nobody, nobody], [nobody, nobody]]
    found = safety.clearances(trajectory_through([[0, 0], [1, 0], [2, 0], [2, 1]], people=people), scenario)
    assert found.least_person == pytest.approx(2.0 - 0.3 - 0.25)  # at the one tick at which somebody is there
    assert found.least_thing == found.least == pytest.approx(2.0 - 0.4 - 0.25)
    assert found.mean_thing == pytest.approx((np.hypot(1.0, 3.0) + 3.0 + 2.0) / 3.0 - 0.4 - 0.25)
    alone = safety.clearances(
        trajectory_through([[0, 0], [1, 0]], people=[[nobody], [nobody]]), scenario_with(num_people=1)
    )
    assert alone == safety.Clearances(None, None, None, None)


def test_a_kidnapped_robot_did_not_drive_there(trajectory_through, scenario_with):
    jump = trajectory_through([[0, 0], [0.1, 0], [5.1, 0], [5.1, 0.1]], people=np.full((4, 1, 2), [2.0, 0.0]))
    jump.robot_pose[2:, 2] = 1.0
    things = {"num_people": 1, "pillars": (Pillar((4.0, 0.0), radius=0.4),)}
    scenario = scenario_with(faults=Faults(Kidnapping(0.1, (5.1, 0.0, 1.0))), **things)
    found = safety.clearances(jump, scenario)
    assert (found.least_person, found.least_thing) == pytest.approx((1.9 - 0.3 - 0.25, 1.1 - 0.4 - 0.25))
    assert safety.clearances(jump, scenario_with(**things)).least < 0.0
    assert path_length(jump, scenario) == pytest.approx(0.2)
    assert heading_change(jump, scenario) == 0.0


def test_of_a_step_in_which_somebody_comes_or_goes_the_end_counts_at_which_they_are_there(
    trajectory_through, scenario_with
):
    people = np.array([[np.nan, np.nan], [1.0, 1.0], [2.0, 3.0], [np.nan, np.nan]])[:, None]
    found = safety.clearance(trajectory_through(np.zeros((4, 2)), people=people), scenario_with(num_people=1))
    assert found["person0"] + 0.3 + 0.25 == pytest.approx(np.sqrt([2.0, 2.0, 13.0]))


def test_the_nearest_of_all_things_counts_at_each_point(scenario_with):
    scenario = scenario_with(
        pillars=(Pillar((1.0, 2.0), radius=0.4), Pillar((9.0, 9.0), radius=0.1)),
        walls=(Wall((6.0, -1.0), (6.0, 1.0), thickness=0.2), Wall((-9.0, -1.0), (-9.0, 1.0), thickness=0.2)),
    )
    points = np.array([[1.0, 0.0], [9.0, 7.0], [5.0, 0.0], [-7.0, 0.0]])
    assert safety.thing_distance(points, scenario) == pytest.approx([1.6, 1.9, 0.9, 1.9])


def test_every_step_has_its_own_clearance_from_every_body(trajectory_through, scenario_with):
    scenario = scenario_with(
        num_people=1,
        tables=(Table((3.0, -3.0), size=(2.0, 2.0), leg_radius=0.05),),  # legs at x = 2 and 4, y = -2 and -4
        pillars=(Pillar((1.0, 2.0), radius=0.4),),
        walls=(Wall((6.0, -1.0), (6.0, 1.0), thickness=0.2),),
    )
    route = [[0, 0], [1, 0], [2, 0], [4, 0], [1, 0]]
    trajectory = trajectory_through(route, people=[[[0.0, -1.5]]] * 5)
    found = safety.clearance(trajectory, scenario)
    from_centre = {
        "person0": [1.5, np.hypot(1.0, 1.5), 2.5, np.hypot(1.0, 1.5)],
        "table0": [np.hypot(1.0, 2.0), 2.0, 2.0, 2.0],
        "pillar0": [2.0, 2.0, np.hypot(1.0, 2.0), 2.0],
        "wall0": [4.9, 3.9, 1.9, 1.9],
    }
    size = {"person0": 0.3, "table0": 0.05, "pillar0": 0.4, "wall0": 0.0}
    assert list(found) == list(from_centre)
    for name, distance in from_centre.items():
        assert found[name] == pytest.approx(np.array(distance) - size[name] - 0.25), name
    assert safety.clearances(trajectory, scenario).least == pytest.approx(1.5 - 0.3 - 0.25)


def sampled_wall_distance(route, wall):
    """Distance to the rectangle of many points along the route, each by clipping in the wall's frame."""
    t = np.linspace(0, 1, 401)[:, None]
    points = np.concatenate([a + t * (b - a) for a, b in pairwise(route)] or [route])
    start, end = np.array(wall.start), np.array(wall.end)
    length = np.linalg.norm(end - start)
    along = (end - start) / length
    local = (points - start) @ np.stack([along, [-along[1], along[0]]], axis=-1)
    low, high = [0.0, -wall.thickness / 2], [length, wall.thickness / 2]
    distance = np.linalg.norm(local - np.clip(local, low, high), axis=-1)
    return distance.min()


@given(routes, coordinates, coordinates, st.floats(0.1, 8), st.floats(-3.2, 3.2), st.floats(0.05, 1))
def test_wall_distance_is_that_of_many_points_on_the_way(route, x, y, length, angle, thickness):
    wall = Wall((x, y), (x + length * np.cos(angle), y + length * np.sin(angle)), thickness)
    sampled = sampled_wall_distance(route, wall)
    exact = safety.wall_distance(route, wall).min()
    step = max(np.hypot(*np.diff(route, axis=0).T), default=0.0) / 400
    if sampled > step:  # the route stays outside
        assert sampled - step - 1e-9 <= exact <= sampled + 1e-9
    assert exact <= sampled + 1e-9 or sampled <= step


@pytest.mark.parametrize("corner", [(2.0, 0.5), (-2.0, 0.5), (-2.0, -0.5), (2.0, -0.5)])
def test_past_a_corner_of_a_wall_the_distance_is_to_the_corner(corner):
    x, y = corner
    route = np.array([[x + 3 * np.sign(x), y - np.sign(y)], [x - np.sign(x), y + 3 * np.sign(y)]])
    wall = Wall((-2.0, 0.0), (2.0, 0.0), thickness=1.0)
    assert safety.wall_distance(route, wall).tolist() == pytest.approx([np.sqrt(2.0)])


def test_inside_a_wall_the_distance_is_minus_the_depth():
    wall = Wall((0.0, 0.0), (4.0, 0.0), thickness=1.0)
    assert safety.wall_distance(np.array([[2.0, 0.2]]), wall).tolist() == pytest.approx([-0.3])
    assert safety.wall_distance(np.array([[3.9, 0.0]]), wall).tolist() == pytest.approx([-0.1])


def contact(name, time, kind="person"):
    return Contact(kind, name, 1.0, time)


def test_the_clearance_of_a_robot_of_discs_is_that_of_the_nearest_of_them():
    """A Jackal in three discs of 0.17 m, the outer ones 0.14 m from its centre, beside a wall and pillars."""
    walls = [{"from": [-9.0, 0.6], "to": [9.0, 0.6]}]
    keys = {"robot.model": "jackal", "robot.discs": 3, "people": [], "walls": walls}
    pillars = [{"position": [1.0, 0.0], "radius": 0.1}, {"position": [0.3, -1.0], "radius": 0.1}]
    scenario = load_scenario("crossing1", {**keys, "pillars": pillars})
    radius = np.hypot(0.07, 0.155)
    for heading in (0.0, 0.5, np.pi / 2.0):
        found = safety.clearance(make_trajectory([[0.0, 0.0]], robot_pose=np.array([[0.0, 0.0, heading]])), scenario)
        at = [ahead * np.array([np.cos(heading), np.sin(heading)]) for ahead in (-0.14, 0.0, 0.14)]
        assert found["wall0"] == pytest.approx(min(0.55 - y for _, y in at) - radius)
        for name, place in (("pillar0", (1.0, 0.0)), ("pillar1", (0.3, -1.0))):
            assert found[name] == pytest.approx(min(np.hypot(*(place - disc)) for disc in at) - 0.1 - radius)


def test_a_body_seen_again_within_two_periods_is_the_same_contact():
    assert safety.collisions([contact("person0", 1.0), contact("person0", 1.25)], 0.125)["person"] == 1
    assert safety.collisions([contact("person0", 1.0), contact("person0", 1.375)], 0.125)["person"] == 2


def test_lane_violation_counts_the_time_that_any_part_is_over(trajectory_through, scenario_with):
    lanes = LaneSpec(left=(0.0, 1.0, -1.0), right=(0.0, 1.0, 1.0))  # y <= 1 and y >= -1
    scenario = scenario_with(lanes=lanes)
    # the robot's edge is over the left boundary from y = 0.75 on: half of the second period, all of the third
    trajectory = trajectory_through([[0, 0.5], [1, 0.5], [2, 1.0], [3, 1.0]])
    assert safety.lane_violation(trajectory, scenario) == pytest.approx(0.15)
    mirrored = trajectory_through([[0, -0.5], [1, -0.5], [2, -1.0], [3, -1.0]])
    assert safety.lane_violation(mirrored, scenario) == pytest.approx(0.15)
    assert safety.lane_violation(trajectory_through([[0, 0], [1, 0]]), scenario) == 0.0


def test_lane_clearance_is_from_the_robots_edge_to_the_nearer_boundary(trajectory_through, scenario_with):
    scenario = scenario_with(lanes=LaneSpec(left=(0.0, 1.0, -1.0), right=(0.0, 1.0, 1.0)))
    radius = scenario.robot.radius
    for start in (0.0, 5.0):  # what is looked at may begin later than the run
        trajectory = trajectory_through([[0, 0.0], [1, 0.5], [2, -0.1]], time=start + np.array([0.0, 0.1, 0.2]))
        found = safety.lane_clearance(trajectory, scenario)
        assert found is not None
        least, mean = found
        assert least == pytest.approx(0.5 - radius)
        # by trapezoids over |y| = 0, 0.5, 0.1
        assert mean == pytest.approx(1.0 - radius - (0.25 + 0.3) / 2)
    single = safety.lane_clearance(trajectory_through([[0, 0.5]]), scenario)
    assert single == pytest.approx((0.5 - radius, 0.5 - radius))


def test_without_lanes_there_is_no_violation_to_speak_of(trajectory_through, scenario_with):
    trajectory = trajectory_through([[0, 0], [1, 0]])
    assert safety.lane_violation(trajectory, scenario_with()) is None
    assert safety.lane_clearance(trajectory, scenario_with()) is None


def walker(sees):
    return Person((5.0, 5.0), SocialForce(((0.0, 0.0),)), sees_robot=sees)


def hit(v, walking, *, sees, times=(0.12,), at=(1.0, 0.0), heading=0.0):
    """A robot at (3, -7) that drives at v and touches a person who walks so, in the second tick.

    Where the person is and walks to is seen from the robot, which drives along +x there.
    """
    rows, place = 4, np.array([3.0, -7.0])
    ahead = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    trajectory = make_trajectory(
        np.tile(place, (rows, 1)),
        robot_pose=np.tile([*place, heading], (rows, 1)),
        people=np.tile(place + at @ ahead, (rows, 1, 1)),
        robot_twist=np.tile([v, 0.0], (rows, 1)),
        people_velocity=np.tile(walking @ ahead, (rows, 1, 1)),
        contacts=tuple(Contact("person", "person0", 0.0, time) for time in times),
    )
    return trajectory, replace(make_scenario(), people=(walker(sees),))


@pytest.mark.parametrize(
    ("v", "walking", "sees", "moving", "at_fault"),
    [
        (0.8, (0.0, 0.0), True, True, True),  # it ran into somebody who stood
        (0.8, (-0.5, 0.0), True, True, True),  # it came faster
        (0.5, (-0.8, 0.0), True, True, False),  # the person came faster, and could have given way
        (0.5, (-0.8, 0.0), False, True, True),  # who does not see it cannot
        (0.5, (1.2, 0.0), True, True, True),
        (-0.3, (-0.8, 0.0), True, True, False),  # it backed away
        (0.0, (-0.8, 0.0), False, False, False),  # at rest it is never at fault
        (0.09, (0.0, 0.0), False, False, False),  # what noise moves a robot that stands by
    ],
)
@pytest.mark.parametrize("heading", [0.0, 2.0, -2.5])
def test_the_rule(v, walking, sees, moving, at_fault, heading):
    (touch,) = safety.touches(*hit(v, walking, sees=sees, heading=heading))
    assert (touch.moving, touch.at_fault) == (moving, at_fault)
    assert (touch.person, touch.speed) == (0, abs(v))


def test_what_counts_is_the_state_before_the_contact():
    trajectory, scenario = hit(0.8, (0.0, 0.0), sees=False)
    stopped = np.array([[0.8, 0.0], [0.8, 0.0], [0.0, 0.0], [0.0, 0.0]])  # by the contact at 0.12 s
    (touch,) = safety.touches(replace(trajectory, robot_twist=stopped), scenario)
    assert touch.moving
    assert touch.at_fault


def test_how_many_people_see_the_robot():
    scenario, blind, seeing = make_scenario(), walker(False), walker(True)
    deaf = Person((5.0, 5.0), ConstantVelocity((1.0, 0.0)), sees_robot=True)  # walks on whatever it sees
    assert safety.sees_robot(replace(scenario, people=(deaf, replace(deaf, temperament="scared")))) == (False, True)
    for people, expected in (
        ((), None),
        ((blind,) * 3, "none"),
        ((seeing,) * 2, "all"),
        ((seeing, blind, seeing), "2 of 3"),
    ):
        assert safety.people_see_robot(replace(scenario, people=people)) == expected
