"""Types of single values: what all types of values have in common, numbers, truth values and strings.

A type reads and writes its values, and says in words and as JSON Schema what they may be.
"""

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf
from numbers import Integral, Real
from typing import Any

from mjnav.errors import InvalidValue, unknown_name
from mjnav.settings.marks import Choice, Range, Text, bare, mark

Schema = dict[str, Any]
_LARGEST = sys.float_info.max


class ValueType:
    """Any value; the base of all types."""

    name = "value"  # one word, to which an "s" is added for many
    words = "a value", "values"  # in messages, one and many
    unit = ""
    allowed = ""  # what of the type is allowed: a range, names, a length; empty where everything is

    def read(self, value: Any) -> Any:
        """The value of a file, or of Python code, as the field holds it. Raises InvalidValue."""
        return value

    def read_beside(self, table: Mapping[str, Any], others: Iterable[str]) -> Any:
        """Of a field whose keys stand in its owner's table: `table` without the `others`, which are the owner's."""
        return dict(table)

    def write(self, value: Any) -> Any:
        """What `read` makes the value of."""
        return value

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """The JSON Schema. Tables in it have entries in `definitions`."""
        return {}

    def schema_beside(self, owner: Schema, definitions: dict[str, Schema]) -> Schema:
        """The schema of the owner's table with the keys of `read_beside`: any."""
        return owner

    def describe(self, many: bool = False) -> str:
        """What is allowed, as messages say it; `many` of it in an array."""
        return self.words[many]

    def full_name(self, many: bool = False) -> str:
        """The name with what it is made of: array of 2 numbers."""
        return f"{self.name}{'s' * many}"

    def inner_tables(self) -> Iterator[tuple[bool, Any]]:
        """The dataclasses of the tables that a value is (False) or is an array of (True)."""
        return iter(())

    def _of_type(self, kind: Any, value: Any) -> Any:
        if not isinstance(value, kind):
            raise InvalidValue("", value, self.describe())
        return value


class Number(ValueType):
    """A number; a whole number serves as a real one."""

    def __init__(self, hint: Any):
        self._kind, self._limits = bare(hint), mark(hint, Range)
        self.name = "integer" if self._kind is int else "number"
        self.words = ("a whole number", "whole numbers") if self._kind is int else ("a number", "numbers")
        if self._limits is not None:
            self.unit, self.allowed = self._limits.unit, str(replace(self._limits, unit=""))

    def read(self, value: Any) -> Any:
        """See `ValueType`."""
        number = value if type(value) is self._kind else self._converted(value)
        if self._limits is not None and number not in self._limits:
            raise InvalidValue("", number if abs(number) < inf else value, self.describe())
        return number

    def _converted(self, value: Any) -> Any:
        accepted: Any = Integral if self._kind is int else Real
        if not isinstance(value, accepted) or isinstance(value, bool):
            raise InvalidValue("", value, self.describe())
        try:
            return self._kind(value)
        except OverflowError:  # a whole number beyond the largest float
            return inf

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        limits = self._limits
        if limits is None:
            return {"type": self.name}
        low = {"exclusiveMinimum" if limits.open_low else "minimum": limits.low}
        high = {"exclusiveMaximum" if limits.open_high else "maximum": limits.high}
        if limits.or_inf:  # which JSON cannot write, but compare with
            return {"type": self.name, **low, "anyOf": [high, {"exclusiveMinimum": _LARGEST}]}
        return {"type": self.name, **low, **high}

    def describe(self, many: bool = False) -> str:
        """See `ValueType`."""
        if self._limits is None or many:
            return self.words[many]
        return str(self._limits) if self._limits.low == self._limits.high else f"{self.words[0]} {self._limits}"


class Boolean(ValueType):
    """True or false."""

    name = "boolean"
    words = "true or false", "true or false"

    def read(self, value: Any) -> bool:
        """See `ValueType`."""
        return self._of_type(bool, value)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        return {"type": "boolean"}


class String(ValueType):
    """A string: any, one of several names, or one that a pattern matches."""

    name = "string"
    words = "a string", "strings"

    def __init__(self, hint: Any):
        self._choice, self._text = mark(hint, Choice), mark(hint, Text)
        if self._choice is not None:
            self.allowed = ", ".join(self._choice.names)
            self.words = (", ".join(sorted(self._choice.names)),) * 2
        elif self._text is not None:
            self.allowed, self.words = self._text.allowed, (self._text.allowed,) * 2

    def read(self, value: Any) -> str:
        """See `ValueType`."""
        string = self._of_type(str, value)
        if self._choice is not None and string not in self._choice.names:
            raise unknown_name("", string, self._choice.names)
        if self._text is not None and string not in self._text:
            raise InvalidValue("", string, self._text.allowed)
        return string

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        if self._choice is not None:
            return {"type": "string", "enum": list(self._choice.names)}
        if self._text is not None:
            return {"type": "string", "pattern": f"^{self._text.pattern}$", "maxLength": self._text.longest}
        return {"type": "string"}
