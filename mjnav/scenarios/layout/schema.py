"""Random scenes in the JSON Schema and in the reference of keys."""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from typing import Any

from mjnav.config.reference import INDEX, KeyReference, key_references
from mjnav.config.schema import Schema, table_schema
from mjnav.scenarios.layout.draws import InArea, Normal, OneOf, Uniform
from mjnav.scenarios.layout.entries import KINDS, DrawnRobot

WHERE = "random scenes"
_VALUES = {"Uniform": Uniform, "Normal": Normal, "OneOf": OneOf, "InArea": InArea}
_SHARES = {"type": "object", "minProperties": 1, "additionalProperties": {"type": "number", "minimum": 0}}
_ARRAY = {"type": "array", "contains": {"type": "object"}, "description": "an array with draws among its items"}


def with_draws(schema: Schema) -> Schema:
    """The schema of a run file whose robot and arrays of bodies may be drafts, too."""
    schema = deepcopy(schema)
    definitions = schema["$defs"]
    for name, kind in _VALUES.items():
        definitions[name] = table_schema(kind, definitions)
    definitions["OneOf"]["properties"]["one_of"]["items"] = {}
    definitions["Draw"] = {"anyOf": [*({"$ref": f"#/$defs/{name}"} for name in _VALUES), _ARRAY]}
    definitions["DrawOrShares"] = {"anyOf": [{"$ref": "#/$defs/Draw"}, _SHARES]}
    for name, kind in KINDS.items():
        plain, drawn = kind.plain.__name__, f"Drawn{kind.plain.__name__}"
        definitions[drawn] = _draft(definitions[plain], table_schema(kind.drawn, definitions))
        array = schema["properties"][name]
        array["items"] = {"anyOf": [array["items"], {"$ref": f"#/$defs/{drawn}"}]}
    robot, own = definitions["Robot"], table_schema(DrawnRobot, definitions)
    robot["properties"] = {**_drawable(robot["properties"], "Draw"), **own["properties"]}
    robot["properties"]["start_heading"] = _drawable(own["properties"], "Draw")["start_heading"]
    robot["required"] = [key for key in robot["required"] if key != "start"]
    robot["anyOf"] = [{"required": ["start"]}, {"required": ["start_area"]}]
    return schema


def draft_keys(rows: list[KeyReference]) -> Iterator[KeyReference]:
    """The rows of a run file's keys, with those of random scenes behind the others of their table."""
    own = {f"{name}.{INDEX}.": kind.drawn for name, kind in KINDS.items()} | {"robot.": DrawnRobot}
    for i, row in enumerate(rows):
        yield row
        following = rows[i + 1].key if i + 1 < len(rows) else ""
        for prefix, kind in own.items():
            if row.key.startswith(prefix) and not following.startswith(prefix):
                yield from (replace(one, where=WHERE) for one in key_references(kind, prefix))


def _draft(plain: Schema, drawn: Schema) -> Schema:
    """An entry that draws: any value of a plain one may be drawn, and only its number is required."""
    required = [key for key in ("behaviour",) if key in plain["properties"]]
    numbers = {key: value for key, value in drawn["properties"].items() if value.get("type") == "number"}
    draft: Schema = {
        "type": "object",
        "description": f"Some of these, drawn by the seed of the layout. {plain['description']}",
        "properties": {
            **_drawable(plain["properties"], "DrawOrShares"),
            **drawn["properties"],
            **_drawable(numbers, "Draw"),
        },
        "required": ["count", *required],
    }
    return draft if required else {**draft, "additionalProperties": False}  # a person's may be a plug-in's


def _drawable(properties: dict[str, Any], draw: str) -> dict[str, Any]:
    found = {}
    for key, schema in properties.items():
        kept = {word: schema[word] for word in ("description", "default") if word in schema}
        value = {word: item for word, item in schema.items() if word not in kept}
        found[key] = {**kept, "anyOf": [value, {"$ref": f"#/$defs/{draw}"}]}
    return found
