"""Values that are drawn: what may stand in place of a value of a random scene, how it is checked and drawn.

    speed = { low = 0.3, high = 1.2 }                                  # uniform; of whole numbers, both ends too
    speed = { low = 0.1, high = 10.0, log = true }                     # its logarithm is uniform
    speed = { mean = 1.29, std = 0.19, low = 0.5 }                     # normal, drawn again until it is in the range
    behaviour = { one_of = ["waypoints", "stop_and_go"] }              # equal shares, or with shares = [3, 1]
    temperament = { regular = 0.7, scared = 0.3 }                      # of names, with shares (of their sum)
    goal = { area = [[8.0, -2.0], [10.0, 2.0]] }                       # a point, uniform in a rectangle or in several
    waypoints = { area = [[0.0, -2.0], [9.0, 2.0]], count = [2, 4] }   # points

Arrays may have draws among their items: velocity = [{ low = -0.5, high = 0.5 }, 0.0].
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp, inf, log
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from mjnav.config import Length, Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.ranges import MAX_POINTS, Point

# The stream of a value by its key, the same one whenever it is asked for.
Streams = Callable[[str], np.random.Generator]

MAX_REDRAWS = 1000  # of a normal value until it is in its range
Number = Annotated[float, Range(-1e9, 1e9)]
Share = Annotated[float, Range(0.0, 1e9)]
Rectangle = tuple[Point, Point]
Area = Annotated[
    Annotated[tuple[Rectangle, ...], Length(1, MAX_POINTS)] | Rectangle,
    "two opposite corners of a rectangle, or an array of such rectangles",
]
NumPoints = Annotated[int, Range(0, MAX_POINTS)]


@dataclass(frozen=True, slots=True)
class Uniform:
    """A number, uniform between two."""

    low: Annotated[Number, "least value"]
    high: Annotated[Number, "largest value"]
    log: Annotated[bool, "the logarithm is uniform in place of the number: 1 to 2 is as likely as 2 to 4"] = False

    def __post_init__(self):
        settle(self)
        _check_ends(self.low, self.high)
        if self.log and self.low <= 0.0:
            raise InvalidValue("low", self.low, "a number > 0, with log = true")


@dataclass(frozen=True, slots=True)
class Normal:
    """A number, normally distributed, drawn again until it is allowed, and between `low` and `high`."""

    mean: Annotated[Number, "of the numbers before any is drawn again"]
    std: Annotated[float, Range(0.0, 1e9), "of the numbers before any is drawn again"]
    low: Annotated[Number | None, "least value"] = None
    high: Annotated[Number | None, "largest value"] = None

    def __post_init__(self):
        settle(self)
        _check_ends(-inf if self.low is None else self.low, inf if self.high is None else self.high)


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of several values, which may be drawn themselves."""

    one_of: Annotated[tuple[Any, ...], Length(1, 1000), "the values"]
    shares: Annotated[tuple[Share, ...] | None, "of each, counted against their sum; equal by default"] = None

    def __post_init__(self):
        settle(self)
        if self.shares is not None and len(self.shares) != len(self.one_of):
            raise InvalidValue("shares", list(self.shares), f"{len(self.one_of)} numbers, one a value")
        _check_shares("shares", self.shares)


@dataclass(frozen=True, slots=True)
class InArea:
    """A point, uniform in a rectangle, or in several, each by its size; with `count` an array of points."""

    area: Area
    count: Annotated[
        tuple[NumPoints, NumPoints] | NumPoints | None, "number of points, or the least and the largest number"
    ] = None

    def __post_init__(self):
        settle(self)
        if isinstance(self.count, tuple):
            _check_ends(*self.count, key="count.1")


# The key that tells a draw from a table of another meaning, and what that table is.
KINDS: Mapping[str, type] = MappingProxyType(
    {"one_of": OneOf, "area": InArea, "mean": Normal, "std": Normal, "low": Uniform, "high": Uniform}
)


def kind_of(value: Mapping[str, Any]) -> type | None:
    """The kind of draw that a table is; None where it is none."""
    return next((kind for key, kind in KINDS.items() if key in value), None)


def is_draw(value: object) -> bool:
    """Whether a value stands for one that is drawn, or has one in it."""
    if isinstance(value, Mapping):
        return kind_of(value) is not None or any(map(is_draw, value.values()))
    return isinstance(value, list) and any(map(is_draw, value))


def draw_count(count: int | tuple[int, int], rng: np.random.Generator) -> int:
    """How many: a number, or one between two."""
    return int(rng.integers(count[0], count[1] + 1)) if isinstance(count, tuple) else count


def draw_point(area: Rectangle | tuple[Rectangle, ...], rng: np.random.Generator) -> list[float]:
    """A point in the area: x, y [m]."""
    corners = np.array(area, float).reshape(-1, 2, 2)  # (areas, corners, xy)
    low, high = corners.min(axis=1), corners.max(axis=1)
    size = np.prod(high - low, axis=1)
    shares = size / size.sum() if size.sum() > 0.0 else np.full(len(size), 1.0 / len(size))
    which = int(np.searchsorted(np.cumsum(shares), rng.random(), side="right").clip(0, len(size) - 1))
    return [float(value) for value in rng.uniform(low[which], high[which])]


def draw_number(draw: Uniform | Normal, limits: Range | None, whole: bool, rng: np.random.Generator) -> float | int:
    """A number that the `limits` of its key allow. Raises InvalidValue for a normal one that is hardly ever allowed."""
    if isinstance(draw, Uniform):
        if draw.log:
            value = exp(rng.uniform(log(draw.low), log(draw.high + whole)))  # a whole number k has [k, k + 1)
            value = min(max(value, draw.low), draw.high)
            return int(value) if whole else value
        if whole:
            return int(rng.integers(int(draw.low), int(draw.high) + 1))
        return float(rng.uniform(draw.low, draw.high))
    low, high = -inf if draw.low is None else draw.low, inf if draw.high is None else draw.high
    for _ in range(MAX_REDRAWS):
        value = float(rng.normal(draw.mean, draw.std))
        value = round(value) if whole else value
        if low <= value <= high and (limits is None or value in limits):
            return value
    allowed = "a mean and a std with which numbers are in the range more than once in a thousand draws"
    raise InvalidValue("mean", draw.mean, allowed)


def draw_share(shares: tuple[float, ...], rng: np.random.Generator) -> int:
    """The index of one of several, by its share."""
    edges = np.cumsum(shares)
    return int(np.searchsorted(edges / edges[-1], rng.random(), side="right").clip(0, len(shares) - 1))


def _check_ends(low: float, high: float, key: str = "high") -> None:
    if high < low:
        raise InvalidValue(key, high, f"a number from the least one ({low:g}) on")


def _check_shares(key: str, shares: tuple[float, ...] | None) -> None:
    if shares is not None and not sum(shares) > 0.0:
        raise InvalidValue(key, list(shares), "shares of which at least one is more than 0")
