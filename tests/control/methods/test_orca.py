from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mjnav.control import make_controller
from mjnav.messages import Lanes, ObstacleSamples, RobotLimits, Status
from mjnav.motion.unicycle import integrate

PERIOD = 0.1
FREE = RobotLimits(
    max_speed=5.0, min_speed=-5.0, max_turn_rate=50.0, max_acceleration=1e4, max_turn_acceleration=1e4, radius=0.22
)


@pytest.fixture(scope="module")
def orca():
    return make_controller("orca", RobotLimits(), PERIOD, approach_time=1.0)


def disc(x, y, vx=0.0, vy=0.0, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.array([[vx, vy]]), radius)


def centre_velocity(decision, heading, lead):
    """Of the point `lead` ahead of the axle, in the world."""
    c, s = np.cos(heading), np.sin(heading)
    return decision.v * np.array([c, s]) + lead * decision.omega * np.array([-s, c])


# ------------------------------------------------------------------------------------- effective centre


def test_a_free_robots_effective_centre_follows_any_holonomic_velocity(alone):
    """Where nothing bounds the control, the centre's path under a preferred velocity is the straight line."""
    controller = make_controller("orca", FREE, 0.001, preferred_speed=0.8)
    lead = controller.parameters.effective_centre
    for bearing in np.linspace(-1.5, 1.5, 7):
        o = alone(twist=(0.0, 0.0), goal=(1e6 * np.cos(bearing), 1e6 * np.sin(bearing)), num_samples=1)
        pose, path = np.zeros(3), []
        for _ in range(500):
            decision = controller.decide(replace(o, robot_pose=pose[None], twist=np.zeros(2)))
            pose = integrate(pose, decision.v, decision.omega, 0.001)
            path.append(pose[:2] + lead * np.array([np.cos(pose[2]), np.sin(pose[2])]))
        way = np.array(path[-1]) - [lead, 0.0]
        assert way == pytest.approx(0.5 * 0.8 * np.array([np.cos(bearing), np.sin(bearing)]), abs=2e-3)


# ----------------------------------------------------------------------------------------- half-planes


@given(seed=st.integers(0, 200))
@settings(max_examples=40)
def test_what_obeys_the_half_planes_keeps_the_effective_disc_clear_for_the_horizon(observe, seed):
    """Discs for time_horizon, walls for wall_horizon, lanes at lane_horizon, by simulation of constant velocities."""
    controller = make_controller("orca", FREE, PERIOD, responsibility=1.0)
    p = controller.parameters
    o = observe(seed, near=1.5, num_walls=1)
    decision = controller.decide(o)
    assume(decision.status != Status.INFEASIBLE)
    problem = controller.problem(o)
    x, y, heading = problem.mean_pose
    start = np.array([x, y]) + p.effective_centre * np.array([np.cos(heading), np.sin(heading)])
    velocity = centre_velocity(decision, heading, p.effective_centre)
    radius = FREE.radius + p.effective_centre
    for obstacle in o.obstacles:
        at, u = obstacle.position.mean(axis=0), obstacle.velocity.mean(axis=0)
        t = np.linspace(0.0, p.time_horizon, 500)[:, None]
        gap = np.hypot(*(start + t * velocity - at - t * u).T)
        allowed = obstacle.radius + radius + p.safety_margin
        assert gap.min() >= allowed - 1e-6 or gap[0] < allowed
    for a, b in o.walls:
        t, s = np.linspace(0.0, p.wall_horizon, 200), np.linspace(0.0, 1.0, 400)[:, None]
        points = a + s * (b - a)
        gap = np.hypot(*(start + t[:, None, None] * velocity - points).T).min(axis=0)
        assert gap.min() >= min(radius + p.safety_margin, gap[0]) - 2e-2  # points of the wall lie apart
    end = start + p.lane_horizon * velocity
    for (a, b, c), noise, side in ((o.lanes.left, o.lanes.left_offset, 1.0), (o.lanes.right, o.lanes.right_offset, -1)):
        d = (a * end[0] + b * end[1] + c) / np.hypot(a, b) + noise.mean()
        assert side * d + radius <= 1e-6


def test_a_spread_makes_each_disc_larger_by_so_many_deviations_of_the_relative_position(observe):
    plain, wary = (make_controller("orca", FREE, PERIOD, spread=spread) for spread in (0.0, 2.0))
    o = observe(3, near=2.0)
    own = o.robot_pose[:, :2].var(axis=0)
    larger = tuple(
        replace(d, radius=d.radius + 2.0 * np.sqrt(0.5 * (own + d.position.var(axis=0)).sum())) for d in o.obstacles
    )
    expected, found = plain.half_planes(plain.problem(replace(o, obstacles=larger))), wary.half_planes(wary.problem(o))
    assert all(a == pytest.approx(b, abs=1e-12) for a, b in zip(found, expected, strict=True))


def test_half_the_responsibility_is_half_the_change(alone):
    o = alone(twist=(0.8, 0.0), obstacles=(disc(2.0, 0.2),))
    offsets, normals = [], []
    for share in (0.5, 1.0):
        controller = make_controller("orca", RobotLimits(), PERIOD, responsibility=share)
        normal, offset = controller.half_planes(controller.problem(o))
        normals.append(normal[0])
        offsets.append(offset[0] - normal[0] @ np.array([0.8, 0.0]))
    assert normals[0] == pytest.approx(normals[1])
    assert offsets[0] == pytest.approx(0.5 * offsets[1])
    assert offsets[1] > 0.0


def test_lanes_are_half_planes_on_the_velocity(alone):
    controller = make_controller("orca", RobotLimits(), PERIOD, effective_centre=0.2, lane_horizon=0.5)
    lanes = Lanes((0.0, 2.0, -2.0), (0.0, 1.0, 1.5), np.full(25, 0.1), np.zeros(25))
    normal, offset = controller.half_planes(controller.problem(alone(lanes=lanes)))
    assert normal == pytest.approx(np.array([[0.0, -1.0], [0.0, 1.0]]))
    assert offset == pytest.approx([-(1.0 - 0.1 - 0.42) / 0.5, -(1.5 - 0.42) / 0.5])
    # Beyond the left one already: back within the time.
    lanes = replace(lanes, left=(0.0, 1.0, -0.32))
    _, offset = controller.half_planes(controller.problem(alone(lanes=lanes)))
    assert offset[0] == pytest.approx(0.2 / 0.5)


# ---------------------------------------------------------------------------------- preferred velocity


def test_the_preferred_velocity_leads_to_the_goal_and_slows_near_it(alone, orca):
    def preferred(**fields):
        return orca.preferred(orca.problem(alone(**fields)))

    assert preferred(goal=(5.0, 0.0)) == pytest.approx([0.8, 0.0])
    assert preferred(goal=(3.0, 3.0)) == pytest.approx(0.8 * np.sqrt(0.5) * np.ones(2))
    assert preferred(goal=(0.3, 0.0)) == pytest.approx([0.3, 0.0])
    assert preferred(goal=(0.0, 0.0)) == pytest.approx([0.0, 0.0])
    for y in (-0.1, 0.1):
        assert preferred(goal=(-5.0, y)) == pytest.approx([0.0, np.copysign(0.8, y)], abs=1e-12)
    assert preferred(goal=(5.0, 0.0), heading=0.5) == pytest.approx([0.8 * np.cos(0.5), -0.8 * np.sin(0.5)])


# ------------------------------------------------------------------------------------------ infeasible
