"""`rkhs-plan`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.config import Choice, Range
from mjnav.control.kernels.mppi_rollout import Rollouts
from mjnav.control.parameters import LEAST, MOST, Count, Seconds, Weight
from mjnav.control.planner import Planner, PlannerParameters, Risks
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array

Metres = Annotated[float, Range(LEAST, MOST, "m")]


@dataclass(frozen=True, slots=True, kw_only=True)
class RkhsPlanParameters(PlannerParameters):
    """The violation and its distance from none."""

    samples: Annotated[Count, "S, number of joint samples"] = 48
    safety_margin: Annotated[float, Range(0.0, MOST, "m"), "added to the combined radius R"] = 0.0
    weight: Annotated[Weight, "lambda, of the risk"] = 3.0
    measure: Annotated[str, Choice(("mmd", "share", "time")), "risk"] = "mmd"
    degree: Annotated[Count, "d of the kernel (x y + 1)^d"] = 2
    margin: Annotated[Metres, "m of what moves, at the moment of effect"] = 0.2
    margin_growth: Annotated[float, Range(0.0, MOST, "m/s"), "by which it grows"] = 0.1
    standing_margin: Annotated[Metres, "m of what stands"] = 0.1
    fading: Annotated[Seconds, "time in which violations by what moves fade"] = 3.0


class RkhsPlan(Planner[RkhsPlanParameters]):
    """Plans by the distance of the violations' distribution from none."""

    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """lambda MMD of {h_s} to 0, P(h >= 1) and h."""
        p, t = self.parameters, samples.times
        margins = p.margin + p.margin_growth * t, np.exp(-t / p.fading), p.standing_margin, np.ones_like(t)

        def risks(rollouts: Rollouts) -> Risks:
            h = samples.violation(rollouts, *margins)
            contact = (h >= 1.0).mean(axis=1)
            return Risks(p.weight * (distance(h, p.degree) if p.measure == "mmd" else contact), contact, h)

        return risks


def distance(h: Array, degree: int) -> Array:
    """MMD of samples (K, S) from the Dirac at 0."""
    from math import comb

    total, power = np.zeros(len(h)), np.ones_like(h)
    for n in range(1, degree + 1):
        power = power * h
        total += comb(degree, n) * power.mean(axis=1) ** 2
    return np.sqrt(total)
