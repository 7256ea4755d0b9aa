"""What holds of every estimator, also where a part of a reading is missing."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.messages import Reading
from mjnav.motion.unicycle import integrate
from mjnav.robot.estimation import LOCALIZERS, TRACKERS, make_localizer, make_tracker
from mjnav.scene.load import load
from mjnav.scene.spec import (
    ConstantVelocity,
    Estimation,
    Noise,
    ObstacleEstimation,
    Person,
    Robot,
    RobotEstimation,
    Scenario,
)

SCENARIO = Scenario(
    name="two",
    robot=Robot(start=(0.0, 0.0, 0.0), goal=(5.0, 0.0)),
    people=(
        Person((1.0, 2.0), ConstantVelocity((1.0, 0.0)), radius=0.25),
        Person((4.0, -2.0), ConstantVelocity((0.0, 1.0)), radius=0.4),
    ),
)
TOLD = [name for name in LOCALIZERS if not name.startswith("lidar.")]
WITH_IDENTITY = [name for name in TRACKERS if not name.startswith("lidar.")]
PEOPLE = ((1.0, 2.0, 1.0, 0.0), (4.0, -2.0, 0.0, 1.0))


def choose(localizer="pose.particle", tracker="detections.particle", **rest):
    source, _, kind = localizer.partition(".")
    robot = RobotEstimation(source=source, filter=kind or "particle", particles=60)
    source, _, kind = tracker.partition(".")
    obstacles = ObstacleEstimation(source=source, filter=kind or "particle", particles=200)
    return replace(SCENARIO, estimation=Estimation(robot=robot, obstacles=obstacles, **rest))


@pytest.mark.parametrize("profile", ["pearson", "none"])
@pytest.mark.parametrize("name", LOCALIZERS)
def test_every_localizer_is_finite_seeded_and_deterministic(drive, name, profile):
    scenario = replace(choose(localizer=name), noise=Noise(profile=profile))
    readings, truth = drive(scenario.noise.distributions(), 0, ticks=30)
    first, second, other = (make_localizer(scenario, seed) for seed in (1, 1, 2))
    for reading in readings:
        belief, same, differs = (localizer.update(reading) for localizer in (first, second, other))
        drawn = first.draw(25)
        assert np.array_equal(drawn, second.draw(25))
        assert np.array_equal(belief.particles, same.particles)
        assert np.array_equal(belief.covariance, same.covariance)
        assert belief.time == reading.time
        assert belief.particles.shape == (60, 3)
        assert belief.mean.shape == (3,)
        assert belief.weights.sum() == pytest.approx(1.0)
        assert drawn.shape == (25, 3)
        assert np.isfinite(belief.particles).all()
        assert np.allclose(belief.covariance, belief.covariance.T)
        assert np.linalg.eigvalsh(belief.covariance).min() > -1e-12
    assert profile == "none" or not np.array_equal(belief.particles, differs.particles)
    assert belief.mean[:2] == pytest.approx(truth[-1, :2], abs=0.5)


@pytest.mark.parametrize("profile", ["pearson", "none"])
@pytest.mark.parametrize("name", WITH_IDENTITY)
def test_every_tracker_is_finite_seeded_and_deterministic(drive, name, profile):
    scenario = replace(choose(tracker=name), noise=Noise(profile=profile))
    readings, _ = drive(scenario.noise.distributions(), 0, ticks=30, people=PEOPLE)
    first, second, other = (make_tracker(scenario, seed) for seed in (1, 1, 2))
    for reading in readings:
        tracks, same, differs = (tracker.update(reading) for tracker in (first, second, other))
        drawn, again = first.draw(25), second.draw(25)
        for p, track in enumerate(tracks):
            assert np.array_equal(drawn[p], again[p])
            assert np.array_equal(track.particles, same[p].particles)
            assert track.particles.shape == (200, 4)
            assert track.mean.shape == (4,)
            assert drawn[p].shape == (25, 4)
            assert np.isfinite(track.particles).all()
            assert np.linalg.eigvalsh(track.covariance).min() > -1e-12
            assert track.mean[:2] == pytest.approx(reading.detections[p], abs=0.6)
    assert [track.name for track in tracks] == ["person0", "person1"]
    assert [track.radius for track in tracks] == [0.25, 0.4]
    assert not np.array_equal(tracks[0].particles, differs[0].particles)


def test_an_assumed_profile_takes_the_place_of_the_worlds_noise(drive):
    scenario = choose("direct", assumed_profile="none")
    (reading,), _ = drive(scenario.noise.distributions(), 0, ticks=1)
    assert np.abs(make_localizer(scenario, 0).update(reading).particles - reading.pose).max() < 1e-15


# ---------------------------------------------------------------------------- parts that are missing


TWIST = np.array([0.6, 0.4])


def made(part: str, name: str):
    source, _, kind = name.partition(".")
    keys = {f"estimation.{part}.source": source, f"estimation.{part}.filter": kind or "particle"}
    keys["noise.profile"] = "gaussian"
    return load("crossing1", {**keys, f"estimation.{part}.particles": 2000})


def reading(k: int, **fields) -> Reading:
    """Reading k of a robot on an arc and of a person who walks along x at 1 m/s; exact."""
    return Reading(
        time=0.1 * k,
        interval=0.1 if k else 0.0,
        odometry=TWIST,
        gyro=float(TWIST[1]),
        pose=integrate(np.zeros(3), TWIST[0], TWIST[1], 0.1 * k),
        detections=np.array([[0.1 * k, 2.0]]),
        scan=np.zeros(0),
        **fields,
    )


@pytest.mark.parametrize("name", TOLD)
def test_without_a_pose_the_belief_follows_odometry_and_widens(name):
    localizer = make_localizer(made("robot", name), 1)
    for k in range(10):
        before = localizer.update(reading(k))
    wrong = np.array([50.0, 50.0, 1.0])  # held by a reading that says that it is not to be used
    for k in range(10, 20):
        belief = localizer.update(replace(reading(k), pose=wrong, dropped=("pose",)))
    moved = integrate(before.mean, TWIST[0], TWIST[1], 1.0)
    np.testing.assert_allclose(belief.mean[:2], moved[:2], atol=0.02)
    assert belief.time == pytest.approx(1.9)
    assert np.trace(belief.covariance) > np.trace(before.covariance)


@pytest.mark.parametrize("name", TOLD)
def test_without_odometry_the_belief_goes_on_and_widens_faster(name):
    spread = {}
    for dropped in (("pose",), ("pose", "odometry")):
        localizer = make_localizer(made("robot", name), 1)
        for k in range(10):
            localizer.update(reading(k))
        for k in range(10, 15):
            belief = localizer.update(replace(reading(k), dropped=dropped))
        spread[dropped] = np.trace(belief.covariance)
    assert spread["pose", "odometry"] > 1.2 * spread["pose",]


@pytest.mark.parametrize("name", WITH_IDENTITY)
def test_without_detections_people_go_on_as_they_walked(name):
    tracker = make_tracker(made("obstacles", name), 1)
    for k in range(20):
        (before,) = tracker.update(reading(k))
    for k in range(20, 25):
        (track,) = tracker.update(replace(reading(k), detections=np.full((1, 2), 40.0), dropped=("detections",)))
    assert track.name == "person0"
    assert track.time == pytest.approx(2.4)
    np.testing.assert_allclose(track.mean[:2], before.mean[:2] + 0.5 * before.mean[2:], atol=0.15)
    assert np.trace(track.covariance[:2, :2]) > np.trace(before.covariance[:2, :2])
    (found,) = tracker.update(reading(25))
    np.testing.assert_allclose(found.mean[:2], [2.5, 2.0], atol=0.3)
