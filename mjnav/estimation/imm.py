"""Stop and go by an interacting multiple model filter: one Kalman filter a mode of motion, mixed by a Markov chain.

Source: Blom & Bar-Shalom, IEEE Transactions on Automatic Control 33 (1988) 780. filterpy does the algebra.
"""

from collections.abc import Sequence
from math import exp, log, pi
from sys import float_info
from typing import Any

import numpy as np

from mjnav.estimation.gaussian import draw_gaussian, symmetrised
from mjnav.estimation.person_filter import PersonFilter
from mjnav.estimation.person_motion import PersonMotion
from mjnav.messages import Array

MODES = ("stand", "walk", "turn")


class ImmPersonFilter(PersonFilter):
    """`PersonMotion` with its three cases as the modes of a Markov chain.

    Within an interval T, with q the probability of a stop, start or turn and s the share of stops among them,

        mode    v becomes                     next: stand       walk             turn
        stand   N(0, still^2 I)                     1 - q       0                q
        walk    v + N(0, sway^2 T I)                q s         1 - q            q (1 - s)
        turn    N(0, walking_speed^2 I)             q s         1 - q            q (1 - s)

    and the position moves by the mean of the old and the new velocity times T. A filter j starts each interval from
    the mixture of all filters i with weights mu_ij = p_ij mu_i / c_j, c_j = sum_i p_ij mu_i; after a measurement of
    likelihood L_j under its prediction, mode j has the probability mu_j = L_j c_j / sum_k L_k c_k.
    """

    def __init__(self, motion: PersonMotion | None = None):
        super().__init__(motion)
        self._bank = _mode_bank()

    @property
    def mean(self) -> Array:
        """The moments of the mixture: (4,), a copy."""
        return self._bank.x.copy()

    @property
    def covariance(self) -> Array:
        """(4, 4), symmetric."""
        return symmetrised(self._bank.P)

    @property
    def mode_probabilities(self) -> Array:
        """Of MODES, (3,)."""
        return self._bank.mu.copy()

    def start(self, position: Array, covariance: Array) -> None:
        """Who comes stands as often as the chain's people do in the long run, s / (1 + s), or walks."""
        still, walking = self._motion.still, self._motion.walking_speed
        for kalman, speed_std in zip(self._bank.filters, (still, walking, walking), strict=True):
            kalman.x, kalman.P = self._state_at(position, covariance, speed_std)
        share = self._motion.stop_share
        self._bank.become(np.array([share, 1.0, 0.0]) / (1.0 + share))

    def predict(self, interval: float) -> None:
        """The modes of the next interval; one of no length changes nothing."""
        if interval <= 0.0:
            return
        chain, transitions, covariances = self._motion.modes(interval)
        for kalman, transition, covariance in zip(self._bank.filters, transitions, covariances, strict=True):
            kalman.F, kalman.Q = transition, covariance
        self._bank.move(chain)

    def correct(self, position: Array, covariance: Array) -> None:
        """Weighs the modes by how likely each held the position (2,) measured with `covariance` (2, 2)."""
        for kalman in self._bank.filters:
            kalman.R = covariance
        self._bank.weigh(position)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """From the mixture of the modes' Gaussians, of which `mean` and `covariance` are the moments."""
        counts = rng.multinomial(num, self._bank.mu)
        rows: Sequence[Array] = [
            draw_gaussian(kalman.x, symmetrised(kalman.P), count, rng)
            for kalman, count in zip(self._bank.filters, counts.tolist(), strict=True)
        ]
        return np.concatenate(rows)


def _mode_bank() -> Any:
    """filterpy's estimator of a filter a mode, whose chain and whose order of steps may change from step to step."""
    from filterpy.kalman import IMMEstimator, KalmanFilter

    class ModeFilter(KalmanFilter):
        @property
        def likelihood(self) -> float:
            """N(y; 0, S) of two numbers; filterpy's own takes the tenfold time for S of any size."""
            squared = self.y @ self.SI @ self.y
            determinant = self.S[0, 0] * self.S[1, 1] - self.S[0, 1] * self.S[1, 0]
            return max(exp(-0.5 * squared - 0.5 * log(determinant) - log(2.0 * pi)), float_info.min)

    class ModeBank(IMMEstimator):
        def become(self, probabilities: Array) -> None:
            """Modes of other probabilities."""
            self.mu = probabilities
            self._compute_state_estimate()

        def move(self, chain: Array) -> None:
            """Mixes by a chain, of which row i says where mode i goes, and predicts."""
            self.M = chain
            self._compute_mixing_probabilities()
            self.predict()
            self.become(self.cbar)  # filterpy's own moments of a prediction weigh it by the modes before

        def weigh(self, position: Array) -> None:
            self.cbar = self.mu
            self.update(position)

    filters = [ModeFilter(dim_x=4, dim_z=2) for _ in MODES]
    for kalman in filters:
        kalman.x, kalman.H = np.zeros(4), np.eye(2, 4)
    num = len(MODES)
    return ModeBank(filters, np.full(num, 1.0 / num), np.full((num, num), 1.0 / num))
