"""Noise: distributions by name, their log-densities, and profiles that give every channel of a run one.

Arrays in, arrays out: `sample(rng, size)` takes the generator, `logpdf(x)` is the exact density of what it draws.
"""

from mjnav.noise.base import Distribution, made
from mjnav.noise.distributions import Empirical, Gaussian, Mixture, StudentT, Uniform, Zero
from mjnav.noise.pearson import Pearson, pearson_type
from mjnav.noise.profiles import (
    CHANNEL_MEANINGS,
    CHANNELS,
    NOISE_WINDOW,
    TIMED_CHANNELS,
    NamedDistribution,
    describe_profiles,
    make_distribution,
    names,
    profile,
    profile_names,
)

__all__ = [
    "CHANNELS",
    "CHANNEL_MEANINGS",
    "NOISE_WINDOW",
    "TIMED_CHANNELS",
    "Distribution",
    "Empirical",
    "Gaussian",
    "Mixture",
    "NamedDistribution",
    "Pearson",
    "StudentT",
    "Uniform",
    "Zero",
    "describe_profiles",
    "made",
    "make_distribution",
    "names",
    "pearson_type",
    "profile",
    "profile_names",
]
