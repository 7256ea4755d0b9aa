from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control import make_controller
from mjnav.errors import InvalidValue
from mjnav.messages import Lanes, ObstacleSamples, RobotLimits, Status
from mjnav.motion.diff_drive import reachable
from mjnav.motion.unicycle import integrate

PERIOD = 0.1
FREE = RobotLimits(
    max_speed=5.0, min_speed=-5.0, max_turn_rate=50.0, max_acceleration=1e4, max_turn_acceleration=1e4, radius=0.22
)


@pytest.fixture(scope="module")
def orca():
    return make_controller("orca", RobotLimits(), PERIOD)


def disc(x, y, vx=0.0, vy=0.0, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.array([[vx, vy]]), radius)


def centre_velocity(decision, heading, lead):
    """Of the point `lead` ahead of the axle, in the world."""
    c, s = np.cos(heading), np.sin(heading)
    return decision.v * np.array([c, s]) + lead * decision.omega * np.array([-s, c])


# ------------------------------------------------------------------------------------- effective centre


@given(st.floats(-3.1, 3.1), st.floats(-1.0, 1.0), st.floats(-8.0, 8.0))
def test_the_effective_centre_moves_at_the_velocity_that_was_chosen(heading, v, omega):
    """Simulated: the unicycle under (v, omega) against v e + D omega e'."""
    lead, dt = 0.25, 1e-6
    before, after = np.array([0.0, 0.0, heading]), integrate([0.0, 0.0, heading], v, omega, dt)
    centres = [p[:2] + lead * np.array([np.cos(p[2]), np.sin(p[2])]) for p in (before, after)]
    c, s = np.cos(heading), np.sin(heading)
    expected = np.array([c, s]) * v + np.array([-s, c]) * lead * omega
    assert (centres[1] - centres[0]) / dt == pytest.approx(expected, abs=1e-4)


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


def test_the_disc_about_the_effective_centre_covers_the_robot(orca):
    lead = orca.parameters.effective_centre
    angle = np.linspace(-np.pi, np.pi, 100)
    edge = orca.limits.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    assert np.hypot(*(edge - [lead, 0.0]).T).max() <= orca.limits.radius + lead + 1e-12


# ----------------------------------------------------------------------------------------- half-planes


@pytest.mark.parametrize("seed", range(40))
def test_what_obeys_the_half_planes_keeps_the_effective_disc_clear_for_the_horizon(observe, seed):
    """Discs for time_horizon, walls for wall_horizon, lanes at lane_horizon, by simulation of constant velocities."""
    controller = make_controller("orca", FREE, PERIOD)
    p = controller.parameters
    o = observe(seed, near=1.5, num_walls=1)
    decision = controller.decide(o)
    if decision.status == Status.INFEASIBLE:
        return
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


def test_feasible_and_infeasible_observations_both_occur(observe):
    controller = make_controller("orca", FREE, PERIOD)
    found = [controller.decide(observe(seed, near=1.5, num_walls=1)).status for seed in range(40)]
    assert 3 <= found.count(Status.INFEASIBLE) <= 37


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


def test_a_wall_bounds_the_speed_towards_it_and_nothing_else(alone):
    controller = make_controller("orca", RobotLimits(), PERIOD, effective_centre=0.2, wall_horizon=2.0)
    wall = np.array([[[-9.0, 1.0], [9.0, 1.0]]])
    normal, offset = controller.half_planes(controller.problem(alone(walls=wall)))
    assert normal == pytest.approx(np.array([[0.0, -1.0]]))
    assert offset == pytest.approx([-(1.0 - 0.22 - 0.2 - 0.05) / 2.0])
    # Nearer than the radii: no nearer still, but along and away from it as it likes.
    normal, offset = controller.half_planes(controller.problem(alone(walls=wall * np.array([1.0, 0.3]))))
    assert (normal == [[0.0, -1.0]]).all()
    assert offset == [0.0]
    # Abreast of its end the end is what counts.
    end = np.array([[[0.2, 1.0], [0.2, 9.0]]])
    normal, _ = controller.half_planes(controller.problem(alone(walls=end)))
    assert normal == pytest.approx(np.array([[0.0, -1.0]]))


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


def test_at_its_goal_the_robot_stops(alone, orca):
    at_goal = alone(twist=(0.0, 0.0), goal=(0.0, 0.0))
    assert orca.decide(at_goal).status == Status.STOPPED
    moving = orca.decide(replace(at_goal, twist=np.array([0.05, 0.0])))
    assert (moving.v, moving.omega, moving.status) == (0.0, 0.0, Status.OK)


# ------------------------------------------------------------------------------------------ infeasible


def test_what_cannot_be_avoided_is_reported_and_braked_for(alone, orca):
    decision = orca.decide(alone(twist=(0.8, 0.0), obstacles=(disc(0.75, 0.0),)))
    assert decision.status == Status.INFEASIBLE
    assert decision.v == pytest.approx(0.7)  # all that one period allows


# ------------------------------------------------------------------------------------------ closed loop


@pytest.mark.parametrize("goal", [(4.0, 0.0), (3.0, 3.0), (-3.0, 0.5), (-3.0, -0.5), (-4.0, 0.0), (0.0, 2.0)])
def test_it_reaches_a_goal_in_the_open_wherever_it_lies(drive, orca, goal):
    assert drive(orca, goal, seconds=20.0)[0]


@pytest.mark.parametrize("aside", [-0.3, -0.1, 0.05, 0.2])
def test_it_passes_a_pillar_at_rest(drive, orca, aside):
    reached, clearance = drive(orca, (6.0, 0.0), discs=[((3.0, aside), (0.0, 0.0), 0.3)])
    assert reached
    assert clearance >= orca.parameters.safety_margin - 0.02  # half-planes are tangents: a chord of one period less


@pytest.mark.parametrize("aside", [-0.2, 0.1])
def test_it_passes_someone_who_comes_towards_it_slowly(drive, orca, aside):
    reached, clearance = drive(orca, (6.0, 0.0), discs=[((5.0, aside), (-0.4, 0.0), 0.3)])
    assert reached
    assert clearance > 0.0


def test_it_drives_along_a_wall_and_away_from_one(drive, orca):
    assert drive(orca, (4.0, 0.0), walls=[[[-2.0, 0.4], [8.0, 0.4]]], seconds=15.0)[0]
    reached, clearance = drive(orca, (4.0, 0.0), heading=0.0, walls=[[[-0.3, -3.0], [-0.3, 3.0]]], seconds=15.0)
    assert reached
    assert clearance > 0.0


def test_it_stops_before_a_wall_that_it_cannot_pass(drive, orca):
    reached, clearance = drive(orca, (4.0, 0.0), walls=[[[2.0, -50.0], [2.0, 50.0]]], seconds=20.0)
    assert not reached
    assert clearance > 0.0


# ------------------------------------------------------------------------------------- every observation


CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5}


@pytest.mark.parametrize("seed", range(30))
def test_the_decision_is_finite_within_reach_and_always_the_same(observe, orca, seed):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    decision = orca.decide(o)
    low, high = reachable(o.twist, orca.limits, PERIOD)
    assert low[0] <= decision.v <= high[0]
    assert low[1] <= decision.omega <= high[1]
    assert orca.decide(replace(o)) == decision


@pytest.mark.parametrize("seed", range(12))
def test_neither_order_nor_frame_changes_the_decision(observe, orca, seed):
    o = observe(seed, num_obstacles=4, **(CROWDED if seed % 2 else {}))
    rng = np.random.default_rng(seed)
    order = rng.permutation(4)
    discs = []
    for j in order:
        rows = rng.permutation(len(o.obstacles[j].position))
        discs.append(
            replace(o.obstacles[j], position=o.obstacles[j].position[rows], velocity=o.obstacles[j].velocity[rows])
        )
    angle, shift = rng.uniform(-np.pi, np.pi), 20.0 * rng.normal(size=2)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])  # acts from the right

    def line(a, b, offset):
        a, b = a * c - b * s, a * s + b * c
        return a, b, offset - a * shift[0] - b * shift[1]

    other = replace(
        o,
        robot_pose=np.column_stack([o.robot_pose[:, :2] @ turn + shift, o.robot_pose[:, 2] + angle])[::-1],
        obstacles=tuple(replace(d, position=d.position @ turn + shift, velocity=d.velocity @ turn) for d in discs),
        goal=o.goal @ turn + shift,
        walls=o.walls[::-1] @ turn + shift,
        lanes=replace(o.lanes, left=line(*o.lanes.left), right=line(*o.lanes.right)),
    )
    first, second = orca.decide(o), orca.decide(other)
    assert (second.v, second.omega) == pytest.approx((first.v, first.omega), abs=1e-6)
    assert first.status == second.status


def test_what_is_degenerate_is_decided_all_the_same(alone, orca):
    zero = np.zeros(25)
    on_top = disc(0.0, 0.0)
    point = np.zeros((1, 2, 2))
    lanes = Lanes((0.0, 1.0, 1.0), (0.0, 1.0, -1.0), zero, zero)  # nothing lies between them
    lead = orca.parameters.effective_centre
    for o in (
        alone(num_samples=1),
        alone(twist=(0.0, 0.0)),
        alone(twist=(9.0, -9.0)),
        alone(goal=(0.0, 0.0)),
        alone(obstacles=(on_top,)),
        alone(obstacles=(on_top, on_top), twist=(0.0, 0.0)),
        alone(obstacles=(disc(lead, 0.0),), twist=(0.0, 0.0)),
        alone(obstacles=(disc(0.3, 0.0, radius=0.0),)),
        alone(walls=point),
        alone(walls=point + np.array([lead, 0.0])),
        alone(lanes=lanes),
    ):
        decision = orca.decide(o)
        assert np.isfinite([decision.v, decision.omega]).all()
        assert decision.costs is None


def test_the_log_gets_the_samples_of_the_closest_obstacle(observe, orca):
    o = observe(3, num_obstacles=3)
    index, samples, desired = orca.closest_cone(o, orca.decide(o))
    gaps = [np.hypot(*(d.position.mean(0) - o.robot_pose[:, :2].mean(0))) - d.radius for d in o.obstacles]
    assert index == np.argmin(gaps)
    assert samples.shape == (5 * len(o.obstacles[index].position),)
    assert desired.shape == (0,)
    assert orca.closest_cone(replace(o, obstacles=()), orca.decide(o)) is None


@pytest.mark.parametrize("key", ["time_horizon", "effective_centre", "responsibility"])
@pytest.mark.parametrize("value", [0.0, -1.0, inf])
def test_parameters_that_cannot_be_are_refused(key, value):
    with pytest.raises(InvalidValue, match=f"{key}: found"):
        make_controller("orca", RobotLimits(), PERIOD, **{key: value})
