"""`kld`: match each constraint's distribution with a collision-free one by Gaussian mixtures and their divergence.

As `rkhs`, but with Gaussian mixtures fitted to the samples and KL(F_j(u) || F_j^des) in place of MMD^2,

    u* = argmin_u  J(u) + lambda sum_j KL(F_j(u) || F_j^des) + sum_i lambda_i KL(D_i(u) || D_i^des),

the baseline of Poonganam, Gopalakrishnan, Avula, Singh, Krishna & Manocha, "Reactive Navigation Under Non-Parametric
Uncertainty Through Hilbert Space Embedding of Probabilistic Velocity Obstacles" (RA-L 2020). Where nothing safe is
known, the mixture of max(0, f) is compared with an atom at 0. No Gaussian is narrower than `std_floor`: without it
atoms, which the clip makes, would be infinitely far apart.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.base import MatchingController
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.kernels.mixture import Mixtures, fit_mixtures, kl_divergence
from mjnav.control.parameters import Count, MatchingParameters, Positive
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class KldParameters(MatchingParameters):
    """How the mixtures are fitted."""

    num_components: Annotated[Count, "of each fitted mixture"] = 2
    num_iterations: Annotated[Count, "of the EM fit"] = 10
    std_floor: Annotated[Positive, "least standard deviation of a component, in f's unit"] = (
        1.0  # so wide, mostly means are compared
    )


class Kld(MatchingController[KldParameters]):
    """The candidate whose constraint mixtures diverge least from collision-free ones, against its goal cost."""

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """KL of every constraint."""
        c, wanted = problem.candidates, self.desired(problem)
        cone = np.zeros((len(c.v), len(problem.cone.blocks.column)))
        for block, samples in enumerate(problem.cone.stored_by_block(c.v, c.omega)):
            cone[:, block] = self._divergence(samples, wanted.samples(block))
        lane = np.zeros((len(c.v), 2))
        for side, samples in enumerate(problem.lanes):
            lane[:, side] = self._divergence(Samples.of(samples.T), wanted.lane(side))
        return cone, lane

    def _divergence(self, samples: Samples, desired: Array) -> Array:
        """KL of the samples at each control from the desired ones (m,), where there are any."""
        if not len(desired):
            samples, desired = samples._replace(f=np.maximum(samples.f, 0.0), floor=0.0), np.zeros(1)
        return kl_divergence(self._fit(samples), self._fit(Samples.of(desired[:, None])))

    def _fit(self, samples: Samples) -> Mixtures:
        p = self.parameters
        return fit_mixtures(samples, p.num_components, p.num_iterations, p.std_floor)
