"""Noise distributions by name, as run files have them, and noise profiles: a distribution for every channel of a run.

A channel's noise is added to the truth: reading = truth + noise, actual twist = command + noise.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjnav.errors import unknown_name
from mjnav.noise.base import Distribution
from mjnav.noise.distributions import Empirical, Gaussian, Mixture, StudentT, Uniform, Zero
from mjnav.noise.pearson import Pearson
from mjnav.settings import Variants, settled
from mjnav.settings.plugins import DistributionPlugin

# ------------------------------------------------------------------------------ distributions by name


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


# ------------------------------------------------------------------------------------------- profiles


# Mixtures that the authors of Nair et al. (arXiv 2112.13034) published with related work: weights, means, stds.
_POSITION_WIDE = ((0.4, 0.6), (0.3, -0.2), (0.25, 0.05))
_POSITION_NARROW = ((0.4, 0.6), (0.03, -0.04), (0.02, 0.02))
_VELOCITY = ((0.3, 0.7), (-0.07, 0.03), (0.1, 0.6))
_CONTROL = ((0.4, 0.6), (-0.9, 1.0), (0.1, 0.6))
_OBSTACLE_POSITION = ((0.6, 0.4), (-0.5, 0.35), (0.25, 0.35))
_Published = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


class _Channel(NamedTuple):
    meaning: str
    pearson: tuple[float, float, float]  # std, skew, kurtosis of the default profile, mean 0: how hard the problem is
    bimodal: _Published


# No mixture is published for a heading, which has that nearest the robot's own pose, nor for a range, which has the one
# with two sharp modes; a rate from the gyro has a velocity's, and the distance from a lane a position's.
_CHANNELS: Mapping[str, _Channel] = MappingProxyType(
    {
        "odometry.v": _Channel("speed from the wheel encoders [m/s]", (0.03, -2.0, 8.4), _VELOCITY),
        "odometry.omega": _Channel("turn rate from the wheel encoders [rad/s]", (0.07, 1.1, 14.0), _VELOCITY),
        "actuation.v": _Channel("actual speed minus the command's [m/s]", (0.05, 1.5, 6.4), _CONTROL),
        "actuation.omega": _Channel("actual turn rate minus the command's [rad/s]", (0.08, -1.0, 5.0), _CONTROL),
        "pose.x": _Channel("x from the pose sensor [m]", (0.08, 1.2, 5.2), _POSITION_WIDE),
        "pose.y": _Channel("y from the pose sensor [m]", (0.08, 1.2, 5.2), _POSITION_WIDE),
        "pose.theta": _Channel("heading from the pose sensor [rad]", (0.05, 0.8, 5.0), _POSITION_NARROW),
        "detection.x": _Channel("x of a detected person [m]", (0.12, 1.2, 5.2), _OBSTACLE_POSITION),
        "detection.y": _Channel("y of a detected person [m]", (0.12, 1.2, 5.2), _OBSTACLE_POSITION),
        "lidar.range": _Channel("range of a beam [m]", (0.03, -1.2, 4.8), _POSITION_NARROW),
        "gyro": _Channel("turn rate from the gyro [rad/s]", (0.02, 0.5, 4.0), _VELOCITY),
        "lane.offset": _Channel("distance from a lane boundary [m]", (0.08, 1.2, 5.2), _POSITION_WIDE),
    }
)
CHANNEL_MEANINGS: Mapping[str, str] = MappingProxyType({name: row.meaning for name, row in _CHANNELS.items()})
CHANNELS = tuple(_CHANNELS)
TIMED_CHANNELS = tuple(name for name in CHANNELS if name not in ("lidar.range", "lane.offset"))  # one draw at a time
NOISE_WINDOW = 0.1  # [s] for which a draw of the actuation noise holds, whatever the control rate

_PEARSON = MappingProxyType({name: row.pearson for name, row in _CHANNELS.items()})
_TABLE_HEADING_STD = 0.2  # [rad] at which matching means and matching shapes choose different ways around a table

# Errors of five robots in sets 6 and 7 of the UTIAS multi-robot data (Leung et al., International Journal of Robotics
# Research, 2011), fitted by this project: mean, std, skew, kurtosis. n = 15655 for odometry, 31434 for the others.
_ODOMETRY_V = (-0.006, 0.016, -1.99, 8.4)  # [m/s] over windows of 0.5 s
_ODOMETRY_OMEGA = (0.0, 0.071, 1.09, 14.3)  # [rad/s]
_RANGE = (-0.035, 0.174, -1.20, 4.8)  # [m]
_BEARING = (-0.002, 0.014, -0.49, 7.7)  # [rad]


def none() -> dict[str, Distribution]:
    """Exactly no noise."""
    return {channel: Zero() for channel in CHANNELS}


def gaussian() -> dict[str, Distribution]:
    """The first two moments of `pearson`."""
    return {channel: Gaussian(std=_PEARSON[channel][0]) for channel in CHANNELS}


def pearson() -> dict[str, Distribution]:
    """The default: zero means, stds of a small indoor robot, skews and kurtoses like those in `measured`."""
    return {channel: _pearson(*_PEARSON[channel]) for channel in CHANNELS}


def bimodal() -> dict[str, Mixture]:
    """Published mixtures, each shifted to mean 0 and scaled to its channel's std in `pearson`.

    Weights and the ratios of means and stds stay as published. The velocity's mixture (odometry, gyro) has a narrow
    component inside a wide one and a single mode; the others have two.
    """
    return {channel: _scaled(row.bimodal, row.pearson[0]) for channel, row in _CHANNELS.items()}


def measured() -> dict[str, Distribution]:
    """Moments found in the UTIAS multi-robot data.

    | channel | moments | why |
    |---|---|---|
    | odometry.v, odometry.omega | all four, as found | the same quantity |
    | actuation.v, actuation.omega | of odometry, mean and skew negated | there, odometry is the command |
    | lidar.range | of range, all four | the same quantity, by camera |
    | detection.x, detection.y | of range, mean 0 | the mean lies along the ray, not along x and y |
    | pose.theta | of bearing, all four | a heading from one landmark has the bearing's error |
    | pose.x, pose.y, lane.offset | skew, kurtosis of range; std of `pearson`, mean 0 | not measured; from ranges |
    | gyro | skew, kurtosis of bearing; std of `pearson`, mean 0 | not measured; an angle |
    """

    channels: dict[str, tuple[float, float, float, float]] = {
        "odometry.v": _ODOMETRY_V,
        "odometry.omega": _ODOMETRY_OMEGA,
        "pose.theta": _BEARING,
        "detection.x": (0.0, *_RANGE[1:]),
        "detection.y": (0.0, *_RANGE[1:]),
        "lidar.range": _RANGE,
        "gyro": (0.0, _PEARSON["gyro"][0], *_BEARING[2:]),
    }
    for axis in ("v", "omega"):
        mean, std, skew, kurtosis = channels[f"odometry.{axis}"]
        channels[f"actuation.{axis}"] = (0.0 - mean, std, -skew, kurtosis)
    for channel in ("pose.x", "pose.y", "lane.offset"):
        channels[channel] = (0.0, _PEARSON[channel][0], *_RANGE[2:])
    return {channel: _pearson(*channels[channel][1:], mean=channels[channel][0]) for channel in CHANNELS}


def pearson_mirrored() -> dict[str, Distribution]:
    """`pearson` with every skew negated: the same mean, std and kurtosis. Shows whether a method uses the shape."""
    return {channel: _pearson(std, -skew, kurtosis) for channel, (std, skew, kurtosis) in _PEARSON.items()}


def bimodal_mirrored() -> dict[str, Distribution]:
    """`bimodal` reflected at its mean, 0."""
    return {channel: replace(law, means=tuple(-mean for mean in law.means)) for channel, law in bimodal().items()}


def table() -> dict[str, Distribution]:
    """`pearson` with a heading noise of 0.2 rad, for the figure in which the robot meets a table."""
    heading = _PEARSON["pose.theta"]
    return {**pearson(), "pose.theta": _pearson(_TABLE_HEADING_STD, *heading[1:])}


_PROFILES: Mapping[str, Callable[[], Mapping[str, Distribution]]] = MappingProxyType(
    {
        "none": none,
        "gaussian": gaussian,
        "pearson": pearson,
        "bimodal": bimodal,
        "measured": measured,
        "pearson-mirrored": pearson_mirrored,
        "bimodal-mirrored": bimodal_mirrored,
        "table": table,
    }
)


def profile_names() -> tuple[str, ...]:
    """The profiles that exist."""
    return tuple(_PROFILES)


def describe_profiles() -> dict[str, str]:
    """What each profile is, in a line."""
    return {name: (make.__doc__ or "").strip().partition("\n")[0].replace("`", "") for name, make in _PROFILES.items()}


@lru_cache  # the distributions never change, and take 2 ms to make
def profile(name: str) -> Mapping[str, Distribution]:
    """The distribution of every channel in CHANNELS; InvalidValue where there is no such profile."""
    if name not in _PROFILES:
        raise unknown_name("profile", name, _PROFILES)
    return MappingProxyType(_PROFILES[name]())


def _pearson(std: float, skew: float, kurtosis: float, mean: float = 0.0) -> Pearson:
    return Pearson(mean=mean, std=std, skew=skew, kurtosis=kurtosis)


def _scaled(published: _Published, std: float) -> Mixture:
    weights, means, stds = published
    shape = Mixture(weights=weights, means=means, stds=stds)
    ratio = std / shape.std
    return replace(
        shape,
        means=tuple((np.subtract(means, shape.mean) * ratio).tolist()),
        stds=tuple((np.array(stds) * ratio).tolist()),
    )
