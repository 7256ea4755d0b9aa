"""A scenario as the text of a run file."""

import json
import re
from collections.abc import Iterator
from datetime import date, time
from numbers import Integral, Real
from typing import Any

from mjnav import config
from mjnav.scenarios.spec import Scenario


def dumps(scenario: Scenario) -> str:
    """The scenario as TOML, every default explicit; `loads` makes an equal scenario of it."""
    return toml_text({"schema": scenario.schema, **tables(scenario)})  # a reader wants the version first


def tables(scenario: Scenario) -> dict[str, Any]:
    """The scenario as the tables of a run file, every default explicit."""
    document = config.tables(scenario)
    if scenario.robot.goal is not None:
        del document["robot"]["waypoints"]  # the one or the other
    return document


def toml_text(table: dict[str, Any]) -> str:
    """The TOML text of a table; TypeError for a value that TOML does not have."""
    return "\n".join(_table(table, "")).strip() + "\n"


def _table(table: dict[str, Any], path: str) -> Iterator[str]:
    """The lines of a table: first its own values, then the tables in it."""
    inner = {key: value for key, value in table.items() if isinstance(value, dict) or _is_array_of_tables(value)}
    yield from (f"{_key(key)} = {_value(value)}" for key, value in table.items() if key not in inner)
    for key, value in inner.items():
        name = f"{path}.{_key(key)}" if path else _key(key)
        for header, item in [(f"[{name}]", value)] if isinstance(value, dict) else [(f"[[{name}]]", i) for i in value]:
            yield from ("", header, *_table(item, name))


def _is_array_of_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _value(value: object) -> str:
    match value:
        case str():
            return _string(value)
        case bool():
            return "true" if value else "false"
        case Integral():
            return str(int(value))
        case Real():
            return repr(float(value))
        case date() | time():  # a datetime is a date
            return value.isoformat()
        case list():
            return f"[{', '.join(map(_value, value))}]"
        case dict():
            return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    raise TypeError(f"TOML has no {type(value).__name__}")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _string(key)


def _string(text: str) -> str:
    """A basic string: JSON's escapes are TOML's, but JSON leaves DEL as it is."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
