"""The map that controllers get, what a scan saw that neither it nor a track explains, and the way that it leaves."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control.policy import people
from mjnav.messages import MOST_STANDING, Observation, ObstacleSamples, Reading
from mjnav.motion.unicycle import integrate
from mjnav.robot.estimation import assumed_noise
from mjnav.robot.seen_space import HIDDEN, FloorMap, SeenSpace, free_arc
from mjnav.scene.bodies import Pillar, Wall
from mjnav.scene.load import load
from mjnav.scene.spec import Scenario
from mjnav.world.simulator import Simulator


def test_legs_and_pillars_are_discs_at_rest_under_their_bodies_names(room):
    scenario, position = room(), np.zeros(2)
    floor_map = FloorMap(scenario)
    discs = floor_map.discs(position)
    assert floor_map.disc_names(position) == ("table0",) * 4 + ("pillar0",)
    assert [disc.radius for disc in discs] == [0.03] * 4 + [scenario.pillars[0].radius]
    assert all(disc.position.shape == (1, 2) and not disc.velocity.any() for disc in discs)
    legs = sorted(tuple(disc.position[0].round(9).tolist()) for disc in discs[:4])
    assert legs == [(3.2, 0.6), (3.2, 1.4), (4.8, 0.6), (4.8, 1.4)]
    assert discs[4].position.tolist() == [[3.0, -1.0]]


@pytest.mark.parametrize(("y", "face"), [(0.0, -1.8), (-5.0, -2.2)])
def test_a_wall_is_its_face_towards_the_robot_longer_by_half_its_thickness(room, y, face):
    floor_map = FloorMap(room("walls.0.thickness=0.4"))
    (wall,) = floor_map.walls(np.array([1.0, y]))
    assert wall == pytest.approx(np.array([[-1.2, face], [8.2, face]]))


def test_of_many_walls_the_nearest_are_seen_under_their_own_names(scenario_of_walls):
    rng = np.random.default_rng(3)
    start = rng.uniform(-50.0, 50.0, (700, 2))
    end = start + rng.uniform(0.1, 3.0, start.shape)
    floor_map = FloorMap(scenario_of_walls(start, end))
    position = np.array([3.0, -2.0])
    names, faces = floor_map.wall_names(position), floor_map.walls(position)
    assert (len(names), faces.shape) == (MOST_STANDING, (MOST_STANDING, 2, 2))
    seen = [int(name.removeprefix("wall")) for name in names]
    assert seen == sorted(seen)
    away = np.array([np.hypot(*(start[i] + t * (end[i] - start[i]) - position)) for i in range(700) for t in SHARES])
    nearest = away.reshape(700, -1).min(axis=1)
    left_out = np.setdiff1d(np.arange(700), seen)
    # A face lies half a thickness from the line, and is as much longer.
    assert nearest[seen].max() <= nearest[left_out].min() + 0.25
    np.testing.assert_allclose(faces.mean(axis=1), 0.5 * (start + end)[seen], atol=0.051)


def test_of_many_pillars_the_nearest_surfaces_are_seen_under_their_own_names_and_none_is_taken_for_a_person(room):
    rng = np.random.default_rng(4)
    at, radius = rng.uniform(-50.0, 50.0, (300, 2)), rng.uniform(0.05, 2.0, 300)
    pillars = tuple(Pillar((x, y), r) for (x, y), r in zip(at.tolist(), radius.tolist(), strict=True))
    scenario = replace(room(), tables=(), pillars=pillars)
    floor_map, position = FloorMap(scenario), np.array([3.0, -2.0])
    names, discs = floor_map.disc_names(position), floor_map.discs(position)
    seen = [int(name.removeprefix("pillar")) for name in names]
    away = np.hypot(*(at - position).T) - radius
    assert seen == sorted(np.argsort(away)[:MOST_STANDING].tolist())
    np.testing.assert_array_equal([disc.position[0] for disc in discs], at[seen])
    assert [disc.radius for disc in discs] == radius[seen].tolist()
    person = ObstacleSamples(np.zeros((2, 2)), np.zeros((2, 2)), 0.3)
    pose = np.zeros((1, 3))
    observation = Observation(pose, pose[:, :2], pose[0, :2], (person, *discs), pose[0, :2], map=floor_map.known)
    assert people(observation) == (person,)


SHARES = np.linspace(0.0, 1.0, 101)


@pytest.fixture
def scenario_of_walls(room):
    """A scene with thin walls between (n, 2) and (n, 2)."""

    def make(start, end) -> Scenario:
        return replace(room(), walls=tuple(map(Wall, start.tolist(), end.tolist())))

    return make


RADIUS = 0.22
BODY = ((0.0, RADIUS),)


LONG = ((-0.14, 0.17), (0.0, 0.17), (0.14, 0.17))


def stepped(points: np.ndarray, v: float, omega: float, discs) -> float:
    """The same as `free_arc` by driving 3 m in steps of a millimetre."""
    way = 0.001 * np.arange(3000)
    turned = omega / abs(v) * way
    along = way * np.sinc(0.5 * turned / np.pi)
    centres = np.sign(v) * np.stack([along * np.cos(0.5 * turned), along * np.sin(0.5 * turned)], axis=1)
    np.testing.assert_allclose(centres[-1], integrate(np.zeros(3), v, omega, way[-1] / abs(v))[:2], atol=1e-9)
    inside = np.zeros((len(way), len(points)), bool)
    for ahead, radius in discs:
        places = centres + ahead * np.stack([np.cos(turned), np.sin(turned)], axis=1)
        inside |= np.hypot(*np.moveaxis(points - places[:, None], -1, 0)) < radius
    inside[:, inside[0] & (np.sign(v) * points[:, 0] <= 0.0)] = False  # it leaves these behind
    entered = np.where(inside.any(axis=0), way[inside.argmax(axis=0)], np.inf)
    return float(np.sort(entered)[1])


coordinate = st.floats(-2.0, 2.0)


@given(
    st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=6),
    st.floats(0.1, 1.0),
    st.floats(-1.5, 1.5),
    st.booleans(),
    st.sampled_from([BODY, LONG]),
)
def test_the_free_way_is_that_of_a_body_that_drives_until_two_points_are_in_it(points, v, omega, back, discs):
    points = np.array(points)
    v = -v if back else v
    found, expected = free_arc(points, v, omega, discs), stepped(points, v, omega, discs)
    if min(found, expected) < 2.9:
        # Where a point is only grazed, millimetres decide.
        grazed = {free_arc(points, v, omega, [(a, r + d) for a, r in discs]) for d in (-2e-3, 2e-3)}
        assert found == pytest.approx(expected, abs=2e-3) or min(grazed) - 2e-3 <= expected <= max(grazed) + 2e-3


def space_of(scenario: Scenario) -> SeenSpace:
    return SeenSpace(scenario, assumed_noise(scenario))


def first_reading(scenario: Scenario) -> Reading:
    return Simulator(scenario, 1).sense()[0]


KEYS = {"physics.engine": "kinematic", "noise.profile": "none", "people": []}
PILLAR = {**KEYS, "pillars": [{"position": [1.5, 0.0], "radius": 0.2}]}
START = np.zeros(3)


def test_what_the_map_has_is_no_limit_and_what_it_misses_is():
    for missing, expected in (([], np.inf), (["pillar0"], 1.5 - 0.2 - RADIUS)):
        scenario = load("crossing1", {**PILLAR, "estimation.map.missing": missing} if missing else PILLAR)
        space = space_of(scenario)
        space.follow(first_reading(scenario), START, ())
        assert space.free_way(0.0, 0.5, 0.0, BODY) == pytest.approx(expected, abs=0.01)


def test_a_robot_that_is_not_where_it_believes_does_not_take_what_it_sees_for_the_map():
    scenario = load("crossing1", PILLAR)
    space = space_of(scenario)
    space.follow(first_reading(scenario), np.array([0.0, 5.0, 0.0]), ())
    assert space.free_way(0.0, 0.5, 0.0, BODY) < 1.2


@pytest.mark.parametrize("value", [0.0, np.inf])
def test_a_gap_counts_from_where_a_thin_thing_would_go_unseen_in_it(value):
    """Covered beams are 0; beams without a return count as blind where the map has a wall."""
    scenario = load("crossing1", {**KEYS, "walls": [{"from": [4.0, -9.0], "to": [4.0, 9.0]}]})
    reading, angles = first_reading(scenario), scenario.sensors.scanner.angles
    for half_width in (0.02, 0.1):
        ranges = reading.scan.copy()
        ranges[np.abs(angles) < half_width] = value
        space = space_of(scenario)
        space.follow(replace(reading, scan=ranges), START, ())
        blind = int((np.abs(angles) < half_width).sum())
        distance = HIDDEN / np.sin(0.5 * (blind + 1) * 2.0 * np.pi / 360)
        way = space.free_way(0.0, 0.5, 0.0, BODY)
        assert way == pytest.approx(distance - RADIUS, abs=0.02 * distance)
        assert space.free_way(0.0, -0.5, 0.0, BODY) == np.inf


def test_the_way_shrinks_as_the_robot_drives_on_without_a_new_scan():
    scenario = load("crossing1", {**PILLAR, "estimation.map.missing": ["pillar0"]})
    space, reading = space_of(scenario), first_reading(scenario)
    space.follow(reading, START, ())
    before = space.free_way(0.0, 0.5, 0.0, BODY)
    later = replace(reading, time=1.0, interval=1.0, odometry=np.array([0.5, 0.0]), gyro=0.0, scan=np.zeros(0))
    space.follow(later, np.array([0.5, 0.0, 0.0]), ())
    assert space.free_way(1.0, 0.5, 0.0, BODY) == pytest.approx(before - 0.5, abs=0.01)
    assert space.age(1.0) == pytest.approx(1.0)


def test_the_blind_side_of_a_lidar_within_the_body_stops_no_disc_behind_its_centre():
    """Beyond the field of view something may stand 0.05 m behind the lidar, which is inside the robot."""
    lidar = {"model": "ideal", "beams": 720, "field_of_view": 1.5 * np.pi, "max_range": 30.0}
    scenario = load("crossing1", {**KEYS, "sensors.lidar": lidar, "walls": [{"from": [4.0, -9.0], "to": [4.0, 9.0]}]})
    space = space_of(scenario)
    space.follow(first_reading(scenario), START, ())
    assert space.free_way(0.0, 0.5, 0.0, LONG) == np.inf
