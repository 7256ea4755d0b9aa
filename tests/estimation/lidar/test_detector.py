"""Bodies found in scans of rooms that are cast exactly, or by the world with noise."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.estimation.lidar.detector import Detector
from mjnav.messages import Reading, RobotBelief
from mjnav.scenarios.spec import ConstantVelocity, Noise, Person, Physics, Pillar, Robot, Scenario, Wall
from mjnav.world.simulator import Simulator

WALLS = (Wall((-6, -4), (6, -4)), Wall((6, -4), (6, 4)), Wall((6, 4), (-6, 4)), Wall((-6, 4), (-6, -4)))


def room(*people, profile="none", start=(0.0, 0.0, 0.0), **fields) -> Scenario:
    return Scenario(
        name="room",
        robot=Robot(start=start, goal=(5.0, 0.0)),
        walls=fields.pop("walls", WALLS),
        people=tuple(Person(at, ConstantVelocity((0.0, 0.0)), **fields.pop("person", {})) for at in people),
        noise=Noise(profile=profile),
        physics=Physics(engine="kinematic"),
        **fields,
    )


def belief(pose=(0.0, 0.0, 0.0), std=(1e-3, 1e-3, 1e-3)) -> RobotBelief:
    pose = np.array(pose, float)
    return RobotBelief(0.0, pose[None], np.ones(1), pose, np.diag(np.square(std)), 1.0)


def scan_of(scenario: Scenario) -> Reading:
    return Simulator(scenario, 0).sense()[0]


def found(scenario: Scenario, known: Scenario | None = None):
    return Detector.of(known or scenario).detect(scan_of(scenario), belief(scenario.robot.start))


@pytest.mark.parametrize("place", [(2.0, 0.0), (-3.0, 0.0), (-3.0, 0.05), (0.6, -0.3), (4.5, 2.5)])
def test_a_person_is_found_where_they_stand_also_across_the_seam_of_the_scan(place):
    (person,) = found(room(place)).detections
    np.testing.assert_allclose(person.position, place, atol=0.02)
    assert person.radius == pytest.approx(0.3, abs=0.01)
    assert person.time == 0.0


def test_two_people_side_by_side_are_two():
    detections = found(room((3.0, 0.32), (3.0, -0.32))).detections
    np.testing.assert_allclose(sorted(d.position[1] for d in detections), [-0.32, 0.32], atol=0.03)


def test_who_stands_at_a_wall_is_found_and_the_wall_is_not():
    (person,) = found(room((3.0, 3.64))).detections
    np.testing.assert_allclose(person.position, (3.0, 3.64), atol=0.04)


def test_the_map_explains_an_empty_room_under_noise():
    scenario = room(profile="pearson", pillars=(Pillar((2.0, 1.0)),))
    simulator, detector = Simulator(scenario, 0), Detector.of(scenario)
    count = 0
    for _ in range(50):
        simulator.advance(0.1, (0.0, 0.0))
        robot = belief(simulator.state().robot_pose)
        count += len(detector.detect(simulator.sense()[-1], robot).detections)
    assert count <= 1


def test_what_the_map_misses_is_found_at_its_size():
    scenario = room(pillars=(Pillar((2.0, 1.0), radius=0.15),))
    (pillar,) = found(scenario, replace(scenario, pillars=())).detections
    np.testing.assert_allclose(pillar.position, (2.0, 1.0), atol=0.03)
    assert pillar.radius == pytest.approx(0.15, abs=0.03)


def test_who_is_hidden_is_not_visible_and_half_hidden_is_half():
    scan = found(room((2.0, 0.0)))
    behind, beside, in_front = scan.visible([(4.0, 0.0), (4.0, 2.0), (1.0, 0.0)], 0.3)
    assert (behind, beside, in_front) == (0.0, pytest.approx(1.0, abs=1e-3), pytest.approx(1.0, abs=1e-2))
    edge = 4.0 * np.tan(np.arcsin(0.3 / 2.0))  # of the shadow at x = 4
    assert scan.visible([(4.0, edge)], 0.3)[0] == pytest.approx(0.5, abs=0.15)


@pytest.mark.parametrize("scan", [np.zeros(0), np.full(360, np.nan), np.full(360, np.inf), np.zeros(360)])
def test_a_scan_that_says_nothing_shows_nobody(scan):
    scenario = room()
    seen = Detector.of(scenario).detect(replace(scan_of(scenario), scan=scan), belief())
    assert seen.detections == ()
    assert seen.visible([(2.0, 0.0)], 0.3) == 0.0
