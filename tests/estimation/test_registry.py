from dataclasses import replace

import numpy as np
import pytest

from mjnav.estimation import LOCALIZERS, TRACKERS, make_localizer, make_tracker
from mjnav.estimation.direct import DirectLocalizer, DirectTracker
from mjnav.estimation.kalman import KalmanTracker, UnscentedKalmanLocalizer
from mjnav.scenarios.spec import (
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


@pytest.mark.parametrize(
    ("scenario", "localizer", "tracker"),
    [
        (choose("direct", "direct"), DirectLocalizer, DirectTracker),
        (choose("pose.ukf", "detections.kalman"), UnscentedKalmanLocalizer, KalmanTracker),
    ],
)
def test_the_scenario_names_its_estimators(scenario, localizer, tracker):
    assert type(make_localizer(scenario, 0)) is localizer
    assert type(make_tracker(scenario, 0)) is tracker


def test_an_assumed_profile_takes_the_place_of_the_worlds_noise(drive):
    scenario = choose("direct", assumed_profile="none")
    (reading,), _ = drive(scenario.noise.distributions(), 0, ticks=1)
    assert np.abs(make_localizer(scenario, 0).update(reading).particles - reading.pose).max() < 1e-15


def test_estimators_of_other_sources_are_refused_by_the_scenario():
    with pytest.raises(ValueError, match="pose"):
        RobotEstimation(source="posse")


@pytest.mark.parametrize("name", WITH_IDENTITY)
def test_no_people_make_no_tracks(drive, name):
    scenario = replace(choose(tracker=name), people=())
    (reading,), _ = drive(scenario.noise.distributions(), 0, ticks=1)
    tracker = make_tracker(scenario, 0)
    assert (tracker.update(reading), tracker.draw(25)) == ((), ())
