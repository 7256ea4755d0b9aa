"""Drawn values of a random scene, and its table [layout].

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

from mjnav import settings
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scene.ranges import MAX_POINTS, Point, Seed
from mjnav.settings import Length, Range, Settled, below
from mjnav.settings.marks import Choice, bare, mark, options
from mjnav.settings.table import value_type

# -------------------------------------------------------------------------------- the table [layout]


# What a layout is drawn for -> the remainder, modulo the number of purposes, of the whole numbers that its streams
# start from: no layout seed of one purpose is ever one of another.
PURPOSES = MappingProxyType({"reporting": 0, "training": 1})


@dataclass(frozen=True, slots=True)
class Layout(Settled):
    """Which layout is drawn, and what it keeps to. In a scene that draws nothing, a record of where it came from."""

    seed: Annotated[Seed | None, "of the layout alone; by default the run's"] = None
    purpose: Annotated[
        str, Choice(PURPOSES), "what the layout is for: no layout seed of one purpose is one of the other"
    ] = "reporting"
    gap: Annotated[
        Annotated[float, Range(0.0, 100.0, "m")] | None,
        "least distance of drawn furniture from all else; by default the robot's diameter and 0.4 m",
    ] = None
    tries: Annotated[int, Range(1, 10_000), "number of layouts that are drawn before the scene is refused"] = 200

    def root(self) -> int:
        """The whole number from which all streams of this layout start."""
        return (self.seed or 0) * len(PURPOSES) + PURPOSES[self.purpose]

    @property
    def label(self) -> str | None:
        """Purpose and seed, "reporting 7"; None where no seed is known, as nothing was drawn."""
        return None if self.seed is None else f"{self.purpose} {self.seed}"


@dataclass(frozen=True, slots=True)
class Draft:
    """The tables of a run file that draw something, as they stand there, with [layout]; by key."""

    tables: Mapping[str, Any]


# ------------------------------------------------------------------------------------ kinds of draws


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
class Uniform(Settled):
    """A number, uniform between two."""

    low: Annotated[Number, "least value"]
    high: Annotated[Number, "largest value"]
    log: Annotated[bool, "the logarithm is uniform in place of the number: 1 to 2 is as likely as 2 to 4"] = False

    def _check(self):
        _check_order("high", self.low, self.high)
        if self.log and self.low <= 0.0:
            raise InvalidValue("low", self.low, "a number > 0, with log = true")


@dataclass(frozen=True, slots=True)
class Normal(Settled):
    """A number, normally distributed, drawn again until it is allowed, and between `low` and `high`."""

    mean: Annotated[Number, "of the numbers before any is drawn again"]
    std: Annotated[float, Range(0.0, 1e9), "of the numbers before any is drawn again"]
    low: Annotated[Number | None, "least value"] = None
    high: Annotated[Number | None, "largest value"] = None

    def _check(self):
        _check_order("high", *self.ends)

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest value."""
        return -inf if self.low is None else self.low, inf if self.high is None else self.high


@dataclass(frozen=True, slots=True)
class OneOf(Settled):
    """One of several values, which may be drawn themselves."""

    one_of: Annotated[tuple[Any, ...], Length(1, 1000), "the values"]
    shares: Annotated[tuple[Share, ...] | None, "of each, counted against their sum; equal by default"] = None

    def _check(self):
        if self.shares is not None and len(self.shares) != len(self.one_of):
            raise InvalidValue("shares", list(self.shares), f"{len(self.one_of)} numbers, one a value")
        with below("shares"):
            _check_shares(self.shares or (1.0,))


@dataclass(frozen=True, slots=True)
class InArea(Settled):
    """A point, uniform in a rectangle, or in several, each by its size; with `count` an array of points."""

    area: Area
    count: Annotated[
        tuple[NumPoints, NumPoints] | NumPoints | None, "number of points, or the least and the largest number"
    ] = None

    def _check(self):
        if isinstance(self.count, tuple):
            _check_order("count.1", *self.count)


# The key that tells a draw from a table of another meaning, and what that table is.
KINDS: Mapping[str, type] = MappingProxyType(
    {"one_of": OneOf, "area": InArea, "mean": Normal, "std": Normal, "low": Uniform, "high": Uniform}
)


def kind_of(value: Mapping[str, Any]) -> type | None:
    """The kind of draw that a table is; None where it is none."""
    return next((kind for key, kind in KINDS.items() if key in value), None)


def is_draw(value: object, hint: Any = Any) -> bool:
    """Whether the value of a key of type `hint` stands for one that is drawn, or has one in it."""
    if isinstance(value, Mapping):
        return kind_of(value) is not None or _choice(hint) is not None or any(map(is_draw, value.values()))
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
    low, high = draw.ends
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


def _check_order(key: str, low: float, high: float) -> None:
    if high < low:
        raise InvalidValue(key, high, f"a number from the least one ({low:g}) on")


def _check_shares(shares: tuple[float, ...]) -> None:
    if not sum(shares) > 0.0:
        raise InvalidValue("", list(shares), "shares of which at least one is more than 0")


# ---------------------------------------------------------------------------------- values of a key


Draw = Callable[[str, Streams], Any]  # the plain value of a key, from the streams of its key


def drawing(hint: Any, value: Any) -> Draw:
    """What draws the value of a key of type `hint`, which is Any for a key of which nothing is known.

    Raises InvalidValue where the key does not allow the value, or something that may be drawn for it.
    """
    if not is_draw(value, hint):
        if hint is not Any:
            settings.settled(hint, value)
        return lambda key, streams: value
    if isinstance(value, list):
        hints = _hints_of_items(hint, value)
        items = [_part(str(i), item_hint, item) for i, (item_hint, item) in enumerate(zip(hints, value, strict=True))]
        return lambda key, streams: [item(f"{key}.{i}", streams) for i, item in enumerate(items)]
    kind, choice = kind_of(value), _choice(hint)
    if choice is not None and kind is not OneOf:
        return _drawing_of_names(choice, value)
    if kind is not None:
        return _drawing_of_kind(hint, value, settings.read(kind, value))
    table = next((bare(option) for option in options(hint) or (hint,) if is_dataclass(bare(option))), None)
    if table is None and hint is not Any:
        raise InvalidValue("", value, value_type(hint).describe())
    hints = {} if table is None else {name: field.hint for name, field in settings.keys(table).items()}
    parts = {name: _part(name, hints.get(name, Any), item) for name, item in value.items()}
    return lambda key, streams: {name: part(f"{key}.{name}", streams) for name, part in parts.items()}


def _part(name: str, hint: Any, value: Any) -> Draw:
    with below(name):
        return drawing(hint, value)


def _drawing_of_kind(hint: Any, value: Mapping[str, Any], draw: Uniform | Normal | OneOf | InArea) -> Draw:
    match draw:
        case OneOf(one_of, shares):
            with below("one_of"):
                parts = [_part(str(i), hint, item) for i, item in enumerate(one_of)]

            def one_of_them(key: str, streams: Streams) -> Any:
                chosen = draw_share(shares or (1.0,) * len(parts), streams(key))
                return parts[chosen](f"{key}.{chosen}", streams)

            return one_of_them
        case InArea(area, count):
            if count is None:
                _check_points(hint, value, [0.0, 0.0])
                return lambda key, streams: draw_point(area, streams(key))
            _check_points(hint, value, [[0.0, 0.0]] * (2 if isinstance(count, tuple) else count))

            def points(key: str, streams: Streams) -> list[list[float]]:
                number = draw_count(count, streams(f"{key}.count"))
                return [draw_point(area, streams(f"{key}.{i}")) for i in range(number)]

            return points
    number = next((option for option in options(hint) or (hint,) if bare(option) in (float, int)), None)
    ends = {end: value[end] for end in ("low", "high") if end in value}
    if number is None and hint is not Any:
        raise InvalidValue("", value, value_type(hint).describe())
    for end, limit in ends.items() if number is not None else ():
        with below(end):
            settings.settled(number, limit)
    are_whole = bool(ends) and all(isinstance(limit, int) for limit in ends.values())
    whole = are_whole if number is None else bare(number) is int

    def a_number(key: str, streams: Streams) -> float | int:
        with below(*key.split(".")):
            return draw_number(draw, mark(number, Range), whole, streams(key))

    return a_number


def _check_points(hint: Any, value: Any, example: list) -> None:
    """Raises InvalidValue where a key takes no point, or no array of points, such as `example`."""
    if hint is Any:
        return
    try:
        settings.settled(hint, example)
    except InvalidValue:
        allowed = f"{value_type(hint).describe()}; an area with a count is an array of points, without one a point"
        raise InvalidValue("", dict(value), allowed) from None


def _choice(hint: Any) -> Choice | None:
    """The names that a key takes, for which a table may give shares; None where it takes no names."""
    return next((choice for option in options(hint) or (hint,) if (choice := mark(option, Choice)) is not None), None)


def _drawing_of_names(choice: Choice, value: Mapping[str, Any]) -> Draw:
    for name, share in value.items():
        if name not in choice.names:
            raise unknown_name("", name, choice.names)
        with below(name):
            settings.settled(Share, share)
    names, shares = list(value), tuple(value.values())
    _check_shares(shares)
    return lambda key, streams: names[draw_share(shares, streams(key))]


def _hints_of_items(hint: Any, value: list) -> tuple[Any, ...]:
    """The type of each item of an array. Raises InvalidValue for another number of them."""
    if hint is Any:
        return (Any,) * len(value)
    kind = next((bare(option) for option in options(hint) or (hint,) if get_origin(bare(option)) is tuple), None)
    hints = get_args(kind)
    hints = hints[:1] * len(value) if hints and hints[-1] is Ellipsis else hints
    if len(hints) != len(value):
        raise InvalidValue("", value, value_type(hint).describe())
    return hints
