"""Every key of a file as a row for people: its type, unit, range, default and meaning, from the marks of its field.

In a key, N stands for an index into an array ("people.N.radius") and, where a table may have some of several names, a
word in capitals stands for one of them ("noise.CHANNEL.std").
"""

from collections.abc import Iterator
from dataclasses import MISSING, dataclass, is_dataclass, replace
from typing import Any

from mjnav.settings.table import FieldKey, NamedValues, Variant, first_line, keys, tables

INDEX = "N"
_PLUGIN = "package.module:Class or file.py:Class"  # whose parameters stand beside it


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
        yield _row(f"{prefix}{key}", field, field.default if defaults is None else getattr(defaults, field.name))
        for in_array, table in field.type.inner_tables():
            yield from key_references(table, f"{prefix}{key}.{INDEX}." if in_array else f"{prefix}{key}.")


def _row(key: str, field: FieldKey, default: Any) -> KeyReference:
    kind, required = field.type, default is MISSING
    shown = None if required or is_dataclass(default) else tables(default)
    description = field.description or next((first_line(table) for _, table in kind.inner_tables()), "")
    return KeyReference(key, kind.full_name(), kind.unit, kind.allowed, shown, required, description)


def _beside(prefix: str, field: FieldKey) -> Iterator[KeyReference]:
    """The keys that stand beside those of a table: of a variant, or under names of which some may be given."""
    kind = field.type
    if isinstance(kind, Variant):
        yield from _variants(prefix, kind)
    elif isinstance(kind, NamedValues):
        key, names = f"{prefix}{kind.named.word}", f"{kind.named.word}: {', '.join(kind.named.names)}"
        yield KeyReference(key, kind.item.full_name(), "", names, None, False, field.description)
        if isinstance(kind.item, Variant):
            yield from _variants(f"{key}.", kind.item)


def _variants(prefix: str, kind: Variant) -> Iterator[KeyReference]:
    """The key that names a variant, and the variants' own."""
    variants = kind.variants
    names = ", ".join([*variants.kinds, *([_PLUGIN] if variants.other is not None else [])])
    yield KeyReference(f"{prefix}{variants.key}", "string", "", names, None, True, kind.description)
    for name, table in variants.kinds.items():
        for row in key_references(table, prefix):
            yield replace(row, where=f"{variants.key} = {name}")
