"""Twists from wheels and gyro, and scans as points with the robot's motion undone."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.messages import Reading, RobotLimits
from mjnav.motion.unicycle import integrate
from mjnav.noise import profile
from mjnav.rng import stream
from mjnav.robot.estimation.lidar.scan import TWIST_CHANNELS, MotionHistory, TwistSensors, scan_points
from mjnav.scene.sensors import LidarSpec, lidar_of
from mjnav.sealed import sealed

LIMITS = RobotLimits()
TWISTS = np.array([[0.9, 0.4], [0.5, -1.2], [0.8, 1.4], [-0.2, 0.0]])
READING = Reading(0.1, 0.1, np.array([0.8, 0.3]), 0.3, np.zeros(3), np.zeros((0, 2)), np.zeros(0))


def sensors(name="pearson"):
    return TwistSensors.of(dict(profile(name)), LIMITS)


def rngs(seed):
    return {channel: stream(seed, channel) for channel in TWIST_CHANNELS}


def driven(times):
    """A history of TWISTS, and the true pose at each of `times` [s], the first twist from 0 s on."""
    history, boundary = MotionHistory(sensors("none")), np.zeros((len(TWISTS) + 1, 3))
    for k, (v, omega) in enumerate(TWISTS.tolist()):
        history.follow(replace(READING, time=0.1 * (k + 1), odometry=np.array([v, omega]), gyro=omega))
        boundary[k + 1] = integrate(boundary[k], v, omega, 0.1)
    places = np.minimum((np.asarray(times) / 0.1 + 1e-9).astype(int), len(TWISTS) - 1)
    return history, np.array(
        [integrate(boundary[k], TWISTS[k, 0], TWISTS[k, 1], t - 0.1 * k) for k, t in zip(places, times, strict=True)]
    )


def test_wheels_and_gyro_count_by_the_inverse_of_their_variances():
    model = sensors("gaussian")
    wheels, gyro = model.omega.std**-2, model.gyro.std**-2
    found = model.fused(replace(READING, odometry=np.array([0.8, 0.30]), gyro=0.34))
    assert found.omega == pytest.approx((wheels * 0.30 + gyro * 0.34) / (wheels + gyro))
    assert found.std[1] == pytest.approx((wheels + gyro) ** -0.5)
    assert found.v == 0.8


def test_draws_have_the_twists_mean_and_spread_and_keep_the_shape_of_the_noise():
    model = sensors()
    twist = model.fused(READING)
    v, omega = model.sample(twist, 200_000, rngs(1))
    assert v.mean() == pytest.approx(twist.v, abs=3e-4)
    assert omega.mean() == pytest.approx(twist.omega, abs=3e-4)
    assert (v.std(), omega.std()) == pytest.approx(twist.std, rel=0.03)
    skew = np.mean(((v - v.mean()) / v.std()) ** 3)
    assert skew == pytest.approx(2.0, abs=0.3)  # readings less the noise, whose skew is -2


@pytest.mark.parametrize(
    ("change", "std"),
    [
        ({"dropped": ("odometry",)}, (0.3, 0.02)),
        ({"odometry": np.full(2, np.nan)}, (0.3, 0.02)),
        ({"dropped": ("gyro",)}, (0.03, 0.07)),
        ({"gyro": np.inf}, (0.03, 0.07)),
        ({"dropped": ("gyro", "odometry"), "gyro": np.nan}, (0.3, 0.45)),
    ],
)
def test_what_did_not_arrive_is_replaced_by_what_is_left(change, std):
    model = sensors()
    before = model.fused(READING)
    twist = model.fused(replace(READING, **change), before)
    assert twist.std == pytest.approx(std, rel=1e-6)
    v, omega = model.sample(twist, 20_000, rngs(3))
    assert np.isfinite([v, omega]).all()
    assert (v.std(), omega.std()) == pytest.approx(std, rel=0.1)
    assert twist.v == pytest.approx(0.8, abs=1e-9)
    assert twist.omega == pytest.approx(0.3, abs=1e-9)


def still_shares(v, omega, num=2000):
    """Shares of `num` noisy readings of a robot that drives so, after which it is taken to stand."""
    model, rng = sensors(), np.random.default_rng(3)
    history, noise = MotionHistory(model), [channel.sample(rng, num) for channel in (model.v, model.omega, model.gyro)]
    stands = 0
    for k, (dv, dw, dg) in enumerate(zip(*noise, strict=True)):
        odometry = np.array([v + dv, omega + dw])
        stands += history.follow(replace(READING, time=0.1 * (k + 1), odometry=odometry, gyro=omega + dg)).stands
    return stands / num


def test_a_robot_at_rest_is_mostly_taken_to_stand_and_one_that_moves_is_not():
    assert still_shares(0.0, 0.0) > 0.85
    assert still_shares(0.08, 0.0) < 0.01
    assert still_shares(0.0, 0.1) < 0.01


def test_particles_of_a_robot_that_stands_stay_where_they_are():
    model, history = sensors(), MotionHistory(sensors())
    rest = replace(READING, odometry=np.array([model.v.mean, model.omega.mean]), gyro=model.gyro.mean)
    twists = [history.follow(replace(rest, time=0.1 * (k + 1))) for k in range(6)]
    assert [twist.stands for twist in twists] == [False] * 4 + [True] * 2
    v, omega = model.sample(twists[-1], 50, rngs(1))
    assert not v.any()
    assert not omega.any()
    slipping = replace(rest, time=0.7, odometry=np.array([1.0, 0.0]))
    assert not history.follow(slipping).stands


def test_a_pose_of_the_past_is_the_arc_driven_back():
    times = np.linspace(0.0, 0.4, 23)
    history, truth = driven(times)
    now = truth[-1]
    c, s = np.cos(now[2]), np.sin(now[2])
    relative = (truth[:, :2] - now[:2]) @ np.array([[c, -s], [s, c]])
    found = history.poses(times, 0.4)
    assert found[:, :2] == pytest.approx(relative, abs=1e-12)
    assert found[:, 2] == pytest.approx(truth[:, 2] - now[2], abs=1e-12)


def test_a_scan_of_a_moving_robot_lies_where_the_surfaces_are():
    lidar = lidar_of(LidarSpec(model="lds-01", mount=(0.1, -0.05, 0.3)), 360, 10.0)
    times = 0.2 + lidar.turn_offsets
    history, truth = driven(times)
    (now,) = driven([0.4])[1]
    corner = np.array([2.0, 1.0])  # every beam ends there, whatever its angle
    c, s = np.cos(truth[:, 2]), np.sin(truth[:, 2])
    mount = truth[:, :2] + np.column_stack([c * 0.1 + s * 0.05, s * 0.1 - c * 0.05])
    way = corner - mount
    bearing = np.arctan2(way[:, 1], way[:, 0]) - truth[:, 2] - 0.3
    pointed = replace(lidar, angles=sealed(bearing))
    ranges = np.hypot(*way.T)
    reading = replace(READING, time=0.4, scan=ranges, scan_times=times)
    c, s = np.cos(now[2]), np.sin(now[2])
    expected = (corner - now[:2]) @ np.array([[c, -s], [s, c]])
    assert scan_points(reading, history, pointed) == pytest.approx(np.tile(expected, (360, 1)), abs=1e-9)


def test_beams_that_met_nothing_have_no_point_and_the_lidars_mean_error_is_taken_off():
    lidar, noise = lidar_of(LidarSpec(model="lds-01"), 360, 10.0), profile("pearson")["lidar.range"]
    ranges = np.full(360, 2.0)
    ranges[:4] = [np.inf, np.nan, 0.05, -1.0]
    reading = replace(READING, scan=ranges + np.where(np.arange(360) < 4, 0.0, lidar.bias(ranges, noise)))
    points = scan_points(reading, MotionHistory(sensors()), lidar, noise)
    assert np.isnan(points[:4]).all()
    assert np.hypot(*points[4:].T) == pytest.approx(np.full(356, 2.0), abs=2e-3)
    assert scan_points(replace(reading, dropped=("scan",)), MotionHistory(sensors()), lidar).shape == (0, 2)
    assert scan_points(READING, MotionHistory(sensors()), lidar).shape == (0, 2)
