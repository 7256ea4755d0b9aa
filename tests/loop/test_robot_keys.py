"""The robot's limits and size are those of the run file, for candidates, commands, clearance and physics."""

import pytest

import mjnav

QUICK = {"physics.engine": "kinematic", "time_limit": 2.0, "noise.profile": "none"}
LIMITS = {"max_speed": 0.5, "min_speed": -0.3, "max_turn_rate": 0.7, "max_acceleration": 0.4}


def test_candidates_and_commands_keep_the_limits_and_reverse():
    overrides = {**QUICK, **{f"robot.{key}": value for key, value in LIMITS.items()}}
    seen = []
    result = mjnav.run(mjnav.load_scenario("crossing1", overrides), watch=seen.append)
    first = seen[0].decision.costs
    assert first.v.min() == pytest.approx(-0.04)  # 0.4 m/s² for a period of 0.1 s, from rest
    assert abs(first.omega).max() == pytest.approx(0.3)
    assert result.trajectory.command[:, 0].max() <= 0.5 + 1e-12
    assert abs(result.trajectory.command[:, 1]).max() <= 0.7 + 1e-12
    assert result.trajectory.clipped_ticks == 0
