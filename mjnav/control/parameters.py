"""Parameters of the controllers: those that all share, and how they are checked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import inf
from types import MappingProxyType
from typing import Any, TypeVar, get_type_hints

from mjnav.constraints.collision_cone import FORMS
from mjnav.control.candidates import WINDOWS
from mjnav.errors import InvalidValue, unknown_name

P = TypeVar("P")
RATED_PERIOD = 0.1  # [s] at which w_v and w_omega are
CHANGE_WEIGHT = 0.01


def at_least(key: str, value: float, low: float, *, above: bool = False) -> None:
    """Refuses a value below `low`, or not above it; NaN is refused."""
    if not (value > low if above else value >= low):
        raise InvalidValue(key, value, f"a number {'>' if above else '>='} {low:g}")


def between(key: str, value: float, low: float, high: float) -> None:
    """Refuses a value outside [low, high]; NaN is refused."""
    if not low <= value <= high:
        raise InvalidValue(key, value, f"a number from {low:g} to {high:g}")


def finite(parameters: Any, *keys: str) -> None:
    """Refuses an infinite value of any of `keys`; a pair's too."""
    for key in keys:
        value = getattr(parameters, key)
        if inf in (value if isinstance(value, tuple) else (value,)):
            raise InvalidValue(key, value, "a finite number")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """What every method that chooses from the candidate grid shares, so that only the risk term differs.

    `inf` switches a bound off: horizon, sensing_range, clip.
    """

    preferred_speed: float = 0.8  # [m/s]; the run file gives it under [robot]
    num_v: int = 20
    num_omega: int = 20
    window: str = "reachable"  # or "bounds"
    preview: float = 0.4  # [s] tau: a candidate drives straight on at the heading that it has after this time
    approach_time: float = 1.0  # [s]: the goal is approached at distance / approach_time at most
    heading_weight: float = 0.6  # w_h
    speed_change_weight: float = CHANGE_WEIGHT  # w_v; make_controller's default follows the period
    turn_change_weight: float = CHANGE_WEIGHT  # w_omega; the same
    form: str = "segment"  # of the collision cone: line, ray, segment
    horizon: float = 5.0  # [s] of the segment form
    wall_horizon: float = 2.0  # [s] of path that walls are checked against
    lane_horizon: float = 1.0  # [s] after which the lanes are checked
    normalise: bool = True  # divide f by R^2, lane distances by the robot's radius
    clip: float = 2.0  # no sample counts as safer than this
    samples: int = 25  # N = M drawn from each belief
    sensing_range: float = 7.0  # [m]
    max_obstacles: int = 16  # discs, nearest first; walls in range all count. Two tables alone are eight
    safety_margin: float = 0.05  # [m] added to R

    def __post_init__(self):
        for key, names in (("window", WINDOWS), ("form", FORMS)):
            if getattr(self, key) not in names:
                raise unknown_name(key, getattr(self, key), names)
        for key in ("num_v", "num_omega", "max_obstacles", "samples"):
            at_least(key, getattr(self, key), 1)
        for key in ("preferred_speed", "preview", "approach_time", "horizon", "wall_horizon", "lane_horizon"):
            at_least(key, getattr(self, key), 0.0, above=True)
        for key in ("clip", "sensing_range"):
            at_least(key, getattr(self, key), 0.0, above=True)
        for key in ("heading_weight", "speed_change_weight", "turn_change_weight", "safety_margin"):
            at_least(key, getattr(self, key), 0.0)
        finite(self, "preferred_speed", "preview", "approach_time", "wall_horizon", "lane_horizon", "safety_margin")
        finite(self, "heading_weight", "speed_change_weight", "turn_change_weight")


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedParameters(Parameters):
    """Of a method whose risk is added to the goal cost: the weights of that risk."""

    weight: float = 10.0  # lambda, of each disc and wall
    lane_weights: tuple[float, float] = (10.0, 10.0)  # lambda_1, lambda_2: left, right

    def __post_init__(self):
        Parameters.__post_init__(self)
        at_least("weight", self.weight, 0.0)
        for weight in self.lane_weights:
            at_least("lane_weights", weight, 0.0)
        finite(self, "weight", "lane_weights")


def make_parameters(kind: type[P], values: Mapping[str, Any], defaults: Mapping[str, Any] | None = None) -> P:
    """`kind` from a run file's values over a preset's; raises InvalidValue for unknown names and wrong types."""
    hints = get_type_hints(kind)
    names = [f.name for f in fields(kind)]  # type: ignore[arg-type]
    for key, value in values.items():
        if key not in names:
            raise unknown_name(key, key, names)
        _check_type(key, value, hints[key])
    return kind(**{**(defaults or {}), **{key: _cast(value, hints[key]) for key, value in values.items()}})


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_pair(value: Any) -> bool:
    return isinstance(value, (list, tuple)) and len(value) == 2 and all(map(_is_number, value))


# What each annotated type of a parameter accepts, and how the error says so.
_ACCEPTS: Mapping[Any, tuple[Callable[[Any], bool], str]] = MappingProxyType(
    {
        float: (_is_number, "a number"),
        int: (lambda value: _is_number(value) and isinstance(value, int), "a whole number"),
        bool: (lambda value: isinstance(value, bool), "true or false"),
        str: (lambda value: isinstance(value, str), "a string"),
        tuple[float, float]: (_is_pair, "a list of two numbers"),
    }
)


def _check_type(key: str, value: Any, hint: Any) -> None:
    # A controller of one's own may have parameters of other types; it checks them itself.
    accepts, allowed = _ACCEPTS.get(hint, (lambda value: True, ""))
    if not accepts(value):
        raise InvalidValue(key, value, allowed)


def _cast(value: Any, hint: Any) -> Any:
    if hint is float:
        return float(value)
    return tuple(float(v) for v in value) if hint == tuple[float, float] else value
