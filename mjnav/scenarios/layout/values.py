"""Drawn values of a random scene: what may stand in place of a plain value, how it is checked and drawn.

    speed = { low = 0.3, high = 1.2 }                                  # uniform; of whole numbers, both ends too
    speed = { low = 0.1, high = 10.0, log = true }                     # its logarithm is uniform
    speed = { mean = 1.29, std = 0.19, low = 0.5 }                     # normal, drawn again until it is in the range
    behaviour = { one_of = ["waypoints", "stop_and_go"] }              # equal shares, or with shares = [3, 1]
    temperament = { regular = 0.7, scared = 0.3 }                      # of names, with shares (of their sum)
    goal = { area = [[8.0, -2.0], [10.0, 2.0]] }                       # a point, uniform in a rectangle or in several
    waypoints = { area = [[0.0, -2.0], [9.0, 2.0]], count = [2, 4] }   # points

Arrays may have draws among their items: velocity = [{ low = -0.5, high = 0.5 }, 0.0].

The value of a key is checked against what the key allows before it is drawn.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, is_dataclass
from math import exp, inf, log
from types import MappingProxyType
from typing import Annotated, Any, get_args, get_origin

import numpy as np

from mjnav import config
from mjnav.config import Length, Range, below, settle
from mjnav.config.marks import Choice, bare, mark, options
from mjnav.config.table import describe
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.ranges import MAX_POINTS, Point

# ----------------------------------------------------------------------------------- kinds of draws


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
        _check_drawn_ends(self.low, self.high)
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
        _check_drawn_ends(-inf if self.low is None else self.low, inf if self.high is None else self.high)


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of several values, which may be drawn themselves."""

    one_of: Annotated[tuple[Any, ...], Length(1, 1000), "the values"]
    shares: Annotated[tuple[Share, ...] | None, "of each, counted against their sum; equal by default"] = None

    def __post_init__(self):
        settle(self)
        if self.shares is not None and len(self.shares) != len(self.one_of):
            raise InvalidValue("shares", list(self.shares), f"{len(self.one_of)} numbers, one a value")
        _check_drawn_shares("shares", self.shares)


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
            _check_drawn_ends(*self.count, key="count.1")


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


def _check_drawn_ends(low: float, high: float, key: str = "high") -> None:
    if high < low:
        raise InvalidValue(key, high, f"a number from the least one ({low:g}) on")


def _check_drawn_shares(key: str, shares: tuple[float, ...] | None) -> None:
    if shares is not None and not sum(shares) > 0.0:
        raise InvalidValue(key, list(shares), "shares of which at least one is more than 0")


# ---------------------------------------------------------------------------------- values of a key


ANY = Any  # the hint of a key of which nothing is known


def check_value(hint: Any, value: Any) -> None:
    """Raises InvalidValue where a value, or anything that may be drawn for it, is not what its key allows."""
    kind = _kind(hint, value)
    if kind in (Uniform, Normal):
        _check_ends(hint, value, required=kind is Uniform)
    draw = _draw(hint, value)
    if isinstance(draw, OneOf):
        for i, item in enumerate(draw.one_of):
            with below("one_of"), below(str(i)):
                check_value(hint, item)
    elif isinstance(draw, InArea):
        _check_points(hint, draw, value)
    elif _is_shares(hint, value):
        _check_shares(hint, value)
    elif isinstance(value, Mapping) and (fields := _fields(hint)) is not None and is_draw(value):
        for key, item in value.items():
            with below(key):
                check_value(fields.get(key, ANY), item)
    elif isinstance(value, list) and is_draw(value):
        for i, (item_hint, item) in enumerate(_items(hint, value)):
            with below(str(i)):
                check_value(item_hint, item)
    elif draw is None and hint is not ANY:
        config.settled(hint, value)


def draw_value(hint: Any, value: Any, key: str, streams: Streams) -> Any:
    """The value as a plain run file has it: itself, or one that is drawn from the streams of its key."""
    draw = _draw(hint, value)
    if isinstance(draw, OneOf):
        chosen = draw_share(draw.shares or (1.0,) * len(draw.one_of), streams(key))
        return draw_value(hint, draw.one_of[chosen], f"{key}.{chosen}", streams)
    if isinstance(draw, Uniform | Normal):
        number = _number_hint(hint, value)
        whole = bare(number) is int if number is not None else _are_whole(value)
        with below(key):
            return draw_number(draw, mark(number, Range), whole, streams(key))
    if isinstance(draw, InArea):
        if draw.count is None:
            return draw_point(draw.area, streams(key))
        count = draw_count(draw.count, streams(f"{key}.count"))
        return [draw_point(draw.area, streams(f"{key}.{i}")) for i in range(count)]
    if _is_shares(hint, value):
        return list(value)[draw_share(tuple(value.values()), streams(key))]
    if isinstance(value, Mapping) and (fields := _fields(hint)) is not None:
        return {one: draw_value(fields.get(one, ANY), item, f"{key}.{one}", streams) for one, item in value.items()}
    if isinstance(value, list) and is_draw(value):
        pairs = enumerate(_items(hint, value))
        return [draw_value(item_hint, item, f"{key}.{i}", streams) for i, (item_hint, item) in pairs]
    return value


def is_drawn(hint: Any, value: Any) -> bool:
    """Whether a value is drawn, or has a drawn one in it."""
    return is_draw(value) or _is_shares(hint, value)


def _draw(hint: Any, value: Any) -> Any:
    """The draw that a table stands for, checked; None where it is none."""
    kind = _kind(hint, value)
    return None if kind is None else config.read(kind, value)


def _kind(hint: Any, value: Any) -> type | None:
    kind = kind_of(value) if isinstance(value, Mapping) else None
    return None if kind is None or _is_shares(hint, value) else kind


def _check_ends(hint: Any, value: Mapping[str, Any], *, required: bool) -> None:
    """The ends of a range are numbers that the key allows. Raises InvalidValue."""
    number = _number_hint(hint, value)
    for end in ("low", "high"):
        if number is None:
            continue
        if end in value:
            with below(end):
                config.settled(number, value[end])
        elif required and {"low", "high", "log"} >= {*value}:  # another key is told first
            raise InvalidValue(end, None, f"{describe(number)}; this key is required")


def _number_hint(hint: Any, value: Any) -> Any:
    """The alternative of a type that is a number; None where nothing is known. Raises InvalidValue."""
    if hint is ANY:
        return None
    number = next((one for one in options(hint) or (hint,) if bare(one) in (float, int)), None)
    if number is None:
        raise InvalidValue("", value, describe(hint))
    return number


def _check_points(hint: Any, draw: InArea, value: Any) -> None:
    if hint is ANY:
        return
    found = [[0.0, 0.0]] * 2 if isinstance(draw.count, tuple) else [[0.0, 0.0]] * (draw.count or 0)
    try:
        config.settled(hint, found if draw.count is not None else [0.0, 0.0])
    except InvalidValue:
        allowed = f"{describe(hint)}; an area with a count is an array of points, without one a point"
        raise InvalidValue("", dict(value), allowed) from None


def _is_shares(hint: Any, value: Any) -> bool:
    """Whether a table gives the shares of names: of a key that takes one name of several."""
    if not isinstance(value, Mapping) or hint is ANY:
        return False
    choice = _choice(hint)
    return choice is not None and kind_of(value) is not OneOf


def _check_shares(hint: Any, value: Mapping[str, Any]) -> None:
    choice = _choice(hint)
    for name, share in value.items():
        if choice is not None and name not in choice.names:
            raise unknown_name("", name, choice.names)
        with below(name):
            config.settled(float, share)
            Range(0.0, 1e9).check("", share)
    if not sum(value.values()) > 0.0:
        raise InvalidValue("", dict(value), "shares of which at least one is more than 0")


def _choice(hint: Any) -> Choice | None:
    return next((found for one in options(hint) or (hint,) if (found := mark(one, Choice)) is not None), None)


def _fields(hint: Any) -> dict[str, Any] | None:
    """The types of the keys of a table, where a dataclass says them."""
    kind = next((bare(one) for one in options(hint) or (hint,) if is_dataclass(bare(one))), None)
    return None if kind is None else {key: field.hint for key, field in config.keys(kind).items()}


def _items(hint: Any, value: list) -> list[tuple[Any, Any]]:
    """The items of an array, each with its type. Raises InvalidValue for another number of them."""
    kind = next((bare(one) for one in options(hint) or (hint,) if get_origin(bare(one)) is tuple), None)
    if kind is None:
        if hint is not ANY:
            raise InvalidValue("", value, describe(hint))
        return [(ANY, item) for item in value]
    hints = get_args(kind)
    hints = hints[:1] * len(value) if hints[-1] is Ellipsis else hints
    if len(hints) != len(value):
        raise InvalidValue("", value, describe(hint))
    return list(zip(hints, value, strict=True))


def _are_whole(value: Mapping[str, Any]) -> bool:
    ends = [value[end] for end in ("low", "high") if end in value]
    return bool(ends) and all(isinstance(end, int) and not isinstance(end, bool) for end in ends)
