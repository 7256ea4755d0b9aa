"""Estimators where a part of a reading is missing."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.estimation import make_localizer, make_tracker
from mjnav.messages import Reading
from mjnav.motion.unicycle import integrate
from mjnav.scenarios.load import load

LOCALIZERS = [("pose", "particle"), ("pose", "ekf"), ("pose", "ukf"), ("direct", "particle")]
TRACKERS = [("detections", "particle"), ("detections", "kalman"), ("detections", "imm"), ("direct", "particle")]
TWIST = np.array([0.6, 0.4])


def made(part: str, source: str, kind: str):
    keys = {f"estimation.{part}.source": source, f"estimation.{part}.filter": kind, "noise.profile": "gaussian"}
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


@pytest.mark.parametrize(("source", "kind"), LOCALIZERS)
def test_without_a_pose_the_belief_follows_odometry_and_widens(source, kind):
    localizer = make_localizer(made("robot", source, kind), 1)
    for k in range(10):
        before = localizer.update(reading(k))
    wrong = np.array([50.0, 50.0, 1.0])  # held by a reading that says that it is not to be used
    for k in range(10, 20):
        belief = localizer.update(replace(reading(k), pose=wrong, dropped=("pose",)))
    moved = integrate(before.mean, TWIST[0], TWIST[1], 1.0)
    np.testing.assert_allclose(belief.mean[:2], moved[:2], atol=0.02)
    assert belief.time == pytest.approx(1.9)
    assert np.trace(belief.covariance) > np.trace(before.covariance)


@pytest.mark.parametrize(("source", "kind"), LOCALIZERS)
def test_without_odometry_the_belief_goes_on_and_widens_faster(source, kind):
    spread = {}
    for dropped in (("pose",), ("pose", "odometry")):
        localizer = make_localizer(made("robot", source, kind), 1)
        for k in range(10):
            localizer.update(reading(k))
        for k in range(10, 15):
            belief = localizer.update(replace(reading(k), dropped=dropped))
        spread[dropped] = np.trace(belief.covariance)
    assert spread["pose", "odometry"] > 1.2 * spread["pose",]


@pytest.mark.parametrize(("source", "kind"), TRACKERS)
def test_without_detections_people_go_on_as_they_walked(source, kind):
    tracker = make_tracker(made("obstacles", source, kind), 1)
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


@pytest.mark.parametrize(("source", "kind"), TRACKERS)
def test_nobody_is_known_before_the_first_detections(source, kind):
    tracker = make_tracker(made("obstacles", source, kind), 1)
    nothing = np.full((1, 2), np.nan)
    for k in range(2):
        assert tracker.update(replace(reading(k), detections=nothing, dropped=("detections",))) == ()
    assert [track.name for track in tracker.update(reading(2))] == ["person0"]
