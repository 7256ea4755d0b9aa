"""The bootstrap particle filter's correction, for several bodies side by side.

    w_i <- w_i prod_c p(z_c | x_i)   (Gordon, Salmond & Smith 1993)

then systematic resampling where the effective sample size is low, roughening, and a fresh start from the reading where
the belief explains the readings no more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from mjnav.estimation.base import FilterSettings
from mjnav.estimation.likelihood import Likelihood
from mjnav.filters.resampling import roughen, systematic
from mjnav.filters.weights import ess, normalise, weighted_moments
from mjnav.geometry.angles import wrap
from mjnav.messages import Array
from mjnav.rng import stream


@dataclass(frozen=True, slots=True)
class Posterior:
    """Weighted particles of B bodies before any resampling."""

    particles: Array  # (B, n, d)
    weights: Array  # (B, n)
    mean: Array  # (B, d)
    covariance: Array  # (B, d, d)
    ess: Array  # (B,)
    recovered: NDArray[np.bool_]  # (B,)


class Bootstrap:
    """State of B bodies' filters: the particles to predict from, and their weights."""

    def __init__(self, bodies: Sequence[str], seed: int, settings: FilterSettings, *, heading: int | None = None):
        self._settings = settings
        self._heading = heading
        self._resampling = [stream(seed, "estimation.resampling", body) for body in bodies]
        self._roughening = [stream(seed, "estimation.roughening", body) for body in bodies]
        self._unexplained = np.zeros(len(bodies), int)  # readings in a row
        self._log_weights = np.zeros((len(bodies), 0))
        self.particles: Array | None = None  # (B, n, d) after resampling; None before the first reading

    def start(self, particles: Array) -> Posterior:
        """Starts from equally weighted particles (B, n, d)."""
        self._log_weights = np.full(particles.shape[:2], -log(particles.shape[1]))
        return self._conclude(particles, np.zeros(len(particles), bool))

    def correct(
        self,
        predicted: Array,
        errors: Sequence[Array],
        likelihoods: Sequence[Likelihood],
        respawn: Callable[[int], Array],
    ) -> Posterior:
        """Weighs predicted particles (B, n, d) by errors z - x, (B, n) a channel.

        A reading is unexplained where the mean of p(z - x) under the belief falls below the floor in any channel.
        After `patience` of them in a row body b starts again from respawn(b), (n, d).
        """
        prior = np.exp(self._log_weights)
        likelihood = 1.0
        explained = np.ones(len(predicted), bool)
        for error, model in zip(errors, likelihoods, strict=True):
            density = model.density(error)
            explained &= np.einsum("bn,bn->b", prior, density) >= 2.0 * model.floor
            likelihood = likelihood * density
        self._log_weights = self._log_weights + np.log(likelihood)
        self._unexplained = np.where(explained, 0, self._unexplained + 1)
        recovered = self._unexplained >= self._settings.patience
        if recovered.any():
            predicted = predicted.copy()
            for body in np.flatnonzero(recovered):
                predicted[body] = respawn(int(body))
                self._log_weights[body] = 0.0
                self._unexplained[body] = 0
        return self._conclude(predicted, recovered)

    def _conclude(self, particles: Array, recovered: NDArray[np.bool_]) -> Posterior:
        """The posterior by the weights; what to predict from is resampled where they have become uneven."""
        weights, log_sum = normalise(self._log_weights)
        self._log_weights = self._log_weights - log_sum[:, None]
        mean, covariance = weighted_moments(particles, weights, heading=self._heading)
        size = ess(weights)
        offsets = [rng.random() for rng in self._resampling]  # one a reading, used or not, so that seeds stay paired
        uneven = np.flatnonzero(size < self._settings.resample_below * weights.shape[1])
        self.particles = particles
        if uneven.size:
            self.particles = particles.copy()
            for body in uneven:
                chosen = particles[body, systematic(weights[body], offsets[body])]
                spread = np.sqrt(np.diagonal(covariance[body]))
                self.particles[body] = roughen(chosen, spread, self._settings.roughening, self._roughening[body])
                self._log_weights[body] = -log(weights.shape[1])
            if self._heading is not None:
                self.particles[..., self._heading] = wrap(self.particles[..., self._heading])
        return Posterior(particles, weights, mean, covariance, size, recovered)
