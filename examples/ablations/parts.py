"""`rkhs-plan` with one part taken out or put in, for the studies beside this file: what is each part worth?

    mjnav sweep examples/ablations/ablations.toml      # the parts of the planner
    mjnav sweep examples/ablations/hilbert.toml        # the distances, with five samples
    mjnav run hall --controller examples/ablations/parts.py:StraightWay

Parts that are parameters (weights, margins, degree, samples) need no class here. What helped is in `rkhs-plan`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from scipy.optimize import nnls
from scipy.spatial.distance import pdist, squareform

from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.methods.cvar import conditional_value_at_risk
from mjnav.control.methods.rkhs_plan import RkhsPlan, RkhsPlanParameters
from mjnav.control.parameters import LEAST, Count, Positive, Share
from mjnav.control.planner import Risks, Weighed
from mjnav.control.problem.fan import ALONE, by_first_move
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import Rollouts
from mjnav.geometry.way_field import WayField, WayGrid
from mjnav.messages import Array, KnownMap
from mjnav.rng import stream
from mjnav.robot.prediction import Crowd, Futures
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle

# ------------------------------------------------------------------------------------------- the rollouts


class OneMove(RkhsPlan):
    """No second move: behind the first comes the way to the goal."""

    def weigh(self, problem: Problem, way: WayGrid, risks: Callable[[Rollouts], Risks], rollouts: Rollouts) -> Weighed:
        """What has no second move."""
        rows = np.arange(rollouts.x.shape[1])
        kept = np.append(by_first_move(rows)[:, 0], rows[-ALONE:])
        return super().weigh(problem, way, risks, rollouts.only(kept))


class StraightWay(RkhsPlan):
    """The way left is the straight line to the goal, as if nothing stood between."""

    def way_field(self, known: KnownMap | None, goal: Array, start: Array) -> WayField:
        """Of an empty floor."""
        return super().way_field(None, goal, start)


# --------------------------------------------------------------------------------- the Hilbert space's part


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedParameters(RkhsPlanParameters):
    """With a reduced set, and a Gaussian kernel of the violation."""

    samples: Annotated[Count, "N, number of joint samples to choose from"] = 100
    kept: Annotated[Count, "S, number of joint samples that are kept"] = 5
    bandwidth: Annotated[Positive, "sigma of the violation's Gaussian kernel"] = 1.0


class Reduced(RkhsPlan):
    """S joint samples of N and weights beta on them, both chosen so that their embedding is nearest to that of all N.

    The risk is MMD({(beta_s, h_s)}, 0) under a Gaussian kernel (Sharma & Singh 2024, "MMD-OPT", arXiv 2412.09121).
    """

    parameters_type = ReducedParameters

    def joint_samples(self, problem: Problem, reach: Reach, steps: int) -> JointSamples:
        """S of N."""
        p: Any = self.parameters
        samples = super().joint_samples(problem, reach, steps)
        gram = joint_gram(vectors(samples))
        kept = herded(gram, min(p.kept, p.samples))
        self._weights = nearest_weights(gram, kept)
        return only(samples, kept)

    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """As of `rkhs-plan`, each sample with its weight."""

        def risks(rollouts: Rollouts) -> Risks:
            h = self.violation(samples, rollouts)
            return Risks(self.parameters.weight * self.distance(h), (h >= 1.0) @ self._weights, h)

        return risks

    def distance(self, h: Array) -> Array:
        """MMD of the weighted violations from a point mass at 0 under exp(-(x - y)^2 / (2 sigma^2))."""
        p: Any = self.parameters
        return weighted_mmd(h, self._weights, p.bandwidth)


class ReducedMean(Reduced):
    """The mean violation of the reduced set: what its points and weights are worth without a distance."""

    def distance(self, h: Array) -> Array:
        """sum_s beta_s h_s."""
        return h @ self._weights


@dataclass(frozen=True, slots=True, kw_only=True)
class TailParameters(RkhsPlanParameters):
    """With a level."""

    eta: Annotated[Share, "of the samples that do not count, as they are better"] = 0.8


class Tail(RkhsPlan):
    """The mean of the worst share 1 - eta of violations: their conditional value at risk."""

    parameters_type = TailParameters

    def distance(self, h: Array) -> Array:
        """CVaR_eta(h)."""
        p: Any = self.parameters
        return conditional_value_at_risk(Samples.of(np.ascontiguousarray(h.T)), p.eta)


@dataclass(frozen=True, slots=True, kw_only=True)
class CountedParameters(RkhsPlanParameters):
    """With a violation from which on a sample counts."""

    level: Annotated[Share, "violation above which a sample counts"] = 0.0


class Counted(RkhsPlan):
    """The share of samples that violate at all: a sample average, nothing graded."""

    parameters_type = CountedParameters

    def distance(self, h: Array) -> Array:
        """P(h > level)."""
        p: Any = self.parameters
        return (h > p.level).mean(axis=1)


def only(samples: JointSamples, kept: Array) -> JointSamples:
    """These joint samples alone."""
    x, y = (np.ascontiguousarray(path[:, :, kept]) for path in samples.moving)
    lanes = tuple((normal, excess[kept]) for normal, excess in samples.lanes)
    return replace(samples, offsets=np.ascontiguousarray(samples.offsets[:, kept]), moving=(x, y), lanes=lanes)


def vectors(samples: JointSamples) -> Array:
    """(S, D) joint samples as vectors: the robot, all that moves at the first and the last step, and lanes."""
    ends = [path[t] for path in samples.moving for t in (0, -1)]
    return np.concatenate([samples.offsets, *ends, *(excess[None] for _, excess in samples.lanes)]).T


def joint_gram(samples: Array, bandwidth: float = 1.0) -> Array:
    """K_ij = exp(-|x_i - x_j|^2 / (2 sigma^2)) of joint samples (S, D) of any units, each standardised: (S, S).

    sigma is `bandwidth` times the median of the distances of all pairs (Gretton et al. 2012, section 8), or their root
    mean square where more than half of the pairs coincide.
    """
    deviation = samples.std(axis=0)
    varies = deviation > 1e-12 * np.abs(samples).max(axis=0, initial=0.0)
    squared = pdist((samples - samples.mean(axis=0))[:, varies] / deviation[varies], "sqeuclidean")
    scale = bandwidth**2 * (np.median(squared) or squared.mean() or 1.0)
    return np.exp(squareform(squared) / (-2.0 * scale))


def herded(gram: Array, num: int) -> Array:
    """Which `num` of S samples stand for all of them: indices, ascending (Chen, Welling & Smola 2010).

    Each choice leaves the least MMD between the chosen and all; then each is exchanged once for the best in its place.
    """
    chosen: list[int] = []
    mean = gram.mean(axis=1)

    def best() -> int:
        gain = mean - gram[chosen].sum(axis=0) / (len(chosen) + 1)
        gain[chosen] = -np.inf
        return int(gain.argmax())

    while len(chosen) < num:
        chosen.append(best())
    for _ in range(num):
        chosen.append((chosen.pop(0), best())[1])
    return np.sort(chosen)


def nearest_weights(gram: Array, chosen: Array) -> Array:
    """beta >= 0 of sum 1 on the chosen of S samples with the least MMD from equal weights on all of them, (s,).

    min_beta beta' K beta - 2 beta' kappa, kappa_i = 1/S sum_j K_ij: a least-squares problem in the root of K, whose
    last row, heavy, asks for the sum.
    """
    own = gram[np.ix_(chosen, chosen)]
    root = np.linalg.cholesky(own + 1e-9 * np.eye(len(own)))
    heavy = 1e4
    rows = np.vstack([root.T, np.full(len(own), heavy)])
    beta, _ = nnls(rows, np.append(np.linalg.solve(root, gram[chosen].mean(axis=1)), heavy))
    return beta / beta.sum()


def weighted_mmd(h: Array, weights: Array, bandwidth: float) -> Array:
    """MMD of weighted h (K, S) from a point mass at 0, Gaussian kernel: (K,)."""

    def kernel(x: Array) -> Array:
        return np.exp(x * x / (-2.0 * bandwidth**2))

    own = kernel(h[:, :, None] - h[:, None]) @ weights @ weights
    return np.sqrt(np.maximum(own - 2.0 * kernel(h) @ weights + 1.0, 0.0))


# ---------------------------------------------------------------------------------------------- people who may turn


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnsParameters:
    """Keys beside the model's name."""

    turns: Annotated[float, Range(0.0, 10.0, "1/s"), "how often a person turns"] = 0.3
    stops: Annotated[Share, "probability that who turns stops"] = 0.2

    def __post_init__(self):
        settle(self)


class Turns:
    """A predictor: x + v min(t, tau) + R(theta) v [t - tau]+, tau exponential, theta any angle; or the person stops."""

    parameters_type = TurnsParameters

    def __init__(self, scenario: Scenario, seed: int, parameters: TurnsParameters):
        self._parameters, self._stream = parameters, stream(seed, "turns")
        assert scenario.prediction is not None  # it names this class
        self._step, self._num = scenario.prediction.step, scenario.prediction.num_steps

    def predict(self, crowd: Crowd) -> Futures:
        """Samples of the people in crowd.tracks, each with a turn of its own."""
        p, shape = self._parameters, crowd.samples.shape[:2]
        time = (crowd.elapsed + self._step * np.arange(self._num + 1))[..., None]  # (P, 1, H + 1, 1)
        tau = self._stream.exponential(1.0 / max(p.turns, LEAST), shape)[..., None, None]
        angle = self._stream.uniform(-np.pi, np.pi, shape)
        c, s = np.cos(angle), np.sin(angle)
        place, (vx, vy) = crowd.samples[:, :, None, :2], np.moveaxis(crowd.samples[..., 2:], -1, 0)
        walks = self._stream.random(shape) >= p.stops
        after = (np.stack([c * vx - s * vy, s * vx + c * vy], axis=-1) * walks[..., None])[:, :, None]
        until = np.minimum(time, tau)
        return Futures.along(place + until * crowd.samples[:, :, None, 2:] + (time - until) * after, self._step)
