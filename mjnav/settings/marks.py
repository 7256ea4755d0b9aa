"""The marks of a field's type in `Annotated`: what its value may be, and where it stands in a file.

A string among the marks describes the key.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import inf
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from mjnav.errors import InvalidValue

M = TypeVar("M")


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers from `low` to `high` in `unit`; an open end is left out; `or_inf` lets infinity in."""

    low: float
    high: float
    unit: str = ""
    open_low: bool = False
    open_high: bool = False
    or_inf: bool = False

    def __contains__(self, value: float) -> bool:
        above = self.low < value if self.open_low else self.low <= value
        below = value < self.high if self.open_high else value <= self.high
        return (above and below) or (self.or_inf and value == inf)

    def __str__(self) -> str:
        low, high = (f"{end:.12g}" if isinstance(end, float) else str(end) for end in (self.low, self.high))
        if low == high:
            return low
        if self.open_low or self.open_high:
            text = f"{'>' if self.open_low else '>='} {low} and {'<' if self.open_high else '<='} {high}"
        else:
            text = f"from {low} to {high}"
        return text + (f" {self.unit}" if self.unit else "") + (", or inf" if self.or_inf else "")

    def check(self, key: str, value: float) -> None:
        """Refuses a number outside, and NaN. Raises InvalidValue."""
        if value not in self:
            raise InvalidValue(key, value, f"a number {self}")


@dataclass(frozen=True, slots=True)
class Length:
    """How many values an array may have."""

    low: int
    high: int

    def __str__(self) -> str:
        return f"from {self.low} to {self.high} of them" if self.low else f"at most {self.high}"


@dataclass(frozen=True, slots=True)
class Choice:
    """The strings that are allowed."""

    names: Collection[str]


@dataclass(frozen=True, slots=True)
class Text:
    """Strings of printable characters, which a regular expression matches as a whole; `allowed` says so in words."""

    pattern: str
    longest: int
    allowed: str

    def __contains__(self, value: str) -> bool:
        return len(value) <= self.longest and value.isprintable() and re.fullmatch(self.pattern, value) is not None


@dataclass(frozen=True, slots=True)
class Key:
    """The key in the file, where a field's name cannot be it."""

    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Variants:
    """One of several dataclasses: its name stands under `key`, its own keys beside that.

    `other` is a class for further names, such as those of plug-ins: other.serves(value) says whether it takes a name or
    another value, other.of(value) makes one of that, other(name, parameters) one of a name and the keys beside it.
    """

    key: str
    kinds: Mapping[str, type]
    other: Any = None


@dataclass(frozen=True, slots=True)
class Named:
    """A mapping from some of these names; a dot in a name leads into a table. `word` stands for them in a reference."""

    names: Collection[str]
    word: str = "NAME"


@dataclass(frozen=True, slots=True)
class Beside:
    """The keys of this field stand among those of the table that it belongs to."""


def mark(hint: Any, kind: type[M]) -> M | None:
    """The mark of that kind, where the type has one."""
    marks = hint.__metadata__ if get_origin(hint) is Annotated else ()
    return next((found for found in marks if isinstance(found, kind)), None)


def bare(hint: Any) -> Any:
    """The type without its marks."""
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def options(hint: Any) -> tuple[Any, ...]:
    """The members of a union but None; none where the type is no union."""
    kind = bare(hint)
    is_union = get_origin(kind) in (Union, UnionType)
    return tuple(option for option in get_args(kind) if option is not NoneType) if is_union else ()
