"""`--set KEY=VALUE`: one value of a run file given on the command line."""

import tomllib
from copy import deepcopy
from dataclasses import fields
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.scenarios.people import BEHAVIOURS


def apply(document: dict[str, Any], override: str, defaults: dict[str, Any]) -> str:
    """Sets one value in the tables of a run file, in place, and returns its key.

    The key is dotted, with an index into arrays ("people.0.start.1"). What it leads through is made as needed: an array
    as `defaults`, the same tables with all defaults in them, has it, else a table. The value is TOML, or else a string.
    Setting one of robot.goal and robot.waypoints removes the other; another behaviour of a person removes the keys that
    only other behaviours have. Raises InvalidValue.
    """
    key, equals, text = override.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise InvalidValue("", override, "KEY=VALUE, as in people.0.radius=0.4")
    if not override.isascii() and override != override.encode("utf-8", "replace").decode("utf-8"):
        raise InvalidValue("", override, "text in UTF-8")
    target: Any = document
    default: Any = defaults
    for depth, part in enumerate(parts):
        where = ".".join(parts[: depth + 1])
        if isinstance(target, list):
            step: Any = _index(where, part, target)
            default = default[step] if isinstance(default, list) and step < len(default) else None
        elif isinstance(target, dict):
            step = part
            default = default.get(step) if isinstance(default, dict) else None
            target.setdefault(step, deepcopy(default) if isinstance(default, list) else {})
        else:
            raise InvalidValue(where, target, f"a table or an array in front of .{part}")
        if depth == len(parts) - 1:
            target[step] = _value(text)
        target = target[step]
    _drop_excluded(document, parts)
    return key.strip()


def _index(where: str, part: str, array: list) -> int:
    if part.isascii() and part.isdecimal() and len(part) < 10 and int(part) < len(array):
        return int(part)
    allowed = f"an index from 0 to {len(array) - 1}" if array else "nothing below it: the array is empty"
    raise InvalidValue(where, part, allowed)


def _value(text: str) -> object:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if len(parsed) == 1 else text  # a line break could have begun another key


def _drop_excluded(document: dict[str, Any], parts: list[str]) -> None:
    match parts:
        case ["robot", "goal"]:
            document["robot"].pop("waypoints", None)
        case ["robot", "waypoints"]:
            document["robot"].pop("goal", None)
        case ["people", index, "behaviour"] if isinstance(document["people"], list):
            _drop_other_behaviours(document["people"][int(index)])


def _drop_other_behaviours(person: dict[str, Any]) -> None:
    keys = {name: {item.name for item in fields(behaviour)} for name, behaviour in BEHAVIOURS.items()}
    name = person["behaviour"]
    if isinstance(name, str) and name in keys:
        for key in set().union(*keys.values()) - keys[name]:
            person.pop(key, None)
