"""Values that take the place of a run file's: typed by dotted key, or KEY=VALUE on the command line."""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from inspect import isclass, isroutine
from typing import Any

from mjnav import settings
from mjnav.errors import InvalidValue
from mjnav.noise.profiles import DISTRIBUTIONS
from mjnav.scene.people import BEHAVIOURS, Person
from mjnav.scene.prediction import MODELS, Prediction
from mjnav.scene.toml import value_text
from mjnav.settings.plugins import KINDS, Given


@dataclass(frozen=True, slots=True)
class Override:
    """One value at a dotted key, with indices into arrays ("people.0.start.1"); `option` names it in messages."""

    key: str
    value: object
    option: str = "overrides"


_ALLOWED = "values by dotted key, {'people.0.radius': 0.4}, or a list of KEY=VALUE"
Overrides = Mapping[str, object] | Sequence[str | Override]


def overrides_of(given: Overrides) -> Iterator[Override]:
    """The overrides, in order. Raises InvalidValue for what is none, and for a text that is not KEY=VALUE."""
    if not isinstance(given, Iterable) or isinstance(given, str | bytes):
        raise InvalidValue("", given, _ALLOWED, file="overrides")
    for one in [Override(*item) for item in given.items()] if isinstance(given, Mapping) else given:
        if isinstance(one, str):
            yield _parsed(one)
        elif isinstance(one, Override) and isinstance(one.key, str):
            yield one
        else:
            raise InvalidValue("", getattr(one, "key", one), _ALLOWED, file="overrides")


def _parsed(text: str) -> Override:
    """The override that KEY=VALUE says: the value is TOML, or else a string."""
    key, equals, value = text.partition("=")
    if not equals or not all(key.strip().split(".")):
        raise InvalidValue("", text, "KEY=VALUE, as in people.0.radius=0.4", file="overrides")
    if text != text.encode("utf-8", "replace").decode("utf-8"):
        raise InvalidValue("", text, "text in UTF-8", file="overrides")
    return Override(key.strip(), _value(value))


def override_text(key: str, value: object) -> str:
    """KEY=VALUE that is read back as this value; of a value that TOML does not have, Python's text for it."""
    value = _document(value)
    if isinstance(value, str) and _value(value) == value:
        return f"{key}={value}"
    try:
        return f"{key}={value_text(value)}"
    except TypeError:
        return f"{key}={value}"


def apply(document: dict[str, Any], override: Override, defaults: dict[str, Any]) -> None:
    """Sets one value in the tables of a run file, in place.

    What its key leads through is made as needed: an array as `defaults`, the same tables with all defaults in them, has
    it, else a table. Setting one of robot.goal and robot.waypoints removes the other; another behaviour of a person
    or model of prediction removes the keys that only other behaviours or models have. Raises InvalidValue.
    """
    parts = override.key.split(".")
    if not all(parts):
        raise InvalidValue("", override.key, "a dotted key, as in people.0.radius")
    target: Any = document
    default: Any = defaults
    before: Any = None
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
            before = target.get(step) if isinstance(target, dict) else None
            target[step] = _document(override.value)
        target = target[step]
    _drop_excluded(document, parts, before)


def _document(value: object) -> Any:
    """A value as the tables of a file have it; a class, a function or an object of a plug-in becomes its name."""
    if isinstance(value, tuple(DISTRIBUTIONS.values())):
        return value
    if isinstance(value, list | tuple):
        return [_document(item) for item in value]
    if isclass(value) or isroutine(value) or any(kind.has_methods(value) for kind in KINDS):
        return Given(value)
    return settings.tables(value)


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


def _drop_excluded(document: dict[str, Any], parts: list[str], before: object) -> None:
    """Removes what cannot stand beside the value at `parts`, which was `before`."""
    match parts:
        case ["robot", "goal"]:
            document["robot"].pop("waypoints", None)
        case ["robot", "waypoints"]:
            document["robot"].pop("goal", None)
        case ["people", index, "behaviour"] if isinstance(document["people"], list):
            _drop_others(document["people"][int(index)], "behaviour", before, Person, BEHAVIOURS)
        case ["prediction", "model"]:
            _drop_others(document["prediction"], "model", before, Prediction, MODELS)


def _drop_others(table: dict[str, Any], key: str, before: object, cls: type, variants: Mapping[str, type]) -> None:
    """Removes the keys that only other variants have than the one under `key`, where `before` stood.

    A plug-in has none of the shipped ones' keys. Those of a plug-in that stood there are all that `cls` does not know.
    """
    keys = {name: set(settings.keys(kind)) for name, kind in variants.items()}
    name = table[key]
    if isinstance(name, str):
        others = set().union(*keys.values())
        if isinstance(before, str) and before != name and before not in variants:
            others = set(table) - set(settings.keys(cls))
        for other in others - keys.get(name, set()):
            table.pop(other, None)
