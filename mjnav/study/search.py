"""Random search: settings of a method that are drawn, as many for one method as for another.

    search = { count = 24, weight = { low = 1.0, high = 30.0, log = true }, degree = { one_of = [1, 2, 3] } }

A value that is drawn stands as in a random scene (`mjnav.scene.draws`). Of a parameter that is a whole number,
whole numbers are drawn; of a method of one's own, and of other keys of a run file, where the ends are whole numbers.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from math import inf
from typing import Annotated, Any

from mjnav.control.registry import shipped_parameters
from mjnav.errors import InvalidValue, unknown_name
from mjnav.rng import stream
from mjnav.scene.draws import drawing, is_draw, kind_of
from mjnav.scene.ranges import Seed
from mjnav.scene.spec import Control
from mjnav.settings import Beside, Range, below, keys, settle

MAX_COUNT = 10_000
MAX_REDRAWS = 1000  # of a setting, until it is none of those before
_DIGITS = 3  # significant ones of a drawn number: a setting can be typed in
_PERIOD = 1.0 / Control().rate  # [s] of the default parameters


@dataclass(frozen=True, slots=True)
class Search:
    """Settings of a method: its parameters as they stand, then drawn ones."""

    count: Annotated[int, Range(1, MAX_COUNT), "number of settings; the first has the parameters as they stand"]
    seed: Annotated[Seed | None, "of the draws; by default they follow from the study's name"] = None
    ranges: Annotated[Mapping[str, object], Beside()] = field(default_factory=dict)

    def __post_init__(self):
        settle(self)
        for key, value in _by_key(self.ranges).items():
            with below(key.removeprefix("control.")):
                if not is_draw(value):
                    raise InvalidValue("", value, "{ low, high }, also with log = true; { mean, std }; { one_of }")
                drawing(Any, value)

    def settings(
        self, study: str, label: str, controller: str, standing: Mapping[str, object]
    ) -> list[dict[str, object]]:
        """The values of every setting by full key, "control.weight"; none for the first.

        `study` and `label` name the study and the method, whose values in `standing` (by full key) are the first
        setting. Every key draws from a stream of its own, one setting after the other: with a larger count, and with
        other methods, the settings stay, and so do a parameter's values beside one that is added. Numbers have three
        significant digits; a setting that came before is drawn again. Raises InvalidValue for a parameter that a
        shipped method does not have, a range with values that it does not allow, and a count that the values of
        `one_of` cannot fill.
        """
        values = _by_key(self.ranges)
        defaults = shipped_parameters(controller, _PERIOD)
        hints = {key: _hint(key, defaults) for key in values}
        for key, value in values.items():
            with below(key.removeprefix("control.")):
                drawing(hints[key], value)
        streams = self._streams(study, label)
        known = {f"control.{key}": getattr(defaults, key) for key in keys(type(defaults))} if defaults else {}
        first: dict[str, object] = {key: {**known, **standing}.get(key) for key in values}
        found = [first]
        for _ in range(MAX_REDRAWS + self.count):
            if len(found) == self.count:
                break
            drawn = {key: _rounded(one, drawing(hints[key], one)(key, streams)) for key, one in values.items()}
            if drawn not in found:
                found.append(drawn)
        if len(found) < self.count:
            raise InvalidValue("count", self.count, f"at most {len(found)}: its values make no more settings")
        return [{}, *found[1:]]

    def _streams(self, study: str, label: str) -> Callable[[str], Any]:
        body = label if self.seed is not None else f"{study}/{label}"
        return cache(lambda key: stream(self.seed or 0, f"search.{key}", body))


def _by_key(table: Mapping[str, object], prefix: str = "") -> dict[str, object]:
    """What is drawn by full key: a key without a dot is one of [control]."""
    found: dict[str, object] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and value and kind_of(value) is None:
            found |= _by_key(value, f"{prefix}{key}.")
        else:
            place = f"{prefix}{key}"
            found[place if "." in place else f"control.{place}"] = value
    return found


def _hint(key: str, defaults: Any) -> Any:
    """The type of a key's values; Any where it is no shipped method's parameter. Raises InvalidValue."""
    group, _, name = key.partition(".")
    if defaults is None or group != "control" or "." in name:
        return Any
    known = {**keys(Control), **keys(type(defaults))}
    if name not in known:
        raise unknown_name(name, name, keys(type(defaults)))
    return known[name].hint


def _rounded(draw: Any, value: Any) -> Any:
    """A drawn number with three significant digits, between the ends of its range; one of a list as it stands."""
    if isinstance(draw, list):
        return [_rounded(one, item) for one, item in zip(draw, value, strict=True)]
    if not isinstance(value, float) or not isinstance(draw, Mapping) or "one_of" in draw:
        return value
    return min(max(float(f"{value:.{_DIGITS}g}"), draw.get("low", -inf)), draw.get("high", inf))
