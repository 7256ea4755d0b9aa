"""`rkhs-plan` with one part taken out or put in, for the study `ablations`: what is each of them worth?

A run or study file names one as "mjnav.control.methods.plan_ablations:StraightWay". They are for comparison; what helps
is in `rkhs-plan`. Parts that are parameters (weights, margins, degree, samples) need no class here.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from mjnav.config import Range
from mjnav.control.kernels.mppi_rollout import Rollouts
from mjnav.control.methods.rkhs_plan import RkhsPlan, RkhsPlanParameters
from mjnav.control.parameters import LEAST, Count, Positive
from mjnav.control.planner import Risks
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach
from mjnav.control.problem.problem import Problem
from mjnav.geometry.way_field import WayField
from mjnav.messages import Array, KnownMap
from mjnav.rkhs.ambiguity import Ambiguity
from mjnav.rkhs.dirac import distance_from_dirac
from mjnav.rkhs.gaussian import GaussianKernel
from mjnav.rkhs.herding import herded
from mjnav.rkhs.mmd import PolynomialKernel
from mjnav.rkhs.reference import distance_from_reference

Distance = Callable[[Array], Array]  # of violations (K, S): (K,)

# ------------------------------------------------------------------------------------------- the rollouts


class NoGuides(RkhsPlan):
    """Without guides, escapes and waiting: standing, the plan so far, the straight way, and perturbations."""

    def guides(self, heading: float, way_direction: float, speed: float, back_speed: float) -> Array:
        """The straight way alone."""
        return super().guides(heading, way_direction, speed, back_speed)[:1]


class StraightWay(RkhsPlan):
    """The way left is the straight line to the goal, as if nothing stood between."""

    def way_field(self, known: KnownMap | None, goal: Array, start: Array) -> WayField:
        """Of an empty floor."""
        return super().way_field(None, goal, start)


class NoTail(RkhsPlan):
    """A plan ends where its last step does, moving or not."""

    ends_at_rest = False


class CheapestOnly(RkhsPlan):
    """The cheapest rollout is followed, never the mean."""

    follows_mean = False


# ------------------------------------------------------------------------------------------- the violation


class TimeIntegral(RkhsPlan):
    """The violation's mean over the plan's steps in place of its maximum."""

    def violation(self, samples: JointSamples, rollouts: Rollouts) -> Array:
        """1/T sum_t of the violation at step t alone, (K, S)."""
        each = [super(TimeIntegral, self).violation(*_at(t, samples, rollouts)) for t in range(len(samples.times))]
        return np.mean(each, axis=0)


class EachObstacle(RkhsPlan):
    """The distances of every obstacle's own violations, added up: not joint over obstacles."""

    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """lambda sum_j MMD({h_js}, 0), and P(max_j h_js >= 1)."""
        distance, parts = self.distance(samples), _bodies(samples)

        def risks(rollouts: Rollouts) -> Risks:
            h = np.zeros((rollouts.v.shape[1], samples.offsets.shape[1]))
            cost = np.zeros(len(h))
            for part in parts:
                own = self.violation(part, rollouts)
                cost += self.parameters.weight * distance(own)
                h = np.maximum(h, own)
            return Risks(cost, (h >= 1.0).mean(axis=1), h)

        return risks


def _at(t: int, samples: JointSamples, rollouts: Rollouts) -> tuple[JointSamples, Rollouts]:
    """Step t alone."""
    (x, y), r = samples.moving, rollouts
    moment = replace(samples, moving=(x[[t]], y[[t]]), times=samples.times[[t]])
    return moment, Rollouts(r.controls[:, [t]], r.x[[t]], r.y[[t]], r.heading[[t]], r.step)


def _bodies(samples: JointSamples) -> list[JointSamples]:
    """Each body alone, and each lane boundary."""
    (x, y), s = samples.moving, samples
    nothing = replace(
        s,
        moving=(x[:, :0].copy(), y[:, :0].copy()),
        moving_radius=s.moving_radius[:0],
        standing=s.standing[:0],
        standing_radius=s.standing_radius[:0],
        lanes=(),
    )
    return [
        *(
            replace(nothing, moving=(x[:, [b]], y[:, [b]]), moving_radius=s.moving_radius[[b]])
            for b in range(x.shape[1])
        ),
        *(
            replace(nothing, standing=s.standing[[w]], standing_radius=s.standing_radius[[w]])
            for w in range(len(s.standing))
        ),
        *(replace(nothing, lanes=(lane,)) for lane in s.lanes),
    ]


# --------------------------------------------------------------------------------- the Hilbert space's part


class ContactShare(RkhsPlan):
    """The share of samples with a contact: nothing graded, no Hilbert space."""

    def distance(self, samples: JointSamples) -> Distance:
        """P(h >= 1)."""
        return lambda h: (h >= 1.0).mean(axis=1)


class SafestMatched(RkhsPlan):
    """The distance from the violations of the safest rollout, in place of none (what the paper matches is a plan's)."""

    def distance(self, samples: JointSamples) -> Distance:
        """MMD({h_s(k)}, {h_s(k*)}), k* of least mean violation among the rollouts that were weighed first."""
        kernel = PolynomialKernel(self.parameters.degree)
        safest: list[Array] = []

        def distance(h: Array) -> Array:
            if not safest:
                safest.append(h[np.argmin(h.mean(axis=1))])
            return distance_from_reference(h, safest[0], kernel)

        return distance


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianParameters(RkhsPlanParameters):
    """With a Gaussian kernel."""

    bandwidth: Annotated[Positive, "sigma of the Gaussian kernel"] = 1.0


class Gaussian(RkhsPlan):
    """The distance from none by a Gaussian kernel."""

    parameters_type = GaussianParameters

    def distance(self, samples: JointSamples) -> Distance:
        """MMD under exp(-(x - y)^2 / (2 sigma^2))."""
        p: Any = self.parameters
        kernel = GaussianKernel(p.bandwidth)
        return lambda h: distance_from_dirac(h, kernel)


@dataclass(frozen=True, slots=True, kw_only=True)
class BallParameters(RkhsPlanParameters):
    """With a ball of distributions around the samples'."""

    bandwidth: Annotated[Positive, "sigma of the joint samples' Gaussian kernel, in median distances"] = 1.0
    ridge: Annotated[float, Range(LEAST, 1e3), "mu, added to the Gram matrix"] = 0.1
    epsilon: Annotated[float, Range(0.0, 10.0), "radius of the ball"] = 0.1


class Ball(RkhsPlan):
    """The greatest mean violation over all distributions within a ball around the samples' (`rkhs.ambiguity`)."""

    parameters_type = BallParameters

    def distance(self, samples: JointSamples) -> Distance:
        """mean(h) + epsilon |h|_H."""
        p: Any = self.parameters
        ambiguity = Ambiguity.of(samples.vectors, bandwidth=p.bandwidth, ridge=p.ridge)
        return lambda h: ambiguity.bound(h, p.epsilon)


@dataclass(frozen=True, slots=True, kw_only=True)
class HerdedParameters(RkhsPlanParameters):
    """With joint samples chosen from more."""

    samples: Annotated[Count, "N, number of joint samples to choose from"] = 200
    kept: Annotated[Count, "S, number of joint samples that are kept"] = 48


class Herded(RkhsPlan):
    """Joint samples herded from more of them (`rkhs.herding`)."""

    parameters_type = HerdedParameters

    def joint_samples(self, problem: Problem, reach: Reach, steps: int) -> JointSamples:
        """S of N, so that their embedding is near that of all N."""
        p: Any = self.parameters
        samples = super().joint_samples(problem, reach, steps)
        return samples.taking(herded(samples.vectors, min(p.kept, p.samples)))
