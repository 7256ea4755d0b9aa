"""Faults and kidnappings in a world that runs, in both engines."""

from collections.abc import Callable

import numpy as np
import pytest

from mjnav.geometry.angles import wrap
from mjnav.messages import Reading
from mjnav.scene.faults import (
    Blocked,
    ChannelFaults,
    Dropout,
    Faults,
    Kidnapping,
    LidarFaults,
    Slip,
    WheelFaults,
)
from mjnav.scene.spec import Pillar, Scenario
from mjnav.world.simulator import Simulator

COMMAND = (0.5, 0.3)


def drive(
    scenario: Scenario, *, seconds: float = 2.0, pieces: int = 1, seed: int = 1
) -> tuple[Simulator, list[Reading]]:
    """A world in which COMMAND held, and its readings; `pieces` is how many calls a period is divided into."""
    world = Simulator(scenario, seed)
    readings = [*world.sense()]
    for _ in range(round(seconds / 0.1) * pieces):
        world.advance(0.1 / pieces, COMMAND)
        readings += world.sense()
    return world, readings


def of(readings: list[Reading], name: str) -> np.ndarray:
    return np.array([getattr(reading, name) for reading in readings])


def test_the_same_faults_end_in_the_same_bits_however_calls_divide_the_time(scene, engine):
    faults = Faults(
        kidnap=Kidnapping(1.05, (2.0, 1.0, 1.0)),
        gyro=ChannelFaults(dropout=Dropout(share=0.5)),
        wheels=WheelFaults(slip=Slip(start=0.33, side="left"), dropout=Dropout(share=0.5)),
    )
    scenario = scene(engine=engine, profile="pearson", faults=faults)
    whole, readings = drive(scenario)
    divided, again = drive(scenario, pieces=5)
    assert whole.state_hash() == divided.state_hash()
    np.testing.assert_array_equal(of(readings, "gyro"), of(again, "gyro"))


def test_a_kidnapping_is_noticed_by_the_pose_sensor_and_the_lidar_alone(scene, engine):
    pose = (2.0, 1.0, 2.5)
    plain = scene(engine=engine, pillars=(Pillar((2.0, 3.0)),))
    _, before = drive(plain)
    _, after = drive(scene(engine=engine, pillars=(Pillar((2.0, 3.0)),), faults=Faults(Kidnapping(1.0, pose))))
    for sensor in ("odometry", "gyro", "odometry_pose"):
        np.testing.assert_allclose(of(after, sensor), of(before, sensor), atol=2e-3 if engine == "mujoco" else 1e-12)
    np.testing.assert_array_equal(of(after[:10], "pose"), of(before[:10], "pose"))
    np.testing.assert_allclose(after[10].pose, pose, atol=1e-9)
    assert after[10].scan.min() == pytest.approx(2.0 - 0.2, abs=1e-3)
    # From there on it drives the way that it would have driven, from another pose.
    moved, way = after[-1].pose, before[-1].pose - before[10].pose
    turn = pose[2] - before[10].pose[2]
    c, s = np.cos(turn), np.sin(turn)
    expected = np.array([pose[0] + c * way[0] - s * way[1], pose[1] + s * way[0] + c * way[1], wrap(pose[2] + way[2])])
    np.testing.assert_allclose(moved, expected, atol=5e-3 if engine == "mujoco" else 1e-9)


@pytest.mark.parametrize("factor", [0.0, 0.5])
def test_slipping_wheels_turn_as_commanded_and_move_the_robot_less(scene, engine, factor):
    _, plain = drive(scene(engine=engine))
    slips = Faults(wheels=WheelFaults(slip=Slip(start=1.0, factor=factor)))
    world, readings = drive(scene(engine=engine, faults=slips))
    steady = [*range(11), *range(13, 21)]  # in MuJoCo it takes 0.2 s until the floor's speed has changed
    np.testing.assert_allclose(of(readings, "odometry")[steady], of(plain, "odometry")[steady], atol=5e-3)
    np.testing.assert_allclose(world.state().robot_twist, factor * np.array(COMMAND), atol=5e-3)
    np.testing.assert_allclose(of(readings[-5:], "gyro"), factor * COMMAND[1], atol=5e-3)


SENSORS = {"odometry": "odometry", "gyro": "gyro", "pose": "pose", "detections": "detections", "lidar": "scan"}


@pytest.mark.parametrize("channel", SENSORS)
def test_a_reading_names_what_did_not_arrive_and_the_others_stay_as_they_are(clutter, channel):
    def make(**faults) -> Scenario:
        return clutter(engine="kinematic", faults=Faults(**faults))

    _, plain = drive(make())
    _, readings = drive(
        make(
            **{
                channel: LidarFaults(dropout=Dropout(start=1.0))
                if channel == "lidar"
                else ChannelFaults(dropout=Dropout(start=1.0))
            }
        )
    )
    field = SENSORS[channel]
    assert [reading.dropped for reading in readings] == [()] * 10 + [(field,)] * 11
    lost = getattr(readings[-1], field)
    assert lost.size == 0 if field == "scan" else np.isnan(lost).all()
    for other in set(SENSORS.values()) - {field}:
        np.testing.assert_array_equal(of(readings, other), of(plain, other))
    assert np.isfinite(of(readings, "odometry_pose")).all()


def test_covered_beams_measure_the_cover_and_the_others_what_they_did(scene: Callable[..., Scenario]):
    faults = Faults(lidar=LidarFaults(blocked=Blocked(angles=(3.0, -3.0), range=0.1)))  # behind, across pi
    _, plain = drive(scene(engine="kinematic", pillars=(Pillar((2.0, 0.6)),)), seconds=0.1)
    _, readings = drive(scene(engine="kinematic", pillars=(Pillar((2.0, 0.6)),), faults=faults), seconds=0.1)
    angles = 2.0 * np.pi * np.arange(360) / 360 - np.pi
    covered = np.abs(angles) >= 3.0
    assert 0 < covered.sum() < 20
    assert (readings[0].scan[covered] == 0.1).all()
    np.testing.assert_array_equal(readings[0].scan[~covered], plain[0].scan[~covered])
