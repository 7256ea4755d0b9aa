"""Bodies found in scans of rooms that are cast exactly, or by the world with noise."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.geometry.distances import beam_angles
from mjnav.messages import Reading, RobotBelief
from mjnav.robot.estimation.lidar.detector import Detector
from mjnav.robot.estimation.lidar.parts import OWN, Edge, fit_circle
from mjnav.robot.estimation.lidar.scan import Rays
from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import ConstantVelocity, Noise, Person, Physics, Pillar, Robot, Scenario, Sensors, Wall
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


def test_who_stands_at_a_wall_is_found_and_the_wall_is_not():
    scan = found(room((3.0, 3.64)))
    (person,) = scan.detections
    np.testing.assert_allclose(person.position, (3.0, 3.64), atol=0.04)
    assert scan.visible([(3.0, 3.64)], 0.3) > 0.95
    doubtful = Detector.of(room()).detect(scan_of(room((3.0, 3.64))), belief(std=(0.1, 0.1, 1e-3)))
    assert doubtful.visible([(3.0, 3.64)], 0.3) == pytest.approx(0.84, abs=0.08)  # 0.35 m or more from the wall


def test_the_map_explains_an_empty_room_under_noise():
    scenario = room(profile="pearson", pillars=(Pillar((2.0, 1.0)),))
    simulator, detector = Simulator(scenario, 0), Detector.of(scenario)
    count = 0
    for _ in range(50):
        simulator.advance(0.1, (0.0, 0.0))
        robot = belief(simulator.state().robot_pose)
        count += len(detector.detect(simulator.sense()[-1], robot).detections)
    assert count <= 1


def test_who_is_hidden_is_not_visible_and_half_hidden_is_half():
    scan = found(room((2.0, 0.0)))
    behind, beside, in_front = scan.visible([(4.0, 0.0), (4.0, 2.0), (1.0, 0.0)], 0.3)
    assert (behind, beside, in_front) == (0.0, pytest.approx(1.0, abs=1e-3), pytest.approx(1.0, abs=1e-2))
    edge = 4.0 * np.tan(np.arcsin(0.3 / 2.0))  # of the shadow at x = 4
    assert scan.visible([(4.0, edge)], 0.3)[0] == pytest.approx(0.5, abs=0.15)


def test_what_a_cover_on_the_robot_shows_is_nobody_and_hides_what_is_behind_it():
    scenario = room((3.0, 0.0))
    scan = scan_of(scenario)
    ahead = np.abs(beam_angles(360)) < 0.5
    seen = Detector.of(scenario).detect(replace(scan, scan=np.where(ahead, 0.1, scan.scan)), belief())
    assert seen.detections == ()
    assert (seen.visible([(3.0, 0.0), (-3.0, 0.0)], 0.3) == (0.0, pytest.approx(1.0, abs=1e-2))).all()


@pytest.mark.parametrize("model", ["lds-01", "lds-02", "rplidar-a1", "utm-30lx"])
def test_a_real_lidar_on_a_robot_that_turns_finds_people_and_only_them(model):
    lidar = LidarSpec(model=model, mount=(0.1, 0.05, 0.3))
    scenario = room((2.0, 0.0), (-1.0, 1.5), profile="pearson", sensors=Sensors(lidar=lidar))
    scenario = replace(scenario, pillars=(Pillar((0.0, -2.0)),))
    simulator, detector, counts, errors = Simulator(scenario, 1), Detector.of(scenario), [], []
    for _ in range(20):
        simulator.advance(0.1, (0.1, 1.0))
        truth = simulator.state()
        for reading in simulator.sense():
            if not reading.scan.size:
                detector.follow(reading)
                continue
            detections = detector.detect(reading, belief(truth.robot_pose, (0.01, 0.01, 0.01))).detections
            away = [np.linalg.norm(d.position - truth.people_position, axis=1).min() for d in detections]
            counts.append(len(detections))
            errors += away
    assert 1.9 <= np.mean(counts) <= 2.1
    assert np.median(errors) < 0.05


# ----------------------------------------------------- circle behind an arc, of returns computed by hand


STEP = np.deg2rad(1.0)
INSIDE_95 = 5.991  # 95 % quantile of chi-squared with 2 degrees of freedom


def rays_at(centre, radius, spread=0.0, rng=None, shift=0.0) -> tuple[Rays, np.ndarray]:
    """Beams from the origin that meet a disc, a degree apart, and their numbers."""
    angles = np.arange(-90, 90) * STEP + shift
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ahead, offset = u @ centre, u[:, 0] * centre[1] - u[:, 1] * centre[0]
    hit = np.abs(offset) < radius
    ranges = np.where(hit, ahead - np.sqrt(np.maximum(radius**2 - offset**2, 0.0)), np.inf)
    ranges += 0.0 if rng is None else spread * rng.standard_normal(len(ranges))
    full = np.full(len(angles), max(spread, 0.005))
    return Rays(np.zeros_like(u), u, ranges, full, np.zeros(len(u)), STEP, 0.0, False, 0.0, 20.0), np.flatnonzero(hit)


def edge(rays, beam, other, kind=OWN) -> Edge:
    x, y = rays.directions[beam] + rays.directions[other]
    return Edge(kind, x / np.hypot(x, y), y / np.hypot(x, y), STEP)


def fitted(rays, beams, kinds=(OWN, OWN), radius=0.3, radius_std=0.05):
    edges = edge(rays, beams[0], beams[0] - 1, kinds[0]), edge(rays, beams[-1], beams[-1] + 1, kinds[1])
    return fit_circle(rays, beams, edges, radius, radius_std)


@pytest.mark.parametrize("radius", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("centre", [(0.6, 0.0), (2.0, 1.0), (3.0, -2.0)])
def test_exact_returns_give_their_circle_whatever_radius_was_expected(centre, radius):
    circle = fitted(*rays_at(np.array(centre), radius))
    np.testing.assert_allclose((circle.x, circle.y, circle.radius), (*centre, radius), atol=0.01)


@pytest.mark.parametrize("distance", [1.0, 4.0, 7.5])
def test_the_centre_lies_in_its_95_percent_region_as_often(distance):
    rng, inside, num = np.random.default_rng(1), 0, 400
    for _ in range(num):
        angle = rng.uniform(-0.5, 0.5)
        centre = distance * np.array([np.cos(angle), np.sin(angle)])
        circle = fitted(*rays_at(centre, rng.normal(0.3, 0.02), 0.03, rng, rng.uniform(0.0, STEP)))
        error = np.array([circle.x, circle.y]) - centre
        covariance = np.array([[circle.xx, circle.xy], [circle.xy, circle.yy]])
        inside += error @ np.linalg.solve(covariance, error) < INSIDE_95
    assert 0.92 <= inside / num <= 0.99
