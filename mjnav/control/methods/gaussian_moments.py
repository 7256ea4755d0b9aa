"""`gaussian-moments`: the mean and the deviation of f under Gaussian beliefs.

Gaussians are fitted to the samples of the robot (pose, actuation noise, lane offsets) and of every obstacle (position,
velocity), samples are drawn from those, and of each constraint f on these samples

    mean(f) + k std(f) <= 0,   that is   Phi(mean(f) / std(f)) <= Phi(-k)

is asked, so that f > 0 has at most probability 1 - eta. Cantelli's inequality gives k = sqrt(eta / (1 - eta)) for any
distribution of f; were f itself Gaussian, the quantile k = Phi^-1(eta) would do, which is never more.

Sources: Gopalakrishnan, Singh & Krishna 2015, "Closed-form characterization of collision free velocities and
confidence bounds for non-holonomic robots in uncertain dynamic environments"; Gopalakrishnan, Singh, Kaushik, Krishna
& Manocha 2017, "PRVO: Probabilistic Reciprocal Velocity Obstacle for multi robot navigation under uncertainty". The
clip changes no f > 0, so the bound holds; it takes away spread among what is safe, of which f, a square of distances,
has most where the obstacle is far.

The risk is Phi(mean / std), the probability of f > 0 were f Gaussian, allowed up to Phi(-k). `infeasible`: no
candidate is allowed, and the one whose risks above that sum to the least is taken: mean + k std itself grows with the
spread of what is far off, and would weigh more than a wall close by. With a finite `penalty` that sum is a cost in
place of a constraint.
"""

from dataclasses import dataclass
from math import inf, sqrt
from statistics import NormalDist
from typing import Annotated

import numpy as np

from mjnav.compile.compiled import kernel
from mjnav.control.base import ConstrainedController
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.methods.gaussian_linearised import probability
from mjnav.control.parameters import Parameters, Penalty
from mjnav.control.problem.obstacles import Discs, blocks, straightened
from mjnav.control.problem.problem import Problem
from mjnav.control.problem.samples import SampleCone, lane_samples
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, ObstacleSamples, RobotLimits
from mjnav.rng import stream
from mjnav.settings import Choice, Range

TAILS = ("cantelli", "quantile")
ROBOT_STATE = 7  # x, y, heading, dv, domega, left and right lane offset
DISC_STATE = 4  # x, y, vx, vy


def deviations(eta: float, tail: str) -> float:
    """k: how many standard deviations hold the share eta of a distribution on one side."""
    return sqrt(eta / (1.0 - eta)) if tail == "cantelli" else NormalDist().inv_cdf(eta)


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianMomentsParameters(Parameters):
    """The confidence that is asked for, and what it takes f for."""

    eta: Annotated[float, Range(0.0, 1.0, open_low=True, open_high=True), "probability that one constraint holds"] = 0.9
    tail: Annotated[str, Choice(TAILS), "bound on f: cantelli holds for any distribution, quantile for a Gaussian"] = (
        "cantelli"
    )
    penalty: Penalty = inf


class GaussianMoments(ConstrainedController[GaussianMomentsParameters]):
    """Chooses the cheapest candidate at which every f is k deviations below 0 on average."""

    def __init__(self, limits: RobotLimits, period: float, parameters: GaussianMomentsParameters):
        super().__init__(limits, period, parameters)
        # The same draws for every decision: a candidate is not preferred for its luck.
        self._robot_draws, self._disc_draws = (
            white(stream(0, "gaussian-moments", body).standard_normal((parameters.samples, size)))
            for body, size in (("robot", ROBOT_STATE), ("obstacle", DISC_STATE))
        )

    @property
    def bound(self) -> float:
        """Phi(-k)."""
        return NormalDist().cdf(-deviations(self.parameters.eta, self.parameters.tail))

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """Phi(mean(f) / std(f)) of every constraint."""
        o, c, p = problem.observation, problem.candidates, self.parameters
        # Rows times `axes` turn from the mean robot's frame to the world's: draws in that frame turn with the world.
        axes = np.array(problem.to_robot.T, order="C")
        pose, noise, offsets = self._robot(problem, axes)
        discs = Discs.of([self._disc(o.obstacles[j], axes) for j in problem.reach.discs])
        pairs = blocks(discs, problem.reach, o, self.limits, p)
        cone = SampleCone.of(pairs, problem.rule, pose, noise, p.preview).reduce(c.v, c.omega, _probability)
        lane = np.zeros((len(c.v), 2))
        if o.lanes is not None:
            margin = self.limits.radius
            for side, samples in enumerate(lane_samples(o.lanes, pose, noise, offsets, c.v, c.omega, margin, p)):
                lane[:, side] = _probability(Samples.of(samples.T))
        return cone, lane

    def _robot(self, problem: Problem, axes: Array) -> tuple[Array, Array, tuple[Array, Array]]:
        """Samples of the Gaussian fitted to the robot: pose (n, 3), actuation noise (n, 2), lane offsets (n,) each."""
        o, mean = problem.observation, problem.mean_pose
        place, turn = (o.robot_pose[:, :2] - mean[:2]) @ axes.T, wrap(o.robot_pose[:, 2] - mean[2])
        offsets = (o.lanes.left_offset, o.lanes.right_offset) if o.lanes is not None else np.zeros((2, len(turn)))
        fitted = gaussian(np.column_stack([place, turn, o.control_noise, *offsets]), self._robot_draws)
        pose = np.column_stack([mean[:2] + fitted[:, :2] @ axes, mean[2] + fitted[:, 2]])
        return pose, fitted[:, 3:5], (fitted[:, 5], fitted[:, 6])

    def _disc(self, disc: ObstacleSamples, axes: Array) -> ObstacleSamples:
        """Samples of the Gaussian fitted to a disc; what is known exactly stays one sample."""
        disc = straightened(disc, self.parameters.horizon)
        if len(disc.position) == 1:
            return disc
        mean = disc.position.mean(axis=0)
        states = np.column_stack([(disc.position - mean) @ axes.T, disc.velocity @ axes.T])
        fitted = gaussian(states, self._disc_draws)
        return ObstacleSamples(mean + fitted[:, :2] @ axes, fitted[:, 2:] @ axes, disc.radius)


def gaussian(states: Array, draws: Array) -> Array:
    """Samples (n, d) of the Gaussian fitted to `states` (N, d), from standard normal draws (n, d).

    mean + S z, S the symmetric root of the covariance: from singular values, as the covariance may be singular, and
    the root of a rounding error would show.
    """
    mean = states.mean(axis=0)
    _, deviation, axes = np.linalg.svd((states - mean) / sqrt(len(states)), full_matrices=False)
    return mean + draws @ (axes.T * deviation) @ axes


def white(draws: Array) -> Array:
    """Draws (n, d) changed as little as it takes to have mean 0 and covariance 1, so that a fit's moments are exact.

    With n <= d, where no draws have that covariance: variances 1 (one draw: 0).
    """
    n, d = draws.shape
    centred = draws - draws.mean(axis=0)
    if n == 1:
        return np.zeros_like(draws)
    if n <= d:
        return centred / centred.std(axis=0)
    left, _, right = np.linalg.svd(centred, full_matrices=False)
    return sqrt(n) * left @ right


@kernel
def _probability(samples: Samples):
    """Phi(mean / std) of the samples, (K,); 0 or 1 where there is no spread.

    The mean is taken first: squares of what hardly differs would cancel.
    """
    mean, square = np.zeros(samples.f.shape[1]), np.zeros(samples.f.shape[1])
    stored, floor = np.full(samples.num, -1), np.full(mean.size, samples.floor)
    stored[samples.row] = np.arange(samples.row.size)  # -1 where a row is at the floor
    for i in stored:
        f = samples.f[i] if i >= 0 else floor
        for k in range(mean.size):
            mean[k] += f[k]
    mean /= samples.num
    for i in stored:
        f = samples.f[i] if i >= 0 else floor
        for k in range(mean.size):
            square[k] += (f[k] - mean[k]) ** 2
    out = np.empty(mean.size)
    for k in range(mean.size):
        out[k] = probability(mean[k], square[k] / samples.num)
    return out
