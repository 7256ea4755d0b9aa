from dataclasses import dataclass

import numpy as np
import pytest

from mjnav.noise import Distribution


@dataclass(frozen=True)
class Quadrature:
    """Probability masses on nodes from end to end of a density, by nothing but its logpdf and support."""

    x: np.ndarray
    mass: np.ndarray
    distribution: Distribution

    @classmethod
    def of(cls, distribution: Distribution) -> "Quadrature":
        # Trapezoids after x = mean +- std e^t, or a logistic map up to an end: exponentially exact, tails included.
        step = 0.02
        t = np.arange(-45.0, 90.0, step)
        nodes, weights = [], []
        for sign, end in zip((-1.0, 1.0), distribution.support, strict=True):
            if np.isfinite(end):
                length = abs(end - distribution.mean)
                x = np.where(
                    t < 0.0,
                    distribution.mean + sign * length / (1.0 + np.exp(-t)),
                    end - sign * length / (1.0 + np.exp(t)),
                )
                weight = length / ((1.0 + np.exp(-t)) * (1.0 + np.exp(t)))
            else:
                x = distribution.mean + sign * distribution.std * np.exp(t)
                weight = distribution.std * np.exp(t)
            order = slice(None, None, int(sign))
            nodes.append(x[order])
            weights.append(weight[order] * step)
        x = np.concatenate(nodes)
        return cls(x, np.concatenate(weights) * np.exp(distribution.logpdf(x)), distribution)

    @property
    def total(self) -> float:
        return float(self.mass.sum())

    def moments(self) -> tuple[float, float, float, float]:
        """Mean, std, skew, kurtosis."""
        mean = self.distribution.mean + float(np.sum(self.mass * (self.x - self.distribution.mean)))
        centred = (self.x - mean) / self.distribution.std
        second, third, fourth = (float(np.sum(self.mass * centred**k)) for k in (2, 3, 4))
        return mean, self.distribution.std * second**0.5, third / second**1.5, fourth / second**2

    def cdf(self, x: np.ndarray) -> np.ndarray:
        return np.interp(x, self.x, np.cumsum(self.mass) - 0.5 * self.mass)


@pytest.fixture(scope="session")
def quadrature():
    return Quadrature.of
