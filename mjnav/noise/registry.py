"""Distributions by name, as run files have them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any

from mjnav.config import Variants, settled
from mjnav.noise.base import Distribution
from mjnav.noise.distributions import Empirical, Gaussian, Mixture, StudentT, Uniform, Zero
from mjnav.noise.pearson import Pearson
from mjnav.plugins import DistributionPlugin

DISTRIBUTIONS: Mapping[str, type[Any]] = MappingProxyType(
    {
        "pearson": Pearson,
        "mixture": Mixture,
        "gaussian": Gaussian,
        "uniform": Uniform,
        "student_t": StudentT,
        "empirical": Empirical,
        "zero": Zero,
    }
)
# As a table: the name under `distribution`, its arguments beside it.
NamedDistribution = Annotated[
    Distribution, Variants("distribution", DISTRIBUTIONS, DistributionPlugin), "law of the noise"
]


def names() -> tuple[str, ...]:
    """The distributions that exist."""
    return tuple(DISTRIBUTIONS)


def make_distribution(name: str, /, **arguments: object) -> Distribution:
    """The distribution `name` with its arguments, which are the fields of its class.

    InvalidValue names the argument that is unknown, missing, of a wrong type or impossible; its key is "distribution"
    where the name itself is unknown.
    """
    return settled(NamedDistribution, {"distribution": name, **arguments})
