"""Bodies found in scans of rooms that are cast exactly, or by the world with noise."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.geometry.distances import beam_angles
from mjnav.messages import Reading, RobotBelief
from mjnav.robot.estimation.lidar.detector import Detector
from mjnav.robot.estimation.lidar.parts import CUT, OWN, Edge, fit_circle
from mjnav.robot.estimation.lidar.scan import Rays
from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import ConstantVelocity, Noise, Person, Physics, Pillar, Robot, Scenario, Sensors, Table, Wall
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


def test_a_table_leg_that_the_map_has_5_cm_off_is_no_person():
    table = Table((2.0, 0.0), size=(1.0, 0.6))
    assert found(room(tables=(table,)), room(tables=(replace(table, position=(2.04, 0.03)),))).detections == ()


def test_a_wall_that_the_map_misses_is_found_in_pieces_that_cover_it():
    scenario = room(walls=(*WALLS, Wall((1.0, 2.0), (3.0, 2.0))))
    pieces = found(scenario, replace(scenario, walls=WALLS)).detections
    assert max(piece.radius for piece in pieces) <= 0.25
    along = np.linspace(1.0, 3.0, 41)
    nearest = [min(abs(x - p.position[0]) - p.radius for p in pieces) for x in along]
    assert max(nearest) < 0.1


def test_somebody_behind_a_pillar_that_hides_the_middle_of_them_is_one():
    scenario = room((4.0, 0.0), pillars=(Pillar((1.5, 0.0), radius=0.05),))
    (person,) = found(scenario).detections
    np.testing.assert_allclose(person.position, (4.0, 0.0), atol=0.03)


def test_the_robots_uncertainty_is_in_the_covariance_of_what_it_sees():
    scenario = room((4.0, 0.0))
    scan, detector = scan_of(scenario), Detector.of(scenario)
    (sure,), (unsure,) = (
        detector.detect(scan, belief(std=std)).detections for std in ((1e-4,) * 3, (0.02, 0.01, 0.01))
    )
    added = np.diag([0.02**2, 0.01**2 + (4.0 * 0.01) ** 2])  # J P J^T at 4 m straight ahead
    np.testing.assert_allclose(unsure.covariance - sure.covariance, added, atol=2e-5)


def test_an_error_that_all_ranges_share_is_told_by_the_map():
    scenario = room((3.0, 1.0))
    scan = scan_of(scenario)
    (person,) = Detector.of(scenario).detect(replace(scan, scan=scan.scan + 0.2), belief()).detections
    np.testing.assert_allclose(person.position, (3.0, 1.0), atol=0.03)


def test_what_a_cover_on_the_robot_shows_is_nobody_and_hides_what_is_behind_it():
    scenario = room((3.0, 0.0))
    scan = scan_of(scenario)
    ahead = np.abs(beam_angles(360)) < 0.5
    seen = Detector.of(scenario).detect(replace(scan, scan=np.where(ahead, 0.1, scan.scan)), belief())
    assert seen.detections == ()
    assert (seen.visible([(3.0, 0.0), (-3.0, 0.0)], 0.3) == (0.0, pytest.approx(1.0, abs=1e-2))).all()


def test_beams_that_were_lost_saw_nothing_and_a_field_of_view_ends():
    half = room(sensors=Sensors(lidar=LidarSpec(field_of_view=np.pi, beams=181)))
    assert found(half).visible([(3.0, 0.0), (-3.0, 0.0), (0.0, 3.0)], 0.3) == pytest.approx([1.0, 0.0, 0.5], abs=0.1)
    scan = scan_of(room())
    lost = np.where(beam_angles(360) > 0.0, np.inf, scan.scan)  # to the left, where the map has a wall in range
    seen = Detector.of(room()).detect(replace(scan, scan=lost), belief())
    assert seen.visible([(3.0, 0.0), (0.0, 3.0), (0.0, -3.0)], 0.3) == pytest.approx([0.5, 0.0, 1.0], abs=0.1)


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


def test_the_edge_of_what_hides_a_person_is_not_taken_for_theirs():
    centre = np.array([3.0, 0.4])
    rays, beams = rays_at(centre, 0.3)
    seen = beams[: len(beams) // 3]  # a pillar hides the left two thirds
    right, wrong = fitted(rays, seen, (OWN, CUT)), fitted(rays, seen, (OWN, OWN))
    assert np.hypot(right.x - centre[0], right.y - centre[1]) < 0.03
    assert wrong.strain > 16.0 > right.strain
    assert np.hypot(wrong.x - centre[0], wrong.y - centre[1]) > 0.1
