"""`gaussian-linearised`: every belief a Gaussian, the constraint linearised about the means.

With p + t q the mean relative position at time t, t* its closest approach within the horizon, d = p + t* q and
a = d / |d|, the disc is taken for the half-plane a . x < R, and a candidate is allowed where that holds at most the
share delta of the Gaussian:

    Phi((R - |d|) / sqrt(a^T Sigma a)) <= delta,   or   |d| - R >= erfinv(1 - 2 delta) sqrt(2 a^T Sigma a),
    Sigma = Cov(p_robot + t* x'_robot) + Cov(p_obstacle + t* x'_obstacle)

(Zhu & Alonso-Mora 2019, "Chance-Constrained Collision Avoidance for MAVs in Dynamic Environments", RA-L 4(2)). The
covariances are those of the samples, with what position and velocity share. The robot's velocity x' is linearised too:

    dx' = e dv + s e_perp (dtheta + tau domega),   e = [cos, sin](theta + omega tau), s the mean speed.

Against a wall p is relative to its point nearest at the time, and the times are those at which path and wall can be
nearest: the path's start and end, where it passes the wall's ends, where it crosses. The riskiest counts: a path along
a wall is as near at its end as at its start, but less certain. A lane boundary is linear already. The closest approach
is that of the segment form, whatever `form` says of the nominal control.

The risk is that probability, allowed up to delta. `infeasible`: no candidate is allowed, and the one whose
probabilities above delta sum to the least is taken: by how many metres a constraint is missed grows with the spread of
what is far off, and would weigh more than a wall close by. With a finite `penalty` that sum is a cost in place of a
constraint.
"""

from dataclasses import dataclass
from math import erfc, inf, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.constraints.collision_cone import STANDSTILL
from mjnav.control.base import ConstrainedController
from mjnav.control.parameters import GridParameters, Penalty
from mjnav.control.problem.obstacles import Discs
from mjnav.control.problem.problem import Problem
from mjnav.control.problem.samples import lane_samples
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Lanes
from mjnav.settings import Range

COINCIDENT = 1e-9  # [m, m/s] below which a vector has no direction
PARALLEL = 1e-12  # [m^2/s] cross product of velocity and wall below which they do not cross


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianLinearisedParameters(GridParameters):
    """The risk that is accepted; above 0.5 more spread would count as safer."""

    delta: Annotated[
        float, Range(0.0, 0.5, open_low=True), "probability that one constraint is violated; at 0.5 the mean decides"
    ] = 0.1
    penalty: Penalty = inf


class Motion(NamedTuple):
    """What the kernels know of the robot: the robot's mean motion at every candidate, and how it departs from it."""

    ex: Vector  # (K,) e
    ey: Vector
    speed: Vector  # (K,) [m/s] s
    covariance: Matrix  # (4, 4) of x, y, dv, theta + tau domega

    @classmethod
    def of(cls, problem: Problem) -> "Motion":
        """From a problem's candidates and the robot's samples."""
        o, tau, noise = problem.observation, problem.parameters.preview, problem.mean_noise[0]
        heading = problem.mean_pose[2] + (problem.candidates.omega + noise[1]) * tau
        turn = wrap(o.robot_pose[:, 2] - problem.mean_pose[2]) + o.control_noise[:, 1] * tau
        state = np.column_stack([o.robot_pose[:, :2], o.control_noise[:, 0], turn])
        return cls(np.cos(heading), np.sin(heading), problem.candidates.v + noise[0], covariance(state))


class GaussianLinearised(ConstrainedController[GaussianLinearisedParameters]):
    """Chooses the cheapest candidate whose linearised chance constraints all hold."""

    @property
    def bound(self) -> float:
        """delta."""
        return self.parameters.delta

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """The probability that each constraint is violated, linearised."""
        motion, reach, p = Motion.of(problem), problem.reach, self.parameters
        discs = problem.discs.take(reach.discs)
        means, radius = discs.means(), self.limits.radius + p.safety_margin
        r, theirs = problem.mean_pose[:2] - means.position, _disc_covariances(discs)
        to_discs = np.empty((len(r), len(motion.ex)))
        _discs(to_discs, motion, r, means.velocity, theirs, radius + means.radius, p.horizon)
        to_walls = np.empty((len(reach.walls), len(motion.ex)))
        walls = problem.observation.walls[list(reach.walls)] - problem.mean_pose[:2]
        _walls(to_walls, motion, walls, radius, p.wall_horizon)
        lanes = problem.observation.lanes
        lane = np.zeros((len(motion.ex), 2)) if lanes is None else self._lanes(problem, lanes, motion)
        return np.concatenate([to_discs, to_walls]).T, lane

    def _lanes(self, problem: Problem, lanes: Lanes, motion: Motion) -> Array:
        """Of the left and right lane boundary, (K, 2)."""
        c, p, margin, t = problem.candidates, self.parameters, self.limits.radius, self.parameters.lane_horizon
        offsets = (lanes.left_offset, lanes.right_offset)
        mean = lane_samples(
            lanes, problem.mean_pose[None], problem.mean_noise, tuple(o.mean(keepdims=True) for o in offsets),
            c.v, c.omega, margin, problem.parameters, clip=False,
        )[..., 0]  # fmt: skip
        if p.normalise:
            mean = mean * margin
        risk = np.empty((2, len(c.v)))
        for side, (line, offset) in enumerate(zip((lanes.left, lanes.right), offsets, strict=True)):
            normal = np.array(line[:2]) / np.hypot(*line[:2])
            _beyond(risk[side], motion, mean[side], normal, offset.var(), t)
        return np.ascontiguousarray(risk.T)


def covariance(states: Array) -> Array:
    """Of the Gaussian most likely to have given the states (n, d): (d, d)."""
    departure = states - states.mean(axis=0)
    return departure.T @ departure / len(states)


def _disc_covariances(discs: Discs) -> Array:
    """Of each disc's position and velocity, (J, 4, 4)."""
    states = np.concatenate([discs.position, discs.velocity], axis=1)
    out = np.zeros((len(discs.radius), 4, 4))
    for j, (start, stop) in enumerate(zip(discs.start[:-1].tolist(), discs.start[1:].tolist(), strict=True)):
        if stop - start > 1:
            out[j] = covariance(states[start:stop])
    return out


@kernel
def _variance(c, x, y, z, w):
    """g^T C g for g = (x, y, z, w) and a symmetric C (4, 4)."""
    own = c[0, 0] * x * x + c[1, 1] * y * y + c[2, 2] * z * z + c[3, 3] * w * w
    shared = x * (c[0, 1] * y + c[0, 2] * z + c[0, 3] * w) + y * (c[1, 2] * z + c[1, 3] * w) + c[2, 3] * z * w
    return max(own + 2.0 * shared, 0.0)


@kernel
def _robot_variance(motion, k, ax, ay, t):
    """Of a . (p + t x') at candidate k, to first order."""
    along, across = ax * motion.ex[k] + ay * motion.ey[k], ay * motion.ex[k] - ax * motion.ey[k]
    return _variance(motion.covariance, ax, ay, t * along, t * motion.speed[k] * across)


@kernel
def probability(excess, variance):
    """That a Gaussian of mean `excess` is above 0."""
    if variance > 0.0:
        return 0.5 * erfc(-excess / sqrt(2.0 * variance))
    return 1.0 if excess > 0.0 else 0.0


@kernel
def _direction(dx, dy, nx, ny, ex, ey):
    """d / |d| and |d|; where d has no direction, that of n, or else normal to e. The sign makes no difference."""
    distance, length = sqrt(dx * dx + dy * dy), sqrt(nx * nx + ny * ny)
    if distance >= COINCIDENT:
        return dx / distance, dy / distance, distance
    if length >= COINCIDENT:
        return nx / length, ny / length, distance
    return -ey, ex, distance


@kernel
def _nearest_time(x, y, qx, qy, horizon):
    """When, in [0, horizon], the path t q is nearest to the point (x, y); 0 for a path that stands still."""
    qq = qx * qx + qy * qy
    return min(max((x * qx + y * qy) / qq, 0.0), horizon) if qq >= STANDSTILL else 0.0


@kernel
def _discs(out: Matrix, motion: Motion, r: Matrix, velocity: Matrix, theirs: Cube, radius: Vector, horizon: float):
    """Of every disc at every candidate, (J, K)."""
    for j in range(out.shape[0]):
        x, y = r[j, 0], r[j, 1]
        for k in range(out.shape[1]):
            ex, ey = motion.ex[k], motion.ey[k]
            qx, qy = motion.speed[k] * ex - velocity[j, 0], motion.speed[k] * ey - velocity[j, 1]
            t = _nearest_time(-x, -y, qx, qy, horizon)
            # On a collision course d vanishes; on any beside it, d is normal to q.
            ax, ay, distance = _direction(x + t * qx, y + t * qy, -qy, qx, ex, ey)
            variance = _robot_variance(motion, k, ax, ay, t)
            variance += _variance(theirs[j], ax, ay, t * ax, t * ay)
            out[j, k] = probability(radius[j] - distance, variance)


@kernel
def _crossing_time(x, y, wx, wy, qx, qy, horizon):
    """When the path t q crosses the wall from (x, y) along w; 0 where it does not."""
    cross = qx * wy - qy * wx
    if abs(cross) < PARALLEL:
        return 0.0
    t, share = (x * wy - y * wx) / cross, (x * qy - y * qx) / cross
    return t if 0.0 < t < horizon and 0.0 < share < 1.0 else 0.0


@kernel
def _walls(out: Matrix, motion: Motion, walls: Cube, radius: float, horizon: float):
    """Of every wall, (W, K); the walls (W, 2, 2) relative to the robot."""
    for j in range(out.shape[0]):
        x, y = walls[j, 0, 0], walls[j, 0, 1]
        wx, wy = walls[j, 1, 0] - x, walls[j, 1, 1] - y
        for k in range(out.shape[1]):
            ex, ey = motion.ex[k], motion.ey[k]
            qx, qy = motion.speed[k] * ex, motion.speed[k] * ey
            out[j, k] = 0.0
            for t in (
                0.0,
                horizon,
                _nearest_time(x, y, qx, qy, horizon),
                _nearest_time(x + wx, y + wy, qx, qy, horizon),
                _crossing_time(x, y, wx, wy, qx, qy, horizon),
            ):
                dx, dy = t * qx - x, t * qy - y
                share = min(max((dx * wx + dy * wy) / max(wx * wx + wy * wy, COINCIDENT**2), 0.0), 1.0)
                ax, ay, distance = _direction(dx - share * wx, dy - share * wy, -wy, wx, ex, ey)
                variance = _robot_variance(motion, k, ax, ay, t)
                out[j, k] = max(out[j, k], probability(radius - distance, variance))


@kernel
def _beyond(out: Vector, motion: Motion, excess: Vector, normal: Vector, variance: float, t: float):
    """Of a lane boundary, (K,), which the mean exceeds by `excess` (K,) after t; `variance` is the boundary's own."""
    for k in range(out.size):
        robot = _robot_variance(motion, k, normal[0], normal[1], t)
        out[k] = probability(excess[k], robot + variance)
