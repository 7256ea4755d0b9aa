"""The MuJoCo robot does what it is told; the bounds are the measured figures with a margin."""

import numpy as np
import pytest

from mjnav.messages import Array
from mjnav.motion.unicycle import integrate
from mjnav.scene.spec import Scenario
from mjnav.world.simulator import Simulator

FAST = {"max_acceleration": 100.0, "max_turn_acceleration": 300.0}


def drive(scenario: Scenario, command: tuple[float, float], duration: float, every: float = 0.02) -> Array:
    """Rows of time, x, y, heading, v, omega."""
    simulator, rows = Simulator(scenario, 0), []
    for _ in range(round(duration / every)):
        simulator.advance(every, command)
        state = simulator.state()
        rows.append([state.time, *state.robot_pose, *state.robot_twist])
    return np.array(rows)


@pytest.mark.parametrize("command", [(1.0, 0.0), (0.0, 1.5), (0.8, 0.8), (0.4, -1.2), (0.1, 0.1)])
def test_the_steady_twist_is_within_5_mm_per_s_and_6_mrad_per_s(scene, command):
    end = drive(scene(), command, 2.0)[-1]
    assert abs(end[4] - command[0]) < 0.005
    assert abs(end[5] - command[1]) < 0.006


def test_a_step_of_half_a_metre_per_second_settles_within_0_2_s(scene):
    rows = drive(scene(robot=FAST), (0.5, 0.0), 0.6, every=0.002)
    late = rows[rows[:, 0] > 0.2]
    assert np.abs(late[:, 4] - 0.5).max() < 0.01
    assert rows[:, 4].max() < 0.51


def test_the_acceleration_limit_holds(scene):
    rows = drive(scene(robot={"max_acceleration": 0.5, "max_turn_acceleration": 1.0}), (1.0, 1.0), 0.8)
    assert (rows[:, 4] <= 0.5 * rows[:, 0] + 0.005).all()
    assert (rows[:, 5] <= 1.0 * rows[:, 0] + 0.005).all()


def test_both_engines_drive_the_same_arc_to_3_cm(scene):
    ends = [drive(scene(engine=engine), (0.6, 0.4), 5.0)[-1] for engine in ("mujoco", "kinematic")]
    np.testing.assert_allclose(ends[0][1:3], ends[1][1:3], atol=0.03)
    assert ends[0][3] == pytest.approx(ends[1][3], abs=0.02)


def test_the_kinematic_robot_drives_the_exact_arc(scene):
    rows = drive(scene(engine="kinematic", robot=FAST), (0.7, -0.9), 3.0)
    start, end = rows[4], rows[-1]  # up to speed
    np.testing.assert_allclose(end[1:4], integrate(start[1:4], 0.7, -0.9, end[0] - start[0]), atol=1e-9)
