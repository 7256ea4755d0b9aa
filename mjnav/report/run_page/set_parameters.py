"""The parameters of a run that are not the defaults."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from typing import Any

from mjnav.scene.spec import Scenario
from mjnav.settings import keys, tables

# What the map shows, or the page in another place.
_ELSEWHERE = ("schema", "name", "description", "seed", "walls", "tables", "pillars", "people", "lanes", "log")
_ELSEWHERE_TOO = ("robot.start", "robot.goal", "robot.waypoints", "control.method")


def set_parameters(scenario: Scenario) -> dict[str, str]:
    """The keys of the run file whose values are not their defaults, with the values as text; geometry is left out."""
    return {
        key: json.dumps(value, ensure_ascii=False) if not isinstance(value, str) else value
        for key, value in _changed(scenario, "")
        if key not in (*_ELSEWHERE, *_ELSEWHERE_TOO)
    }


def _changed(value: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, field in keys(type(value)).items():
        item = getattr(value, field.name)
        key = f"{prefix}{name}"
        if key in _ELSEWHERE or (not field.beside and item == field.default):
            continue
        if is_dataclass(item):
            yield from _changed(item, f"{key}.")
        elif field.beside and isinstance(item, Mapping):
            yield from ((f"{prefix}{own}", tables(one)) for own, one in item.items())
        else:
            yield key, field.type.write(item)
