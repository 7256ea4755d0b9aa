"""Parameters of the controllers: those that several share, and how they are checked.

A method has the parameters that change its decisions, no others: each class below adds to the one before it, and a
method's own starts from the last of them that it reads the whole of.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import inf
from types import MappingProxyType
from typing import Any, TypeVar, get_type_hints

from mjnav.constraints.collision_cone import FORMS
from mjnav.control.problem.candidates import WINDOWS
from mjnav.errors import InvalidValue, unknown_name

P = TypeVar("P")
RATED_PERIOD = 0.1  # [s] at which w_v and w_omega are
CHANGE_WEIGHT = 0.01
# Of any parameter. Their squares, quotients and products with lengths of 1e4 m stay far from what a float cannot hold.
LEAST, MOST = 1e-9, 1e6


def at_least(key: str, value: float, low: float, *, above: bool = False) -> None:
    """Refuses a value below `low`, or with `above` below LEAST more than that, and one beyond MOST that is not inf.

    NaN is refused.
    """
    first = low + LEAST if above else low
    if not (first <= value <= MOST or value == inf):
        raise InvalidValue(key, value, f"a number {'>' if above else '>='} {low:g}, from {first:g} to {MOST:g}")


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
class LoopParameters:
    """What every method has: the loop draws its samples and gives it the robot's preferred speed."""

    preferred_speed: float = 0.8  # [m/s]; the run file gives it under [robot]
    samples: int = 25  # N = M drawn from each belief

    def __post_init__(self):
        at_least("preferred_speed", self.preferred_speed, 0.0, above=True)
        at_least("samples", self.samples, 1)
        finite(self, "preferred_speed")


@dataclass(frozen=True, slots=True, kw_only=True)
class SightParameters(LoopParameters):
    """What a method that sees a `Problem` has: which obstacles count, and how the goal is approached.

    `inf` switches sensing_range off.
    """

    approach_time: float = 1.0  # [s]: the goal is approached at distance / approach_time at most
    sensing_range: float = 7.0  # [m]
    max_obstacles: int = 16  # discs, nearest first; walls in range all count. Two tables alone are eight
    safety_margin: float = 0.05  # [m] added to R

    def __post_init__(self):
        LoopParameters.__post_init__(self)
        at_least("max_obstacles", self.max_obstacles, 1)
        for key in ("approach_time", "sensing_range"):
            at_least(key, getattr(self, key), 0.0, above=True)
        at_least("safety_margin", self.safety_margin, 0.0)
        finite(self, "approach_time", "safety_margin")


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalParameters(SightParameters):
    """The goal cost."""

    preview: float = 0.4  # [s] tau: a candidate drives straight on at the heading that it has after this time
    heading_weight: float = 0.6  # w_h
    speed_change_weight: float = CHANGE_WEIGHT  # w_v; make_controller's default follows the period
    turn_change_weight: float = CHANGE_WEIGHT  # w_omega; the same

    def __post_init__(self):
        SightParameters.__post_init__(self)
        at_least("preview", self.preview, 0.0, above=True)
        for key in ("heading_weight", "speed_change_weight", "turn_change_weight"):
            at_least(key, getattr(self, key), 0.0)
        finite(self, "preview", "heading_weight", "speed_change_weight", "turn_change_weight")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridParameters(GoalParameters):
    """What every method that chooses from the candidate grid has: the grid, and the constraints at the mean.

    `inf` switches horizon off.
    """

    num_v: int = 20
    num_omega: int = 20
    window: str = "reachable"  # or "bounds"
    form: str = "segment"  # of the collision cone: line, ray, segment
    horizon: float = 5.0  # [s] of the segment form
    wall_horizon: float = 2.0  # [s] of path that walls are checked against
    lane_horizon: float = 1.0  # [s] after which the lanes are checked
    normalise: bool = True  # divide f by R^2, lane distances by the robot's radius

    def __post_init__(self):
        GoalParameters.__post_init__(self)
        for key, names in (("window", WINDOWS), ("form", FORMS)):
            if getattr(self, key) not in names:
                raise unknown_name(key, getattr(self, key), names)
        for key in ("num_v", "num_omega"):
            at_least(key, getattr(self, key), 1)
        for key in ("horizon", "wall_horizon", "lane_horizon"):
            at_least(key, getattr(self, key), 0.0, above=True)
        finite(self, "wall_horizon", "lane_horizon")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters(GridParameters):
    """What a method has that looks at all samples of each constraint, the safe ones too, for every candidate.

    A method for which a safe sample is as good as any other has no clip. `inf` switches clip off.
    """

    clip: float = 2.0  # no sample counts as safer than this

    def __post_init__(self):
        GridParameters.__post_init__(self)
        at_least("clip", self.clip, 0.0, above=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedParameters(Parameters):
    """Of a method whose risk is added to the goal cost: the weights of that risk."""

    weight: float = 10.0  # lambda, of each disc and wall
    lane_weights: tuple[float, float] = (10.0, 10.0)  # lambda_1, lambda_2: left, right

    def __post_init__(self):
        Parameters.__post_init__(self)
        check_weights(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingParameters(WeightedParameters):
    """Of a method that compares each constraint's samples with desired ones: how those are chosen."""

    desired_min: int = 25  # fewer safe samples than this are topped up
    ball: float = 0.15  # [m] epsilon, the ball's radius

    def __post_init__(self):
        WeightedParameters.__post_init__(self)
        for key in ("desired_min", "ball"):
            at_least(key, getattr(self, key), 0.0)
        finite(self, "ball")


def check_weights(parameters: Any) -> None:
    """Refuses a `weight` or `lane_weights` that is negative or infinite."""
    at_least("weight", parameters.weight, 0.0)
    for weight in parameters.lane_weights:
        at_least("lane_weights", weight, 0.0)
    finite(parameters, "weight", "lane_weights")


def completed(parameters: LoopParameters) -> Parameters:
    """The parameters that a `Problem` takes: a method's own, and defaults of those that it does not have."""
    if isinstance(parameters, Parameters):
        return parameters
    return Parameters(
        **{f.name: getattr(parameters, f.name) for f in fields(Parameters) if hasattr(parameters, f.name)}
    )


def make_parameters(method: str, kind: type[P], values: Mapping[str, Any], preset: Mapping[str, Any]) -> P:
    """A method's parameters from a run file's values over a preset's, of which it takes those that it has.

    Raises InvalidValue for names that it does not have and for wrong types.
    """
    hints = get_type_hints(kind)
    names = [f.name for f in fields(kind)]  # type: ignore[arg-type]
    for key, value in values.items():
        if key not in names:
            raise unknown_name(key, key, names, what=f"parameters of {method}")
        _check_type(key, value, hints[key])
    own = {key: value for key, value in preset.items() if key in names}
    return kind(**{**own, **{key: _cast(value, hints[key]) for key, value in values.items()}})


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
