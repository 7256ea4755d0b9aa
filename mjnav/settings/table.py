"""Arrays and tables of a file: their types, and how a table becomes a dataclass and is written and described.

`value_type` makes the type of a field's values of its marks. `keys` gives those of a whole table.

JSON Schema (draft 2020-12) cannot say all that `read` checks: what holds between several keys, that 1.0 is no whole
number, NaN.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from math import inf
from types import MappingProxyType, NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from mjnav.errors import InvalidValue, unknown_name
from mjnav.settings.marks import Beside, Key, Length, Named, Variants, bare, mark, options
from mjnav.settings.scalars import Boolean, Number, Schema, String, ValueType

T = TypeVar("T")
TomlTable = dict[str, Any]
_MAX_DEPTH = 20  # of tables and arrays in one another; the deepest that a run file needs is 5

# --------------------------------------------------------------------------- types of arrays and tables


class AnyValue(ValueType):
    """Any value, also of a type that no file has."""

    def write(self, value: Any) -> Any:
        """See `ValueType`."""
        return tables(value)


class AnyTable(AnyValue):
    """A table of any keys, which becomes a dict; the base of all tables."""

    name = "table"
    words = "a table", "tables"

    def read(self, value: Any) -> Any:
        """See `ValueType`."""
        return dict(self._of_type(Mapping, value))

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        return {"type": "object"}


class Array(AnyValue):
    """An array, which becomes a tuple: of any number of equal items, or of some items one after the other."""

    def __init__(self, hint: Any):
        hints, self._length = get_args(bare(hint)), mark(hint, Length)
        self._is_open = hints[-1] is Ellipsis
        self._items = [value_type(item) for item in hints if item is not Ellipsis]
        self._count = "" if self._is_open else f"{len(self._items)} "
        units = [item.unit for item in self._items]
        self.unit = units[0] if len(set(units)) == 1 else ", ".join(units)
        each = ", ".join(dict.fromkeys(item.allowed.removeprefix("each ") for item in self._items))
        parts = ("" if self._length is None else str(self._length), f"each {each}" if each else "")
        self.allowed = "; ".join(filter(None, parts))

    def read(self, value: Any) -> tuple:
        """See `ValueType`."""
        value = value.tolist() if hasattr(value, "tolist") else value  # of NumPy
        if not isinstance(value, list | tuple) or not (self._is_open or len(value) == len(self._items)):
            raise InvalidValue("", value, self.describe())
        if self._length is not None and not self._length.low <= len(value) <= self._length.high:
            raise InvalidValue("", f"{len(value)} of them" if value else [], str(self._length))
        types = self._items * len(value) if self._is_open else self._items
        items = []
        for i, (item_type, item) in enumerate(zip(types, value, strict=True)):
            with below(str(i)):
                items.append(item_type.read(item))
        return tuple(items)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        items = [item.schema(definitions) for item in self._items]
        same = {"items": items[0]} if all(item == items[0] for item in items) else {"prefixItems": items}
        if not self._is_open:
            return {"type": "array", **same, "minItems": len(items), "maxItems": len(items)}
        length = self._length
        return {"type": "array", **same} | ({} if length is None else {"minItems": length.low, "maxItems": length.high})

    def describe(self, many: bool = False) -> str:
        """See `ValueType`."""
        return f"{'arrays' if many else 'an array'} of {self._count}{self._items[0].describe(many=True)}"

    def full_name(self, many: bool = False) -> str:
        """See `ValueType`."""
        return f"{'arrays' if many else 'array'} of {self._count}{self._items[0].full_name(many=True)}"

    def inner_tables(self) -> Iterator[tuple[bool, Any]]:
        """See `ValueType`."""
        if self._is_open and isinstance(self._items[0], Table):
            yield True, self._items[0].cls


class Union(AnyValue):
    """One of several types: tables for dataclasses, arrays for tuples, all else for the others."""

    def __init__(self, hint: Any):
        self._types = [value_type(option) for option in options(hint)]
        self._is_optional = NoneType in get_args(bare(hint))
        self.unit = next((one.unit for one in self._types if one.unit), "")
        self.allowed = "; or ".join(dict.fromkeys(one.allowed for one in self._types if one.allowed))

    def read(self, value: Any) -> Any:
        """See `ValueType`. What it refuses, it refuses as the last of the types that fit does."""
        if value is None and self._is_optional:
            return None
        is_table, is_array = isinstance(value, dict) or is_dataclass(value), isinstance(value, list | tuple)
        fitting = [one for one in self._types if isinstance(one, Table) == is_table] or self._types
        *first, last = [one for one in fitting if isinstance(one, Array) == is_array] or fitting
        for one in first:
            with suppress(InvalidValue):
                return one.read(value)
        return last.read(value)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        schemas = [one.schema(definitions) for one in self._types]
        return schemas[0] if len(schemas) == 1 else {"anyOf": schemas}

    def describe(self, many: bool = False) -> str:
        """See `ValueType`."""
        return self._types[0].describe(many)

    def full_name(self, many: bool = False) -> str:
        """See `ValueType`."""
        return " or ".join(dict.fromkeys(one.full_name(many) for one in self._types))

    def inner_tables(self) -> Iterator[tuple[bool, Any]]:
        """See `ValueType`."""
        for one in self._types:
            yield from one.inner_tables()


class Table(AnyTable):
    """A table, which becomes a dataclass."""

    def __init__(self, cls: Any):
        self.cls = cls

    def read(self, value: Any) -> Any:
        """See `ValueType`."""
        return read(self.cls, value) if isinstance(value, Mapping) else self._of_type(self.cls, value)

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        name = self.cls.__name__
        if name not in definitions:
            definitions[name] = {}  # keeps its place before those that it contains
            definitions[name] = table_schema(self.cls, definitions)
        return {"$ref": f"#/$defs/{name}"}

    def inner_tables(self) -> Iterator[tuple[bool, Any]]:
        """See `ValueType`."""
        yield False, self.cls


class Variant(AnyTable):
    """A table that becomes one of several dataclasses, by the name under its key."""

    def __init__(self, variants: Variants, description: str):
        self.variants, self.description = variants, description

    def read(self, value: Any) -> Any:
        """See `ValueType`."""
        other = self.variants.other
        if isinstance(value, (*self.variants.kinds.values(), *([other] if other else []))):
            return value
        if other is not None and not isinstance(value, Mapping) and other.serves(value):
            return other.of(value)
        return self.read_beside(self._of_type(Mapping, value), ())

    def read_beside(self, table: Mapping[str, Any], others: Iterable[str]) -> Any:
        """See `ValueType`."""
        key, kinds, other = self.variants.key, self.variants.kinds, self.variants.other
        name, rest = table.get(key), {one: value for one, value in table.items() if one != key}
        if name is None:
            _check_known(rest, {*others, key, *(one for kind in kinds.values() for one in keys(kind))})
            raise InvalidValue(key, None, f"{', '.join(sorted(kinds))}; this key is required")
        if isinstance(name, str) and name in kinds:
            _check_known(rest, {*others, key, *keys(kinds[name])})
            return read(kinds[name], rest)
        if other is not None and other.serves(name):
            return other(name, rest)
        raise unknown_name(key, name, kinds)

    def write(self, value: Any) -> TomlTable:
        """See `ValueType`."""
        variants = self.variants
        if variants.other is not None and isinstance(value, variants.other):
            return {variants.key: value.name, **tables(value.parameters)}
        name = next(name for name, kind in variants.kinds.items() if type(value) is kind)
        return {variants.key: name, **tables(value)}

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        name = self.variants.key.capitalize()
        if name not in definitions:
            definitions[name] = self.schema_beside({"type": "object", "properties": {}}, definitions)
        return {"$ref": f"#/$defs/{name}"}

    def schema_beside(self, owner: Schema, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        kinds = {name: table_schema(kind, definitions) for name, kind in self.variants.kinds.items()}
        return with_variants(owner, self.variants.key, kinds, open_end=self.variants.other is not None)


class NamedValues(AnyTable):
    """A table of values that are all of one type, under some of several names."""

    def __init__(self, named: Named, hint: Any):
        self.named, self.item = named, value_type(get_args(bare(hint))[1])

    def read(self, value: Any) -> TomlTable:
        """See `ValueType`."""
        return self.read_beside(self._of_type(Mapping, value), ())

    def read_beside(self, table: Mapping[str, Any], others: Iterable[str]) -> TomlTable:
        """See `ValueType`."""
        return dict(self._read_below("", table, others))

    def _read_below(
        self, prefix: str, table: Mapping[str, Any], others: Iterable[str] = ()
    ) -> Iterator[tuple[str, Any]]:
        for key, value in table.items():
            with below(key):
                name = f"{prefix}{key}"
                if name in self.named.names:
                    yield name, self.item.read(value)
                elif any(other.startswith(f"{name}.") for other in self.named.names):
                    yield from self._read_below(f"{name}.", self._of_type(Mapping, value))
                else:
                    raise unknown_name("", name, [*others, *self.named.names])

    def write(self, value: Any) -> TomlTable:
        """See `ValueType`."""
        written: TomlTable = {}
        for name, item in value.items():
            *groups, last = name.split(".")
            inner = written
            for group in groups:
                inner = inner.setdefault(group, {})
            inner[last] = self.item.write(item)
        return written

    def schema(self, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        return self.schema_beside({"type": "object", "properties": {}}, definitions)

    def schema_beside(self, owner: Schema, definitions: dict[str, Schema]) -> Schema:
        """See `ValueType`."""
        item = self.item.schema(definitions)
        for name in self.named.names:
            *groups, last = name.split(".")
            inner = owner["properties"]
            for group in groups:
                table = inner.setdefault(group, {"type": "object", "properties": {}, "additionalProperties": False})
                inner = table["properties"]
            inner[last] = item
        return {**owner, "additionalProperties": False}


def value_type(hint: Any) -> ValueType:
    """The type of the values of a field. A type that no file has is that of any value."""
    kind = bare(hint)
    variants, named = mark(hint, Variants), mark(hint, Named)
    if variants is not None:
        return Variant(variants, mark(hint, str) or "")
    if options(hint):
        return Union(hint)
    if kind in (float, int):
        return Number(hint)
    if kind is bool:
        return Boolean()
    if kind is str:
        return String(hint)
    if get_origin(kind) is tuple:
        return Array(hint)
    if named is not None:
        return NamedValues(named, hint)
    if get_origin(kind) is Mapping:
        return AnyTable()
    return Table(kind) if is_dataclass(kind) else AnyValue()


# -------------------------------------------------------------------------------------- whole tables


@dataclass(frozen=True, slots=True)
class FieldKey:
    """A field as a file has it; `default` is MISSING where the key is required."""

    name: str  # of the field
    hint: Any
    type: ValueType
    default: Any
    beside: bool
    description: str


@cache
def keys(cls: Any) -> Mapping[str, FieldKey]:
    """The keys of a table that becomes a `cls`. A field that is not compared, or not an argument, is not in a file."""
    hints, by_key = get_type_hints(cls, include_extras=True), {}
    for field in fields(cls):
        if field.compare and field.init:
            hint = hints[field.name]
            alias = mark(hint, Key)
            default = field.default if field.default_factory is MISSING else field.default_factory()
            by_key[alias.name if alias else field.name] = FieldKey(
                field.name, hint, value_type(hint), default, mark(hint, Beside) is not None, mark(hint, str) or ""
            )
    return MappingProxyType(by_key)


@cache
def _parts(cls: Any) -> tuple[Mapping[str, FieldKey], FieldKey | None]:
    """The keys that a table has under their names, and the field whose keys stand beside them, if any."""
    plain = {key: field for key, field in keys(cls).items() if not field.beside}
    return MappingProxyType(plain), next((field for field in keys(cls).values() if field.beside), None)


def read_document(cls: type[T], document: TomlTable) -> T:
    """The dataclass that a whole file describes, its `schema` before all else. Raises InvalidValue as `read` does."""
    _check_document(document)
    if "schema" not in document:
        raise InvalidValue("schema", None, "schema = 1, the version of this format")
    with below("schema"):
        keys(cls)["schema"].type.read(document["schema"])
    return read(cls, document)


def read(cls: type[T], table: Mapping[str, Any]) -> T:
    """The dataclass that a table describes.

    Where the class has `dependent_defaults`, that gives defaults which follow from the other arguments. Raises
    InvalidValue with the dotted key of what is unknown, missing, of the wrong type or out of range.
    """
    plain, beside = _parts(cls)
    rest = {key: value for key, value in table.items() if key not in plain}
    arguments: dict[str, Any] = {}
    if beside is not None:
        arguments[beside.name] = beside.type.read_beside(rest, plain)
    else:
        _check_known(rest, plain)
    for key, field in plain.items():
        if key in table:
            with below(key):
                arguments[field.name] = field.type.read(table[key])
        elif field.default is MISSING:
            raise InvalidValue(key, None, f"{field.type.describe()}; this key is required")
    if hasattr(cls, "dependent_defaults"):
        arguments = {**cls.dependent_defaults(arguments), **arguments}  # type: ignore[attr-defined]
    return cls(**arguments)


def settle(instance: Any) -> None:
    """Checks every field of a frozen dataclass and stores it as its type has it; for `__post_init__`.

    Raises InvalidValue with the key.
    """
    for key, field in keys(type(instance)).items():
        with below("" if field.beside else key):
            object.__setattr__(instance, field.name, field.type.read(getattr(instance, field.name)))


class Settled:
    """A dataclass that checks itself: each field by its type, then by `_check` what lies between them."""

    __slots__ = ()

    def __post_init__(self) -> None:
        settle(self)
        self._check()

    def _check(self) -> None:
        """Raises InvalidValue with the key."""


def settled(hint: Any, value: Any) -> Any:
    """`value` as the type `hint` has it: a whole number serves as a number, a list as a tuple, a table as a dataclass.

    Of types that no file has, values stay as they are. Raises InvalidValue; its key is the place inside the value.
    """
    return value_type(hint).read(value)


def tables(value: Any) -> Any:
    """The table of a dataclass that `read` takes, every default explicit; a tuple becomes a list."""
    if is_dataclass(value):
        table: TomlTable = {}
        for key, field in keys(type(value)).items():
            item = getattr(value, field.name)
            if field.beside:
                table |= field.type.write(item)
            elif item is not None:
                table[key] = field.type.write(item)
        return table
    if isinstance(value, Mapping):
        return {key: tables(item) for key, item in value.items()}
    return [tables(item) for item in value] if isinstance(value, list | tuple) else value


def _check_known(table: Iterable[str], known: Iterable[str]) -> None:
    for key in table:
        if key not in known:
            raise unknown_name(shown_key(key), key, known)


def _check_document(value: object, depth: int = 0) -> None:
    """Refuses what TOML readers let through: whole numbers of more than 64 bits, and nesting without end."""
    if depth > _MAX_DEPTH:
        raise InvalidValue("", "...", f"tables and arrays in one another at most {_MAX_DEPTH} deep")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise InvalidValue("", value, "whole numbers of at most 64 bits")
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            with below(str(key)):
                _check_document(item, depth + 1)


def shown_key(key: str) -> str:
    """The key as TOML writes it, quoted unless it is a bare one."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


class below:  # a word of a sentence in small letters; a generator as a context manager takes thrice the time
    """Errors from inside carry `keys`, one in the other, in front of theirs, and name the `file`."""

    __slots__ = ("_file", "_keys")

    def __init__(self, *keys: str, file: str | None = None):
        self._keys, self._file = keys, file

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, InvalidValue):
            prefix = ".".join(shown_key(key) for key in self._keys if key)
            raise error.within(prefix, file=self._file) from None


# ---------------------------------------------------------------------------------------- JSON Schema


def json_schema(cls: Any) -> Schema:
    """The schema of a whole file that becomes a `cls`; each class of tables in it has an entry under `$defs`."""
    definitions: dict[str, Schema] = {}
    root = table_schema(cls, definitions)
    root["required"] = sorted({"schema", *root["required"]})
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **root, "$defs": definitions}


def table_schema(cls: Any, definitions: dict[str, Schema], defaults: Any = None) -> Schema:
    """The schema of a table that becomes a `cls`; `defaults` is an instance whose values stand for the class's own."""
    schema: Schema = {"type": "object", "description": first_line(cls), "properties": {}, "required": []}
    beside = None
    for key, field in keys(cls).items():
        if field.beside:
            beside = field
            continue
        default = field.default if defaults is None else getattr(defaults, field.name)
        schema["properties"][key] = _property(field, default, definitions)
        if default is MISSING:
            schema["required"].append(key)
    if beside is None:
        return {**schema, "additionalProperties": False}
    return beside.type.schema_beside(schema, definitions)


def _property(field: FieldKey, default: Any, definitions: dict[str, Schema]) -> Schema:
    schema = field.type.schema(definitions)
    unit = f" [{field.type.unit}]" if field.type.unit else ""
    if field.description or unit:
        schema["description"] = f"{field.description}{unit}".strip()
    shown = tables(default) if default is not MISSING else None
    if shown is not None and shown != inf and not isinstance(shown, dict):
        schema["default"] = shown
    return schema


def with_variants(
    schema: Schema, key: str, kinds: Mapping[str, Schema], *, default: str | None = None, open_end: bool = False
) -> Schema:
    """A table with the keys of one of several others, whose name stands under `key`; `default` where it does not.

    With an `open_end`, a plug-in's name may stand there too, with any keys beside it.
    """
    text = "\n".join(f"{name}: {kind['description']}" for name, kind in kinds.items())
    names = [{"enum": list(kinds)}, *([{"pattern": ":"}] if open_end else [])]
    name = {"type": "string", "description": text, **({"anyOf": names} if open_end else names[0])}
    branches: list[Schema] = [
        {
            "properties": {key: {"const": name}, **kind["properties"]},
            "required": [*([key] if name != default else []), *kind["required"]],
        }
        for name, kind in kinds.items()
    ]
    if open_end:
        branches.append({"properties": {key: {"pattern": ":"}}, "required": [key], "additionalProperties": True})
    properties = {**schema["properties"], key: {**name, **schema["properties"].get(key, {})}}
    return {**schema, "properties": properties, "anyOf": branches, "unevaluatedProperties": False}


def first_line(cls: Any) -> str:
    """Of its docstring, without markup."""
    return (cls.__doc__ or "").strip().partition("\n")[0].replace("`", "")
