"""The marks of a field's type in `Annotated`: what its value may be, and where it stands in a file.

A string among the marks describes the key.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from math import inf
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints

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


class Other(Protocol):
    """What a variant becomes whose name is none of those that are known."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def parameters(self) -> Mapping[str, object]:
        """The keys beside the name."""
        ...

    def __init__(self, name: str, parameters: Mapping[str, object]): ...

    @classmethod
    def serves(cls, value: Any) -> bool:
        """Whether a value may stand for one."""
        ...

    @classmethod
    def of(cls, value: Any) -> Any:
        """The one that a value stands for."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Variants:
    """One of several dataclasses: its name stands under `key`, its own keys beside that.

    A name that `other` serves becomes other(name, the keys beside it), which is checked when it is used.
    """

    key: str
    kinds: Mapping[str, type]
    other: "type[Other] | None" = None


@dataclass(frozen=True, slots=True)
class Named:
    """A mapping from some of these names; a dot in a name leads into a table. `word` stands for them in a reference."""

    names: Collection[str]
    word: str = "NAME"


@dataclass(frozen=True, slots=True)
class Beside:
    """The keys of this field stand among those of the table that it belongs to."""


@dataclass(frozen=True, slots=True)
class FieldKey:
    """A field as a file has it; `default` is MISSING where the key is required."""

    name: str  # of the field
    hint: Any
    default: Any
    beside: bool
    description: str


@cache
def keys(cls: Any) -> Mapping[str, FieldKey]:
    """The keys of a table that becomes a `cls`. A field that is not compared, or not an argument, is not in a file."""
    hints, found = get_type_hints(cls, include_extras=True), {}
    for field in fields(cls):
        if field.compare and field.init:
            hint = hints[field.name]
            alias = mark(hint, Key)
            default = field.default if field.default_factory is MISSING else field.default_factory()
            found[alias.name if alias else field.name] = FieldKey(
                field.name, hint, default, mark(hint, Beside) is not None, mark(hint, str) or ""
            )
    return MappingProxyType(found)


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


_NAMES = MappingProxyType(  # of a type's values, one and many
    {
        float: ("a number", "numbers"),
        int: ("a whole number", "whole numbers"),
        bool: ("true or false", "true or false"),
        str: ("a string", "strings"),
        Any: ("a value", "values"),
    }
)


def describe(hint: Any, many: bool = False) -> str:
    """What is allowed for a type, as messages say it; `many` of it in an array."""
    kind, choice, text, limits = bare(hint), mark(hint, Choice), mark(hint, Text), mark(hint, Range)
    if choice is not None:
        return ", ".join(sorted(choice.names))
    if text is not None:
        return text.allowed
    if alternatives := options(hint):
        return describe(alternatives[0], many)
    if get_origin(kind) is tuple:
        first, *rest = get_args(kind)
        count = "" if rest == [Ellipsis] else f"{len(rest) + 1} "
        return f"{'arrays' if many else 'an array'} of {count}{describe(first, many=True)}"
    name = _NAMES.get(kind, ("a table", "tables"))[many]
    if limits is None or many:
        return name
    return str(limits) if limits.low == limits.high else f"{name} {limits}"
