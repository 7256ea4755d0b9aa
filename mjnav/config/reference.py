"""Every key of a file as a row for people: its type, unit, range, default and meaning, from the marks of its field.

In a key, N stands for an index into an array ("people.N.radius") and, where a table may have some of several names, a
word in capitals stands for one of them ("noise.CHANNEL.std").
"""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, is_dataclass, replace
from types import MappingProxyType
from typing import Any, get_args, get_origin

from mjnav.config.marks import Choice, FieldKey, Length, Named, Range, Text, Variants, bare, keys, mark, options
from mjnav.config.writing import tables

INDEX = "N"
OWN = "package.module:Class or file.py:Class"  # of a plug-in, whose own keys stand beside it
_TYPES = MappingProxyType({float: "number", int: "integer", bool: "boolean", str: "string"})


@dataclass(frozen=True, slots=True)
class KeyReference:
    """One key of a file."""

    key: str  # dotted
    type: str  # number, integer, boolean, string, table, array of 2 numbers, ...
    unit: str
    allowed: str  # range, names or length; empty where every value of the type is allowed
    default: Any  # as the file would have it; None where the key has none
    required: bool  # in its table
    description: str
    where: str = ""  # the choice under which the key exists: behaviour = waypoints


def key_references(cls: Any, prefix: str = "", *, defaults: Any = None) -> Iterator[KeyReference]:
    """A row for each key of a table that becomes a `cls`, tables before the keys in them.

    `defaults` is an instance whose values stand for the class's own.
    """
    for key, field in keys(cls).items():
        if field.beside:
            yield from _beside(prefix, field)
            continue
        default = field.default if defaults is None else getattr(defaults, field.name)
        row = _row(f"{prefix}{key}", field, default)
        yield row
        yield from _below(row.key, field.hint)


def first_line(cls: Any) -> str:
    """Of its docstring, without markup."""
    return (cls.__doc__ or "").strip().partition("\n")[0].replace("`", "")


def _row(key: str, field: FieldKey, default: Any) -> KeyReference:
    required = default is MISSING
    shown = None if required or is_dataclass(default) else tables(default)
    description = field.description
    if not description and (table := _table_of(field.hint)) is not None:
        description = first_line(table)
    return KeyReference(
        key, type_name(field.hint), _unit(field.hint), _allowed(field.hint), shown, required, description
    )


def _below(key: str, hint: Any) -> Iterator[KeyReference]:
    """The keys of the table, or of the tables of the array, that a value may be."""
    for one in options(hint) or (hint,):
        table = _table_of(one)
        if table is not None:
            is_array = get_origin(bare(one)) is tuple
            yield from key_references(table, f"{key}.{INDEX}." if is_array else f"{key}.")


def _beside(prefix: str, field: FieldKey) -> Iterator[KeyReference]:
    """The keys that stand beside those of a table: of a variant, or under names of which some may be given."""
    variants, named = mark(field.hint, Variants), mark(field.hint, Named)
    if variants is not None:
        yield from _variants(prefix, field.hint, variants)
    elif named is not None:
        key, item = f"{prefix}{named.word}", get_args(bare(field.hint))[1]
        names = f"{named.word}: {', '.join(named.names)}"
        yield KeyReference(key, type_name(item), "", names, None, False, field.description)
        if (inner := mark(item, Variants)) is not None:
            yield from _variants(f"{key}.", item, inner)


def _variants(prefix: str, hint: Any, variants: Variants) -> Iterator[KeyReference]:
    names = ", ".join(variants.kinds)
    if variants.other is not None:
        names += f", {OWN}"
    yield KeyReference(f"{prefix}{variants.key}", "string", "", names, None, True, mark(hint, str) or "")
    for name, kind in variants.kinds.items():
        for row in key_references(kind, prefix):
            yield replace(row, where=f"{variants.key} = {name}")


def _table_of(hint: Any) -> Any:
    """The dataclass that a value, one of its alternatives or an item of it becomes; None where none does."""
    for one in options(hint) or (hint,):
        kind = bare(one)
        if get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis:
            kind = bare(get_args(kind)[0])
        if is_dataclass(kind):
            return kind
    return None


def type_name(hint: Any, *, many: bool = False) -> str:
    """A type in words: number, array of 2 numbers, table."""
    kind = bare(hint)
    if alternatives := options(hint):
        names = dict.fromkeys(type_name(one, many=many) for one in alternatives)
        return " or ".join(names)
    if kind in _TYPES:
        return _TYPES[kind] + "s" * many
    if get_origin(kind) is tuple:
        first, *rest = get_args(kind)
        count = "" if rest == [Ellipsis] else f"{len(rest) + 1} "
        return f"{'arrays' if many else 'array'} of {count}{type_name(first, many=True)}"
    return "tables" if many else "table"


def _unit(hint: Any) -> str:
    """Of a number, or of the numbers of an array: one where all have the same."""
    kind = bare(hint)
    if alternatives := options(hint):
        return next(filter(None, map(_unit, alternatives)), "")
    if get_origin(kind) is tuple:
        units = [_unit(one) for one in get_args(kind) if one is not Ellipsis]
        return units[0] if len(set(units)) == 1 else ", ".join(units)
    limits = mark(hint, Range)
    return limits.unit if limits is not None else ""


def _allowed(hint: Any) -> str:
    kind, limits, choice = bare(hint), mark(hint, Range), mark(hint, Choice)
    if alternatives := options(hint):
        return "; or ".join(dict.fromkeys(filter(None, map(_allowed, alternatives))))
    if choice is not None:
        return ", ".join(choice.names)
    if (text := mark(hint, Text)) is not None:
        return text.allowed
    if limits is not None:
        return str(replace(limits, unit=""))
    if get_origin(kind) is tuple:
        length = mark(hint, Length)
        items = dict.fromkeys(_allowed(one).removeprefix("each ") for one in get_args(kind) if one is not Ellipsis)
        each = "" if items == {"": None} else f"each {', '.join(items)}"
        return "; ".join(filter(None, (str(length) if length is not None else "", each)))
    return ""
