"""The robot's limits and size are those of the run file, for candidates, commands, clearance and physics."""

import pytest

import mjnav
from mjnav.metrics.safety import clearances

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


@pytest.mark.parametrize("engine", ["kinematic", "mujoco"])
def test_a_wider_robot_is_nearer_and_touches_sooner(engine):
    wall = [{"from": [0.6, -1.0], "to": [0.6, 1.0], "thickness": 0.1}]
    robot = {"robot.goal_tolerance": 0.1, "robot.goal": [5.0, 0.0], "control.method": "mean", "people": []}
    touched = []
    for radius in (0.2, 0.5):
        scenario = mjnav.load_scenario(
            "crossing1", {**QUICK, **robot, "walls": wall, "physics.engine": engine, "robot.radius": radius}
        )
        with mjnav.Simulation(scenario) as simulation:
            while not simulation.done:
                simulation.step(0.5, 0.0)
        touched.append(simulation.trajectory.robot_pose[-1, 0])
        assert simulation.outcome == "collision"
        assert clearances(simulation.trajectory, scenario).least == pytest.approx(0.0, abs=0.06)
    assert touched[0] - touched[1] == pytest.approx(0.3, abs=0.05)
