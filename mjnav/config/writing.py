"""The tables that `read` makes a dataclass of."""

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, get_args

from mjnav.config.marks import Named, Variants, bare, keys, mark


def tables(value: Any, hint: Any = None) -> Any:
    """The table of a dataclass, every default explicit; `hint` is the type of the field that holds it."""
    variants, named = mark(hint, Variants), mark(hint, Named)
    if variants is not None and variants.other is not None and isinstance(value, variants.other):
        return {variants.key: value.name, **tables(value.parameters)}
    if variants is not None:
        name = next(name for name, kind in variants.kinds.items() if type(value) is kind)
        return {variants.key: name, **tables(value)}
    if named is not None:
        return _nested(value, get_args(bare(hint))[1])
    if is_dataclass(value):
        found: dict[str, Any] = {}
        for key, field in keys(type(value)).items():
            item = getattr(value, field.name)
            if field.beside:
                found |= tables(item, field.hint)
            elif item is not None:
                found[key] = tables(item, field.hint)
        return found
    if isinstance(value, Mapping):
        return {key: tables(item) for key, item in value.items()}
    return [tables(item) for item in value] if isinstance(value, list | tuple) else value


def _nested(named: Mapping[str, Any], hint: Any) -> dict[str, Any]:
    """Tables in one another, from names with dots."""
    found: dict[str, Any] = {}
    for name, item in named.items():
        *groups, last = name.split(".")
        inner = found
        for group in groups:
            inner = inner.setdefault(group, {})
        inner[last] = tables(item, hint)
    return found
