"""JSON Schema (draft 2020-12) of the tables that `read` takes: for editors, and for programs that are not ours.

What a schema cannot say is left to `read`: what holds between several keys, that 1.0 is no whole number, NaN.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import MISSING, is_dataclass
from math import inf
from types import MappingProxyType
from typing import Any, get_args, get_origin

from mjnav.config.marks import Choice, FieldKey, Length, Named, Range, Text, Variants, bare, keys, mark, options
from mjnav.config.writing import tables

Schema = dict[str, Any]
_LARGEST = sys.float_info.max
_TYPES = MappingProxyType({float: "number", int: "integer", bool: "boolean", str: "string"})


def json_schema(cls: Any) -> Schema:
    """The schema of a whole file that becomes a `cls`; each class of tables in it has an entry under `$defs`."""
    definitions: dict[str, Schema] = {}
    root = table_schema(cls, definitions)
    root["required"] = sorted({"schema", *root["required"]})
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **root, "$defs": definitions}


def table_schema(cls: Any, definitions: dict[str, Schema], defaults: Any = None) -> Schema:
    """The schema of a table that becomes a `cls`; `defaults` is an instance whose values stand for the class's own."""
    first_line = (cls.__doc__ or "").strip().partition("\n")[0]
    schema: Schema = {"type": "object", "description": first_line, "properties": {}, "required": []}
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
    return _with_keys_beside(schema, beside.hint, definitions)


def with_variants(schema: Schema, key: str, kinds: Mapping[str, Schema], default: str | None = None) -> Schema:
    """A table with the keys of one of several others, whose name stands under `key`; `default` where it does not."""
    own, found = schema["properties"], {}
    for kind in kinds.values():
        for name, one in kind["properties"].items():
            found.setdefault(name, []).append(one)
    # Of a key that differs between the variants, what they have in common; the rest stands in their rules.
    shared = {
        name: {word: value for word, value in ones[0].items() if all(one.get(word) == value for one in ones)}
        for name, ones in found.items()
    }
    rules = []
    for name, kind in kinds.items():
        condition: Schema = {"properties": {key: {"const": name}}} | ({"required": [key]} if name != default else {})
        differing = {k: one for k, one in kind["properties"].items() if one != shared[k]}
        then = {
            "propertyNames": {"enum": sorted({key, *own, *kind["properties"]})},
            **({"properties": differing} if differing else {}),
            **({"required": kind["required"]} if kind["required"] else {}),
        }
        rules.append({"if": condition, "then": then})
    return {**schema, "properties": {**own, **shared}, "allOf": rules}


def partial(schema: Schema, name: str, leaf: Callable[[Schema], Schema]) -> Schema:
    """The schema of some of a file's keys, by tables in one another: nothing is required, an array takes indices.

    What no table is becomes `leaf` of it. Definitions get `name` behind theirs.
    """

    def below(part: Schema) -> Schema:
        if "$ref" in part:
            return {**part, "$ref": f"{part['$ref']} {name}"}
        if "properties" in part:
            kept = {key: part[key] for key in ("type", "description", "additionalProperties") if key in part}
            inner = {key: below(one) for key, one in part["properties"].items()}
            return {**kept, "properties": inner, "patternProperties": {"\\.": True}}  # dotted keys in quotes
        if part.get("type") == "array" and isinstance(part.get("items"), dict):
            indexed = {"type": "object", "patternProperties": {"^[0-9]+(\\.|$)": True}, "additionalProperties": False}
            return {"description": part.get("description", ""), "anyOf": [leaf(part), indexed]}
        return leaf({key: value for key, value in part.items() if key != "default"})

    return {
        **below({key: value for key, value in schema.items() if key not in ("$schema", "$defs")}),
        "$defs": {f"{key} {name}": below(one) for key, one in schema["$defs"].items()},
    }


def _property(field: FieldKey, default: Any, definitions: dict[str, Schema]) -> Schema:
    schema = _value_schema(field.hint, definitions)
    limits = next(filter(None, (mark(hint, Range) for hint in (field.hint, *options(field.hint)))), None)
    unit = f" [{limits.unit}]" if limits is not None and limits.unit else ""
    if field.description or unit:
        schema["description"] = f"{field.description}{unit}".strip()
    shown = tables(default) if default is not MISSING else None
    if shown is not None and shown != inf and not isinstance(shown, dict):
        schema["default"] = shown
    return schema


def _value_schema(hint: Any, definitions: dict[str, Schema]) -> Schema:
    kind = bare(hint)
    alternatives = [_value_schema(option, definitions) for option in options(hint)]
    if alternatives:
        return alternatives[0] if len(alternatives) == 1 else {"anyOf": alternatives}
    if kind in _TYPES:
        return {"type": _TYPES[kind], **_limits(hint)}
    if get_origin(kind) is tuple:
        return _array_schema(hint, definitions)
    variants = mark(hint, Variants)
    if variants is not None:
        return _reference(kind, definitions, lambda: _variants_schema({"type": "object"}, variants, definitions))
    if is_dataclass(kind):
        return _reference(kind, definitions, lambda: table_schema(kind, definitions))
    return {"type": "object"}


def _reference(kind: Any, definitions: dict[str, Schema], make: Callable[[], Schema]) -> Schema:
    if kind.__name__ not in definitions:
        definitions[kind.__name__] = {}  # keeps its place before those that it contains
        definitions[kind.__name__] = make()
    return {"$ref": f"#/$defs/{kind.__name__}"}


def _limits(hint: Any) -> Schema:
    limits, choice, text = mark(hint, Range), mark(hint, Choice), mark(hint, Text)
    if choice is not None:
        return {"enum": list(choice.names)}
    if text is not None:
        return {"pattern": f"^{text.pattern}$", "maxLength": text.longest}
    if limits is None:
        return {}
    low = {"exclusiveMinimum" if limits.open_low else "minimum": limits.low}
    high = {"exclusiveMaximum" if limits.open_high else "maximum": limits.high}
    if limits.or_inf:  # which JSON cannot write, but compare with
        return {**low, "anyOf": [high, {"exclusiveMinimum": _LARGEST}]}
    return {**low, **high}


def _array_schema(hint: Any, definitions: dict[str, Schema]) -> Schema:
    hints, length = get_args(bare(hint)), mark(hint, Length)
    if hints[-1] is Ellipsis:
        schema: Schema = {"type": "array", "items": _value_schema(hints[0], definitions)}
        return schema if length is None else {**schema, "minItems": length.low, "maxItems": length.high}
    items = [_value_schema(one, definitions) for one in hints]
    same = all(item == items[0] for item in items)
    return {
        "type": "array",
        **({"items": items[0]} if same else {"prefixItems": items}),
        "minItems": len(items),
        "maxItems": len(items),
    }


def _with_keys_beside(schema: Schema, hint: Any, definitions: dict[str, Schema]) -> Schema:
    variants, named = mark(hint, Variants), mark(hint, Named)
    if variants is not None:
        return _variants_schema(schema, variants, definitions)
    if named is None:
        return schema  # any keys
    item = _value_schema(get_args(bare(hint))[1], definitions)
    for name in named.names:
        *groups, last = name.split(".")
        inner = schema["properties"]
        for group in groups:
            table = inner.setdefault(group, {"type": "object", "properties": {}, "additionalProperties": False})
            inner = table["properties"]
        inner[last] = item
    return {**schema, "additionalProperties": False}


def _variants_schema(schema: Schema, variants: Variants, definitions: dict[str, Schema]) -> Schema:
    kinds = {name: table_schema(kind, definitions) for name, kind in variants.kinds.items()}
    descriptions = "\n".join(f"{name}: {kind['description']}" for name, kind in kinds.items())
    name = {"type": "string", "enum": list(kinds), "description": descriptions}
    if variants.other is not None:
        name = {"type": "string", "anyOf": [{"enum": list(kinds)}, {"pattern": ":"}], "description": descriptions}
    properties = {**schema.get("properties", {}), variants.key: name}
    required = [*schema.get("required", []), variants.key]
    closed = {**schema, "properties": properties, "required": required}
    if variants.other is None:
        closed["additionalProperties"] = False
    return with_variants(closed, variants.key, kinds)
