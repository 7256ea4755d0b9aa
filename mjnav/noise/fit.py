"""Laws fitted to recorded errors: Pearson's by four moments, mixtures of Gaussians by EM, and the errors themselves.

The number of a mixture's components is that of the least Bayesian information criterion, -2 log L + p log n with
p = 3 k - 1 (Schwarz 1978). The laws are then compared by what they say of errors that they were not fitted to: the
mean log-density over FOLDS folds, each left out once.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.noise.base import MOST, Distribution
from mjnav.noise.correlated import DistributionFunction
from mjnav.noise.distributions import Empirical, Mixture, thinned
from mjnav.noise.pearson import Pearson

FEWEST = 20  # errors; four moments of fewer say next to nothing
MOST_COMPONENTS, ROUNDS = 4, 300  # of EM
NARROWEST = 1e-3  # of the errors' standard deviation: a component on one error has no width
FOLDS = 5
FLAT = 1e-3  # kurtosis that is above the least one of a law with the skew, skew^2 + 1


@dataclass(frozen=True, slots=True)
class Fit:
    """One fitted law."""

    name: str  # as in run files
    law: Distribution
    arguments: Mapping[str, Any]  # of the law, as in run files
    score: float  # mean log-density of errors that were left out
    distance: float  # Kolmogorov and Smirnov's: the largest |F_n - F|


def pearson_fit(errors: Array) -> Pearson:
    """With the mean, standard deviation, skew and kurtosis of the errors (n,), as far as the family has them."""
    mean, std = float(errors.mean()), float(errors.std())
    z = (errors - mean) / std
    skew, kurtosis = float((z**3).mean()), float((z**4).mean())
    while True:
        try:
            return Pearson(mean=mean, std=std, skew=skew, kurtosis=max(kurtosis, skew**2 + 1.0 + FLAT))
        except InvalidValue:  # at the family's edge: nearer to a Gaussian there is a member
            skew, kurtosis = 0.98 * skew, 3.0 + 0.98 * (kurtosis - 3.0)


def mixture_fit(errors: Array) -> Mixture:
    """The mixture of at most MOST_COMPONENTS Gaussians with the least information criterion."""
    fits = [_by_em(errors, k) for k in range(1, MOST_COMPONENTS + 1)]
    num = len(errors)
    return min(fits, key=lambda law: -2.0 * law.logpdf(errors).sum() + (3 * len(law.weights) - 1) * np.log(num))


def _by_em(errors: Array, num: int) -> Mixture:
    """Expectation and maximisation (Dempster, Laird & Rubin 1977), from equal parts of the sorted errors on."""
    parts = np.array_split(np.sort(errors), num)
    least = NARROWEST * errors.std()
    weights, means = np.full(num, 1.0 / num), np.array([part.mean() for part in parts])
    stds = np.array([max(part.std(), least) for part in parts])
    for _ in range(ROUNDS):
        z = (errors[:, None] - means) / stds
        log_density = np.log(weights) - np.log(stds) - 0.5 * z * z
        shares = np.exp(log_density - log_density.max(axis=1, keepdims=True))
        shares /= shares.sum(axis=1, keepdims=True)
        total = np.maximum(shares.sum(axis=0), 1e-12)
        weights, means = total / len(errors), (shares * errors[:, None]).sum(axis=0) / total
        stds = np.maximum(np.sqrt((shares * (errors[:, None] - means) ** 2).sum(axis=0) / total), least)
    return Mixture(weights=tuple(weights.tolist()), means=tuple(means.tolist()), stds=tuple(stds.tolist()))


def empirical_fit(errors: Array) -> Empirical:
    """The errors themselves, as far as they are not too many."""
    return Empirical(samples=tuple(thinned(errors.tolist())))


_ARGUMENTS: Mapping[str, tuple[Callable[[Array], Any], tuple[str, ...]]] = MappingProxyType(
    {
        "pearson": (pearson_fit, ("mean", "std", "skew", "kurtosis")),
        "mixture": (mixture_fit, ("weights", "means", "stds")),
        "empirical": (empirical_fit, ()),  # a run file names the file in place of its numbers
    }
)


def fits(errors: Array) -> tuple[Fit, ...]:
    """All laws fitted to errors (n,), the best first. Raises InvalidValue for too few errors, and for equal ones."""
    if len(errors) < FEWEST:
        raise InvalidValue("", f"{len(errors)} numbers", f"at least {FEWEST}")
    folds = np.arange(len(errors)) % FOLDS
    if min(errors[folds != k].std() for k in range(FOLDS)) <= 1e-12 * np.abs(errors).max():
        most = np.median(errors)
        raise InvalidValue("", f"{np.count_nonzero(errors == most)} times {most:g}", "numbers that differ")
    if max(abs(errors.mean()), errors.std()) > MOST:
        found = f"a mean of {errors.mean():.4g} and a std of {errors.std():.4g}"
        raise InvalidValue("", found, f"both at most {MOST:g}, in the unit of the channel")
    found = []
    for name, (fit, keys) in _ARGUMENTS.items():
        left_out = [fit(errors[folds != k]).logpdf(errors[folds == k]) for k in range(FOLDS)]
        law = fit(errors)
        ordered, n = np.sort(errors), len(errors)
        shares = DistributionFunction.of(law).below(ordered)
        distance = max(np.abs(shares - np.arange(n) / n).max(), np.abs(shares - np.arange(1, n + 1) / n).max())
        score = float(np.concatenate(left_out).mean())
        found.append(Fit(name, law, {key: getattr(law, key) for key in keys}, score, float(distance)))
    return tuple(sorted(found, key=lambda one: -one.score))
