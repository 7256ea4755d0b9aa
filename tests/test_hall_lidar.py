"""hall-lidar: hall for a robot that is told neither its pose nor the people."""

import pytest

from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario

QUICK = ("physics.engine=kinematic", "time_limit=3")


def state_hash(*overrides):
    return Episode(load_scenario("hall-lidar", (*QUICK, *overrides), seed=3)).run().summary["state_hash"]


def test_neither_the_pose_sensor_nor_detections_with_identity_tell_the_robot_anything():
    plain = state_hash()
    wide = '{distribution="uniform", half_width=0.5}'
    told = [f"noise.{channel}={wide}" for channel in ("pose.x", "pose.y", "pose.theta", "detection.x", "detection.y")]
    assert state_hash(*told) == plain
    assert state_hash(f"noise.gyro={wide}") != plain


@pytest.mark.parametrize("filters", [("particle", "particle"), ("ekf", "kalman")])
def test_it_knows_where_it_is_and_sees_people(filters):
    overrides = [f"estimation.{key}.filter={name}" for key, name in zip(("robot", "obstacles"), filters, strict=True)]
    figures = Episode(load_scenario("hall-lidar", (*QUICK, *overrides), seed=3)).run().summary
    assert figures["localization_rmse_m"] < 0.03
    assert figures["tracked_share"] > 0.5
    assert figures["collisions"] == {"person": 0, "table": 0, "wall": 0, "pillar": 0}
