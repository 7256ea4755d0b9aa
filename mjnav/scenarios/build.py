"""From the tables of a run file to the dataclasses of `spec`, driven by their type hints, and back."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, Field, fields, is_dataclass
from types import MappingProxyType, NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from mjnav.errors import InvalidValue, unknown_name
from mjnav.noise import CHANNELS
from mjnav.noise import names as distributions
from mjnav.scenarios.spec import BEHAVIOURS, ChannelNoise, Control, Noise, Person, Robot, Scenario, Wall

T = TypeVar("T")
TomlTable = dict[str, Any]

_ALIASES = MappingProxyType({Wall: MappingProxyType({"start": "from", "end": "to"})})  # field -> key
_NAMES = MappingProxyType(  # of a type's values, one and many
    {
        float: ("a number", "numbers"),
        int: ("a whole number", "whole numbers"),
        bool: ("true or false", "true or false"),
        str: ("a string", "strings"),
    }
)
_MAX_DEPTH = 20  # of tables and arrays in one another; the deepest that a run file needs is 5


def build(document: TomlTable) -> Scenario:
    """The scenario that the tables describe; each of its parts is checked, but not yet what lies between them.

    Raises InvalidValue with the dotted key of what is unknown, missing, of the wrong type or impossible.
    """
    _check_values(document)
    if "schema" not in document:
        raise InvalidValue("schema", None, "schema = 1, the version of this format")
    with _below("schema"):
        if _read(int, document["schema"]) != 1:
            raise InvalidValue("", document["schema"], "1")
    return _read_fields(Scenario, document)


def read(cls: type[T], document: TomlTable) -> T:
    """The dataclass of another kind of file that the tables describe, checked in the same way. Raises InvalidValue."""
    _check_values(document)
    return _read_fields(cls, document)


def _read(hint: Any, value: object) -> Any:
    """`value` as the type `hint`, or InvalidValue. A whole number serves as a number, a truth value never does."""
    if is_dataclass(hint):
        return _READERS.get(hint, _read_fields)(hint, _as_table(value))
    if get_origin(hint) is tuple:
        return _read_array(hint, value)
    if get_origin(hint) is Mapping:  # of any keys
        return _as_table(value)
    if get_origin(hint) in (Union, UnionType):
        return _read(_option(hint, value), value)
    if hint is float and type(value) is int:
        return float(value)
    if type(value) is hint:
        return value
    raise InvalidValue("", value, _describe(hint))


def _option(hint: Any, value: object) -> Any:
    """What a union wants of a value: X of X | None, as TOML has no null; a dataclass of a table."""
    options = [option for option in get_args(hint) if option is not NoneType]
    return next((option for option in options if is_dataclass(option) == isinstance(value, dict)), options[0])


def tables(value: object) -> Any:
    """What `build` reads as `value`, every default explicit: its inverse."""
    if isinstance(value, Person):
        name = next(name for name, behaviour in BEHAVIOURS.items() if type(value.behaviour) is behaviour)
        return {"start": list(value.start), "behaviour": name, **tables(value.behaviour), "radius": value.radius}
    if isinstance(value, Control):
        latency = {} if value.latency is None else {"latency": tables(value.latency)}
        return {
            "method": value.method,
            "rate": value.rate,
            "delay": value.delay,
            "prediction": value.prediction,
            **tables(value.parameters),
            **latency,
        }
    if isinstance(value, Noise):
        table: TomlTable = {"profile": value.profile}
        for channel, noise in value.channels.items():
            *group, last = channel.split(".")
            inner = table
            for part in group:
                inner = inner.setdefault(part, {})
            inner[last] = {"distribution": noise.distribution, **tables(noise.arguments)}
        return table
    if is_dataclass(value):
        found = {key: getattr(value, item.name) for key, item in _keys(type(value)).items()}
        if found.get("goal") is not None:
            del found["waypoints"]  # the one or the other
        return {key: tables(item) for key, item in found.items() if item is not None}
    if isinstance(value, Mapping):
        return {key: tables(item) for key, item in value.items()}
    return [tables(item) for item in value] if isinstance(value, list | tuple) else value


def _read_fields(cls: type[T], table: TomlTable) -> T:
    _check_known(table, _keys(cls))
    return cls(**_arguments(cls, table))


def _arguments(cls: type, table: TomlTable, leave: tuple[str, ...] = ()) -> dict[str, Any]:
    """The constructor's arguments that stand in the table, all but those to `leave`."""
    hints, arguments = get_type_hints(cls), {}
    for key, item in _keys(cls).items():
        if key in leave:
            continue
        if key in table:
            with _below(key):
                arguments[item.name] = _read(hints[item.name], table[key])
        elif item.default is MISSING and item.default_factory is MISSING:
            raise InvalidValue(key, None, f"{_describe(hints[item.name])}; this key is required")
    return arguments


def _read_robot(cls: type[Robot], table: TomlTable) -> Robot:
    """A robot that is slower than the default of preferred_speed prefers its full speed."""
    _check_known(table, _keys(cls))
    arguments = _arguments(cls, table)
    default: Any = _keys(cls)["preferred_speed"].default
    arguments.setdefault("preferred_speed", min(default, arguments.get("max_speed", default)))
    return cls(**arguments)


def _read_person(cls: type[Person], table: TomlTable) -> Person:
    own_keys = {name: _keys(behaviour) for name, behaviour in BEHAVIOURS.items()}
    name = table.get("behaviour")
    if name is None:
        _check_known(table, [*_keys(Person), *(key for keys in own_keys.values() for key in keys)])
    if not isinstance(name, str):
        raise InvalidValue("behaviour", name, ", ".join(sorted(BEHAVIOURS)))
    if name not in BEHAVIOURS:
        raise unknown_name("behaviour", name, BEHAVIOURS)
    _check_known(table, [*_keys(Person), *own_keys[name]])
    behaviour = BEHAVIOURS[name]
    return Person(behaviour=behaviour(**_arguments(behaviour, table)), **_arguments(Person, table, ("behaviour",)))


def _read_control(cls: type[Control], table: TomlTable) -> Control:
    own = [key for key in _keys(Control) if key != "parameters"]
    parameters = {key: value for key, value in table.items() if key not in own}
    return Control(parameters=parameters, **_arguments(Control, table, ("parameters",)))


def _read_noise(cls: type[Noise], table: TomlTable) -> Noise:
    groups, channels = {channel.split(".")[0] for channel in CHANNELS}, {}
    for key, value in table.items():
        if key == "profile":
            continue
        if key not in groups:
            raise unknown_name(_shown_key(key), key, ["profile", *CHANNELS])
        if key in CHANNELS:
            with _below(key):
                channels[key] = _read_channel(value)
            continue
        with _below(key):
            for last, channel_table in _as_table(value).items():
                channel = f"{key}.{last}"
                if channel not in CHANNELS:
                    raise unknown_name(_shown_key(last), channel, CHANNELS)
                with _below(last):
                    channels[channel] = _read_channel(channel_table)
    return Noise(channels=channels, **_arguments(Noise, table, ("channels",)))


def _as_table(value: object) -> TomlTable:
    if not isinstance(value, dict):
        raise InvalidValue("", value, "a table")
    return value


def _read_channel(value: object) -> ChannelNoise:
    table = dict(_as_table(value))
    distribution = table.pop("distribution", None)
    if distribution is None:
        raise InvalidValue("distribution", None, f"{', '.join(sorted(distributions()))}; this key is required")
    with _below("distribution"):
        _read(str, distribution)
    return ChannelNoise(distribution, table)


_READERS: Mapping[Any, Any] = MappingProxyType(
    {Robot: _read_robot, Person: _read_person, Control: _read_control, Noise: _read_noise}
)


def _read_array(hint: Any, value: object) -> tuple:
    hints = get_args(hint)
    if not isinstance(value, list):
        raise InvalidValue("", value, _describe(hint))
    if hints[-1] is Ellipsis:
        hints = hints[:1] * len(value)
    if len(value) != len(hints):
        raise InvalidValue("", value, _describe(hint))
    items = []
    for i, (item_hint, item) in enumerate(zip(hints, value, strict=True)):
        with _below(str(i)):
            items.append(_read(item_hint, item))
    return tuple(items)


def _describe(hint: Any, many: bool = False) -> str:
    """What values of a type are called in a message."""
    if get_origin(hint) is tuple:
        first, *rest = get_args(hint)
        count = "" if rest == [Ellipsis] else f"{len(rest) + 1} "
        return f"{'arrays' if many else 'an array'} of {count}{_describe(first, many=True)}"
    if get_origin(hint) in (Union, UnionType):
        return _describe(get_args(hint)[0], many)
    return _NAMES.get(hint, ("a table", "tables"))[many]


def _keys(cls: Any) -> dict[str, Field]:
    """The keys of a table that becomes a `cls`, each with its field; what does not compare is not in the file."""
    aliases = _ALIASES.get(cls, {})
    return {aliases.get(item.name, item.name): item for item in fields(cls) if item.compare}


def _check_known(table: TomlTable, keys: Iterable[str]) -> None:
    keys = set(keys)
    for key in table:
        if key not in keys:
            raise unknown_name(_shown_key(key), key, keys)


def _check_values(value: object, depth: int = 0) -> None:
    """Refuses what TOML readers let through: whole numbers of more than 64 bits, and nesting without end."""
    if depth > _MAX_DEPTH:
        raise InvalidValue("", "...", f"tables and arrays in one another at most {_MAX_DEPTH} deep")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise InvalidValue("", value, "whole numbers of at most 64 bits")
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            with _below(str(key)):
                _check_values(item, depth + 1)


def _shown_key(key: str) -> str:
    """The key as TOML writes it, quoted unless it is a bare one."""
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


@contextmanager
def _below(key: str) -> Iterator[None]:
    """Errors from inside carry `key` in front of theirs."""
    try:
        yield
    except InvalidValue as error:
        raise error.within(_shown_key(key)) from None
