"""Distributions by name, as run files have them."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from types import MappingProxyType

from mjnav.errors import InvalidValue, unknown_name
from mjnav.noise.base import Distribution
from mjnav.noise.distributions import Empirical, Gaussian, Mixture, StudentT, Uniform, Zero
from mjnav.noise.pearson import Pearson

_DISTRIBUTIONS: Mapping[str, type] = MappingProxyType(
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


def names() -> tuple[str, ...]:
    """The distributions that exist."""
    return tuple(_DISTRIBUTIONS)


def make_distribution(name: str, /, **arguments: object) -> Distribution:
    """The distribution `name` with its arguments, which are the fields of its class.

    InvalidValue names the argument that is unknown, missing, of a wrong type or impossible; its key is "distribution"
    where the name itself is unknown.
    """
    if not isinstance(name, str) or name not in _DISTRIBUTIONS:
        raise unknown_name("distribution", name, _DISTRIBUTIONS)
    cls = _DISTRIBUTIONS[name]
    known = {f.name: f for f in fields(cls) if f.init}
    for key in arguments:
        if key not in known:
            raise unknown_name(key, key, known) if known else InvalidValue(key, key, f"no arguments: {name} has none")
    for key, argument in known.items():
        if key not in arguments and argument.default is MISSING:
            raise InvalidValue(key, None, f"a value: {name} needs {_listed(cls)}")
    return cls(**arguments)


def _listed(cls: type) -> str:
    required = [f.name for f in fields(cls) if f.init and f.default is MISSING]
    return ", ".join(required[:-1]) + " and " + required[-1] if len(required) > 1 else required[0]
