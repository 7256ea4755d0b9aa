"""The bootstrap particle filter's correction, for several bodies side by side.

    w_i <- w_i prod_c p(z_c | x_i)   (Gordon, Salmond & Smith 1993)

then systematic resampling where the effective sample size is low, roughening, and a fresh start from the reading where
the belief explains the readings no more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjnav.estimation.base import FilterSettings, Likelihood
from mjnav.filters.particles import ess, resample, reweigh, weighted_moments
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

    def __init__(
        self,
        bodies: Sequence[str],
        likelihoods: Sequence[Likelihood],
        seed: int,
        settings: FilterSettings,
        *,
        heading: int = -1,
    ):
        """`likelihoods` has one a channel; column `heading` of the particles is an angle."""
        self._likelihoods = tuple(likelihoods)
        self._least = np.array([[2.0 * model.floor] for model in likelihoods])  # mean density of an explained reading
        self._settings = settings
        self._heading = heading
        self._resampling = [stream(seed, "estimation.resampling", body) for body in bodies]
        self._roughening = [stream(seed, "estimation.roughening", body) for body in bodies]
        self._unexplained = np.zeros(len(bodies), int)  # readings in a row
        self._weights = np.zeros((len(bodies), 0))
        self.particles: Array | None = None  # (B, n, d) after resampling; None before the first reading

    def start(self, particles: Array) -> Posterior:
        """Starts from equally weighted particles (B, n, d)."""
        self._weights = np.full(particles.shape[:2], 1.0 / particles.shape[1])
        return self._conclude(particles, np.zeros(len(particles), bool))

    def correct(
        self, predicted: Array, errors: Array, respawn: Callable[[int], Array], new: Sequence[int] = ()
    ) -> Posterior:
        """Weighs predicted particles (B, n, d) by errors z - x of C channels, (C, B, n).

        A reading is unexplained where the mean of p(z - x) under the belief falls below the floor in any channel.
        After `patience` of them in a row body b starts again from respawn(b), (n, d). So do those that are `new`.
        """
        densities = np.empty(errors.shape)
        for density, error, model in zip(densities, errors, self._likelihoods, strict=True):
            density[:] = model.density(error)
        self._weights, expected = reweigh(self._weights, densities)
        self._unexplained = (self._unexplained + 1) * (expected < self._least).any(axis=0)
        recovered = self._unexplained >= self._settings.patience
        recovered[list(new)] = False
        started = [*np.flatnonzero(recovered).tolist(), *new]
        if started:
            predicted = predicted.copy()
            for body in started:
                predicted[body] = respawn(body)
                self._weights[body] = 1.0 / predicted.shape[1]
                self._unexplained[body] = 0
        return self._conclude(predicted, recovered)

    def coast(self, predicted: Array) -> Posterior:
        """Goes on with predicted particles (B, n, d) where nothing was measured."""
        return self._conclude(predicted, np.zeros(len(predicted), bool))

    def _conclude(self, particles: Array, recovered: NDArray[np.bool_]) -> Posterior:
        """The posterior by the weights; what to predict from is resampled where they have become uneven."""
        weights, num, strength = self._weights, particles.shape[1], self._settings.roughening
        mean, covariance = weighted_moments(particles, weights, self._heading)
        size = ess(weights)
        offsets = [rng.random() for rng in self._resampling]  # one a reading, used or not, so that seeds stay paired
        uneven = np.flatnonzero(size < self._settings.resample_below * num).tolist()
        self.particles = particles
        if uneven:
            self.particles, self._weights = particles.copy(), weights.copy()
            for body in uneven:
                normal = self._roughening[body].standard_normal(particles.shape[1:])
                self.particles[body] = resample(
                    particles[body], weights[body], offsets[body], covariance[body], strength, normal
                )
                self._weights[body] = 1.0 / num
        return Posterior(particles, weights, mean, covariance, size, recovered)
