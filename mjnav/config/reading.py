"""Values as their fields' types have them, from Python or from the tables of a file."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import MISSING, is_dataclass
from math import inf
from numbers import Integral, Real
from typing import Any, TypeVar, get_args, get_origin

from mjnav.config.marks import Choice, Length, Named, Range, Text, Variants, bare, describe, keys, mark, options
from mjnav.errors import InvalidValue, unknown_name

T = TypeVar("T")
TomlTable = dict[str, Any]
_MAX_DEPTH = 20  # of tables and arrays in one another; the deepest that a run file needs is 5


def read_document(cls: type[T], document: TomlTable) -> T:
    """The dataclass that a whole file describes, its `schema` before all else. Raises InvalidValue as `read` does."""
    _check_document(document)
    if "schema" not in document:
        raise InvalidValue("schema", None, "schema = 1, the version of this format")
    with below("schema"):
        settled(keys(cls)["schema"].hint, document["schema"])
    return read(cls, document)


def read(cls: type[T], table: Mapping[str, Any]) -> T:
    """The dataclass that a table describes.

    Where the class has `dependent_defaults`, that gives defaults which follow from the other arguments. Raises
    InvalidValue with the dotted key of what is unknown, missing, of the wrong type or out of range.
    """
    own = {key: field for key, field in keys(cls).items() if not field.beside}
    beside = next((field for field in keys(cls).values() if field.beside), None)
    rest = {key: value for key, value in table.items() if key not in own}
    arguments: dict[str, Any] = {}
    if beside is not None:
        arguments[beside.name] = _read_tables(beside.hint, rest, own)
    else:
        _check_known(rest, own)
    for key, field in own.items():
        if key in table:
            with below(key):
                arguments[field.name] = settled(field.hint, table[key])
        elif field.default is MISSING:
            raise InvalidValue(key, None, f"{describe(field.hint)}; this key is required")
    if hasattr(cls, "dependent_defaults"):
        arguments = {**cls.dependent_defaults(arguments), **arguments}  # type: ignore[attr-defined]
    return cls(**arguments)


def settle(instance: Any) -> None:
    """Checks every field of a frozen dataclass and stores it as its type has it; for `__post_init__`.

    Raises InvalidValue with the key.
    """
    for key, field in keys(type(instance)).items():
        with below("" if field.beside else key):
            object.__setattr__(instance, field.name, settled(field.hint, getattr(instance, field.name)))


def settled(hint: Any, value: Any) -> Any:
    """`value` as the type `hint` has it: a whole number serves as a number, a list as a tuple, a table as a dataclass.

    Of types that no file has, values stay as they are. Raises InvalidValue; its key is the place inside the value.
    """
    kind = bare(hint)
    variants = mark(hint, Variants)
    if variants is not None:
        return _variant(variants, hint, value)
    if alternatives := options(hint):
        return _one_of(alternatives, value, optional=len(alternatives) < len(get_args(kind)))
    if kind in (float, int):
        return _number(hint, value)
    if kind is bool:
        return _of_type(bool, hint, value)
    if kind is str:
        choice, text = mark(hint, Choice), mark(hint, Text)
        string = _of_type(str, hint, value)
        if choice is not None and string not in choice.names:
            raise unknown_name("", string, choice.names)
        if text is not None and string not in text:
            raise InvalidValue("", string, text.allowed)
        return string
    if get_origin(kind) is tuple:
        return _array(hint, value)
    if mark(hint, Named) is not None or get_origin(kind) is Mapping:
        return _read_tables(hint, _of_type(Mapping, hint, value))
    if is_dataclass(kind):
        return read(kind, value) if isinstance(value, Mapping) else _of_type(kind, hint, value)  # type: ignore[arg-type]
    return value


def _variant(variants: Variants, hint: Any, value: Any) -> Any:
    """One of the variants, as it is or from its table."""
    other = variants.other
    if isinstance(value, (*variants.kinds.values(), *([other] if other else []))):
        return value
    if other is not None and not isinstance(value, Mapping) and other.serves(value):
        return other.of(value)
    return _read_tables(hint, _of_type(Mapping, hint, value))


def _one_of(alternatives: tuple[Any, ...], value: Any, *, optional: bool) -> Any:
    """Dataclasses are for tables, tuples for arrays, the other types of a union for all else.

    Refused is what the last of them refuses.
    """
    if value is None and optional:
        return None
    is_table = isinstance(value, dict) or is_dataclass(value)
    fitting = [o for o in alternatives if is_dataclass(bare(o)) == is_table] or alternatives
    is_array = isinstance(value, list | tuple)
    *first, last = [o for o in fitting if (get_origin(bare(o)) is tuple) == is_array] or fitting
    for option in first:
        with suppress(InvalidValue):
            return settled(option, value)
    return settled(last, value)


def _number(hint: Any, value: Any) -> Any:
    kind: Any = bare(hint)
    accepted: Any = Integral if kind is int else Real
    limits = mark(hint, Range)
    if not isinstance(value, accepted) or isinstance(value, bool):
        raise InvalidValue("", value, describe(hint))
    try:
        number = kind(value)
    except OverflowError:  # a whole number beyond the largest float
        number = inf
    if limits is not None and number not in limits:
        raise InvalidValue("", number if abs(number) < inf else value, describe(hint))
    return number


def _array(hint: Any, value: Any) -> tuple:
    value = value.tolist() if hasattr(value, "tolist") else value  # of NumPy
    hints = get_args(bare(hint))
    if isinstance(value, list | tuple) and hints[-1] is Ellipsis:
        hints = hints[:1] * len(value)
    if not isinstance(value, list | tuple) or len(value) != len(hints):
        raise InvalidValue("", value, describe(hint))
    length = mark(hint, Length)
    if length is not None and not length.low <= len(value) <= length.high:
        raise InvalidValue("", f"{len(value)} of them" if value else [], str(length))
    items = []
    for i, (item_hint, item) in enumerate(zip(hints, value, strict=True)):
        with below(str(i)):
            items.append(settled(item_hint, item))
    return tuple(items)


def _of_type(kind: Any, hint: Any, value: Any) -> Any:
    if not isinstance(value, kind):
        raise InvalidValue("", value, describe(hint))
    return value


def _read_tables(hint: Any, table: Mapping[str, Any], others: Iterable[str] = ()) -> Any:
    """What a table holds that is no dataclass's by its type alone; `others` are the keys that may stand beside it."""
    variants, named = mark(hint, Variants), mark(hint, Named)
    if variants is not None:
        return _read_variant(variants, table, others)
    if named is not None:
        return _read_named(named.names, get_args(bare(hint))[1], table, others)
    return dict(table)


def _read_variant(variants: Variants, table: Mapping[str, Any], others: Iterable[str]) -> Any:
    name, kinds = table.get(variants.key), variants.kinds
    if name is None:
        _check_known(table, {*others, variants.key, *(key for kind in kinds.values() for key in keys(kind))})
        raise InvalidValue(variants.key, None, f"{', '.join(sorted(kinds))}; this key is required")
    if not isinstance(name, str) or name not in kinds:
        if variants.other is not None and variants.other.serves(name):
            return variants.other(name, {key: value for key, value in table.items() if key != variants.key})
        raise unknown_name(variants.key, name, kinds)
    _check_known(table, {*others, variants.key, *keys(kinds[name])})
    return read(kinds[name], {key: value for key, value in table.items() if key != variants.key})


def _read_named(names: Iterable[str], hint: Any, table: Mapping[str, Any], others: Iterable[str]) -> TomlTable:
    found: TomlTable = {}

    def descend(prefix: str, inner: Mapping[str, Any]) -> None:
        for key, value in inner.items():
            with below(key):
                name = f"{prefix}{key}"
                if name in names:
                    found[name] = settled(hint, value)
                elif any(other.startswith(f"{name}.") for other in names):
                    descend(f"{name}.", _of_type(Mapping, Mapping, value))
                else:
                    raise unknown_name("", name, [*names] if prefix else [*others, *names])

    descend("", table)
    return found


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


@contextmanager
def below(key: str) -> Iterator[None]:
    """Errors from inside carry `key` in front of theirs."""
    try:
        yield
    except InvalidValue as error:
        raise error.within(shown_key(key)) if key else error from None
