from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.messages import Contact
from mjnav.metrics import safety
from mjnav.metrics.progress import ROWS
from mjnav.scene.spec import LaneSpec, Pillar, Table, Wall

coordinates = st.floats(-10, 10)
routes = arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=coordinates)


def test_an_encounter_between_two_ticks_is_seen(trajectory_through, scenario_with):
    # they pass at x = 0.5, half-way between the ticks, 1 m apart
    trajectory = trajectory_through([[0, 0], [1, 0]], people=[[[1.0, 1.0]], [[0.0, 1.0]]])
    assert safety.clearances(trajectory, scenario_with(num_people=1)).least == pytest.approx(1.0 - 0.55)


@pytest.mark.parametrize("num", [ROWS, ROWS + 1, ROWS + 2, 2 * ROWS + 2])  # of states
def test_an_encounter_in_whichever_step_of_a_long_run_is_seen(trajectory_through, scenario_with, num):
    scenario = scenario_with(num_people=1)
    for step in {0, ROWS - 2, min(ROWS - 1, num - 2), min(ROWS, num - 2), num - 2}:
        people = np.full((num, 1, 2), 50.0)
        people[step], people[step + 1] = [-30.0, 1.0], [30.0, 1.0]
        trajectory = trajectory_through(np.zeros((num, 2)), people=people)
        assert safety.clearances(trajectory, scenario).least == pytest.approx(1.0 - 0.3 - 0.25)


def test_overlap_is_negative_clearance(trajectory_through, scenario_with):
    trajectory = trajectory_through([[0, 0], [0, 0]], people=[[[0.5, 0.0]], [[0.5, 0.0]]])
    assert safety.clearances(trajectory, scenario_with(num_people=1)).least == pytest.approx(-0.05)


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


def test_an_empty_room_has_no_clearance(trajectory_through, scenario_with):
    assert safety.clearances(trajectory_through([[0, 0], [1, 0]]), scenario_with()).least is None


@pytest.mark.parametrize(
    ("bodies", "expected"),
    [
        ({"pillars": (Pillar((1.0, 2.0), radius=0.4),)}, 2.0 - 0.4),
        ({"walls": (Wall((-5.0, 3.0), (5.0, 3.0), thickness=0.2),)}, 2.9),
        ({"walls": (Wall((3.0, 0.0), (9.0, 0.0), thickness=0.2),)}, 1.0),
        ({"tables": (Table((1.0, 3.0), size=(2.0, 1.0), leg_radius=0.05),)}, 2.5 - 0.05),
    ],
)
def test_clearance_from_still_bodies(trajectory_through, scenario_with, bodies, expected):
    trajectory = trajectory_through([[0, 0], [2, 0]])
    assert safety.clearances(trajectory, scenario_with(**bodies)).least == pytest.approx(expected - 0.25)


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


def test_a_contact_that_lasts_counts_once_and_a_new_one_again():
    lasting = [contact("person0", t) for t in (1.04, 1.1, 1.2, 1.3)]
    assert safety.collisions(lasting, 0.1) == {"person": 1, "table": 0, "wall": 0, "pillar": 0}
    again = [*lasting, contact("person0", 1.6)]
    assert safety.collisions(again, 0.1)["person"] == 2


def test_contacts_with_different_bodies_count_each():
    contacts = [contact("person1", 1.0), contact("person0", 1.0), contact("wall0", 1.1, "wall")]
    assert safety.collisions(contacts, 0.1) == {"person": 2, "table": 0, "wall": 1, "pillar": 0}


def test_a_body_seen_again_within_two_periods_is_the_same_contact():
    assert safety.collisions([contact("person0", 1.0), contact("person0", 1.25)], 0.125)["person"] == 1
    assert safety.collisions([contact("person0", 1.0), contact("person0", 1.375)], 0.125)["person"] == 2


def test_a_contact_of_a_kind_of_its_own_counts_too():
    assert safety.collisions([contact("door0", 1.0, "door")], 0.1)["door"] == 1


def test_lane_violation_counts_the_time_that_any_part_is_over(trajectory_through, scenario_with):
    lanes = LaneSpec(left=(0.0, 1.0, -1.0), right=(0.0, 1.0, 1.0))  # y <= 1 and y >= -1
    scenario = scenario_with(lanes=lanes)
    # the robot's edge is over the left boundary from y = 0.75 on: half of the second period, all of the third
    trajectory = trajectory_through([[0, 0.5], [1, 0.5], [2, 1.0], [3, 1.0]])
    assert safety.lane_violation(trajectory, scenario) == pytest.approx(0.15)
    mirrored = trajectory_through([[0, -0.5], [1, -0.5], [2, -1.0], [3, -1.0]])
    assert safety.lane_violation(mirrored, scenario) == pytest.approx(0.15)
    assert safety.lane_violation(trajectory_through([[0, 0], [1, 0]]), scenario) == 0.0


def test_to_drive_with_an_edge_on_the_boundary_is_no_violation(trajectory_through, scenario_with):
    scenario = scenario_with(lanes=LaneSpec(left=(0.0, 1.0, -1.0), right=(0.0, 1.0, 1.0)))
    for y in (0.75, -0.75):
        assert safety.lane_violation(trajectory_through([[0, y], [1, y]]), scenario) == 0.0


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
