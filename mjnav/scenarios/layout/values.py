"""The value of a key that may be drawn: checked against what the key allows, then drawn."""

from collections.abc import Mapping
from dataclasses import is_dataclass
from typing import Any, get_args, get_origin

from mjnav import config
from mjnav.config import Range, below
from mjnav.config.marks import Choice, bare, describe, mark, options
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.layout.draws import (
    InArea,
    Normal,
    OneOf,
    Streams,
    Uniform,
    draw_count,
    draw_number,
    draw_point,
    draw_share,
    is_draw,
    kind_of,
)

ANY = Any  # the hint of a key of which nothing is known


def check_value(hint: Any, value: Any) -> None:
    """Raises InvalidValue where a value, or anything that may be drawn for it, is not what its key allows."""
    kind = _kind(hint, value)
    if kind in (Uniform, Normal):
        _check_ends(hint, value, required=kind is Uniform)
    draw = _draw(hint, value)
    if isinstance(draw, OneOf):
        for i, item in enumerate(draw.one_of):
            with below("one_of"), below(str(i)):
                check_value(hint, item)
    elif isinstance(draw, InArea):
        _check_points(hint, draw, value)
    elif _is_shares(hint, value):
        _check_shares(hint, value)
    elif isinstance(value, Mapping) and (fields := _fields(hint)) is not None and is_draw(value):
        for key, item in value.items():
            with below(key):
                check_value(fields.get(key, ANY), item)
    elif isinstance(value, list) and is_draw(value):
        for i, (item_hint, item) in enumerate(_items(hint, value)):
            with below(str(i)):
                check_value(item_hint, item)
    elif draw is None and hint is not ANY:
        config.settled(hint, value)


def draw_value(hint: Any, value: Any, key: str, streams: Streams) -> Any:
    """The value as a plain run file has it: itself, or one that is drawn from the streams of its key."""
    draw = _draw(hint, value)
    if isinstance(draw, OneOf):
        chosen = draw_share(draw.shares or (1.0,) * len(draw.one_of), streams(key))
        return draw_value(hint, draw.one_of[chosen], f"{key}.{chosen}", streams)
    if isinstance(draw, Uniform | Normal):
        number = _number_hint(hint, value)
        whole = bare(number) is int if number is not None else _are_whole(value)
        with below(key):
            return draw_number(draw, mark(number, Range), whole, streams(key))
    if isinstance(draw, InArea):
        if draw.count is None:
            return draw_point(draw.area, streams(key))
        count = draw_count(draw.count, streams(f"{key}.count"))
        return [draw_point(draw.area, streams(f"{key}.{i}")) for i in range(count)]
    if _is_shares(hint, value):
        return list(value)[draw_share(tuple(value.values()), streams(key))]
    if isinstance(value, Mapping) and (fields := _fields(hint)) is not None:
        return {one: draw_value(fields.get(one, ANY), item, f"{key}.{one}", streams) for one, item in value.items()}
    if isinstance(value, list) and is_draw(value):
        pairs = enumerate(_items(hint, value))
        return [draw_value(item_hint, item, f"{key}.{i}", streams) for i, (item_hint, item) in pairs]
    return value


def is_drawn(hint: Any, value: Any) -> bool:
    """Whether a value is drawn, or has a drawn one in it."""
    return is_draw(value) or _is_shares(hint, value)


def _draw(hint: Any, value: Any) -> Any:
    """The draw that a table stands for, checked; None where it is none."""
    kind = _kind(hint, value)
    return None if kind is None else config.read(kind, value)


def _kind(hint: Any, value: Any) -> type | None:
    kind = kind_of(value) if isinstance(value, Mapping) else None
    return None if kind is None or _is_shares(hint, value) else kind


def _check_ends(hint: Any, value: Mapping[str, Any], *, required: bool) -> None:
    """The ends of a range are numbers that the key allows. Raises InvalidValue."""
    number = _number_hint(hint, value)
    for end in ("low", "high"):
        if number is None:
            continue
        if end in value:
            with below(end):
                config.settled(number, value[end])
        elif required and {"low", "high", "log"} >= {*value}:  # another key is told first
            raise InvalidValue(end, None, f"{describe(number)}; this key is required")


def _number_hint(hint: Any, value: Any) -> Any:
    """The alternative of a type that is a number; None where nothing is known. Raises InvalidValue."""
    if hint is ANY:
        return None
    number = next((one for one in options(hint) or (hint,) if bare(one) in (float, int)), None)
    if number is None:
        raise InvalidValue("", value, describe(hint))
    return number


def _check_points(hint: Any, draw: InArea, value: Any) -> None:
    if hint is ANY:
        return
    found = [[0.0, 0.0]] * 2 if isinstance(draw.count, tuple) else [[0.0, 0.0]] * (draw.count or 0)
    try:
        config.settled(hint, found if draw.count is not None else [0.0, 0.0])
    except InvalidValue:
        allowed = f"{describe(hint)}; an area with a count is an array of points, without one a point"
        raise InvalidValue("", dict(value), allowed) from None


def _is_shares(hint: Any, value: Any) -> bool:
    """Whether a table gives the shares of names: of a key that takes one name of several."""
    if not isinstance(value, Mapping) or hint is ANY:
        return False
    choice = _choice(hint)
    return choice is not None and kind_of(value) is not OneOf


def _check_shares(hint: Any, value: Mapping[str, Any]) -> None:
    choice = _choice(hint)
    for name, share in value.items():
        if choice is not None and name not in choice.names:
            raise unknown_name("", name, choice.names)
        with below(name):
            config.settled(float, share)
            Range(0.0, 1e9).check("", share)
    if not sum(value.values()) > 0.0:
        raise InvalidValue("", dict(value), "shares of which at least one is more than 0")


def _choice(hint: Any) -> Choice | None:
    return next((found for one in options(hint) or (hint,) if (found := mark(one, Choice)) is not None), None)


def _fields(hint: Any) -> dict[str, Any] | None:
    """The types of the keys of a table, where a dataclass says them."""
    kind = next((bare(one) for one in options(hint) or (hint,) if is_dataclass(bare(one))), None)
    return None if kind is None else {key: field.hint for key, field in config.keys(kind).items()}


def _items(hint: Any, value: list) -> list[tuple[Any, Any]]:
    """The items of an array, each with its type. Raises InvalidValue for another number of them."""
    kind = next((bare(one) for one in options(hint) or (hint,) if get_origin(bare(one)) is tuple), None)
    if kind is None:
        if hint is not ANY:
            raise InvalidValue("", value, describe(hint))
        return [(ANY, item) for item in value]
    hints = get_args(kind)
    hints = hints[:1] * len(value) if hints[-1] is Ellipsis else hints
    if len(hints) != len(value):
        raise InvalidValue("", value, describe(hint))
    return list(zip(hints, value, strict=True))


def _are_whole(value: Mapping[str, Any]) -> bool:
    ends = [value[end] for end in ("low", "high") if end in value]
    return bool(ends) and all(isinstance(end, int) and not isinstance(end, bool) for end in ends)
