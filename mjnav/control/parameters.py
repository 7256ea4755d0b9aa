"""Parameters of the controllers: those that several methods share, their checks, and the memory that a decision takes.

A method has the parameters that change its decisions, no others: each class below adds to the one before it, and a
method's own starts from the last of them that it reads the whole of. A field says its range, as in `mjnav.settings`;
parameters of your own may do so too, or call `at_least` in their `__post_init__`. The memory is checked before the
first decision.
"""

from dataclasses import dataclass, fields
from typing import Annotated, Any

from mjnav.constraints.collision_cone import FORMS
from mjnav.errors import InvalidValue
from mjnav.settings import Choice, Range, settle

RATED_PERIOD = 0.1  # [s] at which w_v and w_omega are
CHANGE_WEIGHT = 0.01
LOOK_AHEAD = 5.0  # [s], the horizon of the collision cone
NEAR = 2.0  # [m]
WINDOWS = ("reachable", "bounds")  # of the candidate grid
# Of any parameter. Their squares, quotients and products with lengths of 1e4 m stay far from what a float cannot hold.
LEAST, MOST = 1e-9, 1e6

Count = Annotated[int, Range(1, int(MOST))]
Weight = Annotated[float, Range(0.0, MOST)]
LaneWeights = Annotated[tuple[Weight, Weight], "of the risk of the lane boundaries: left, right"]
Seconds = Annotated[float, Range(LEAST, MOST, "s")]
Share = Annotated[float, Range(0.0, 1.0)]
Positive = Annotated[float, Range(LEAST, MOST)]
Penalty = Annotated[
    float, Range(0.0, MOST, or_inf=True), "of what exceeds the bound, added to the goal cost; inf: it is forbidden"
]


def at_least(key: str, value: float, low: float, *, above: bool = False) -> None:
    """Refuses a value below `low`, or with `above` below LEAST more than that, and one beyond MOST that is not inf.

    NaN is refused.
    """
    Range(low + LEAST if above else low, MOST, or_inf=True).check(key, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopParameters:
    """What every method has: the loop draws its samples and gives it the robot's preferred speed."""

    preferred_speed: Annotated[
        float, Range(LEAST, MOST, "m/s"), "speed on a free way; a run file gives it under [robot]"
    ] = 0.8
    samples: Annotated[Count, "N = M, number of samples drawn from each belief"] = 25

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class SightParameters(LoopParameters):
    """What a method that sees a `Problem` has: which obstacles count, and how the goal is approached."""

    approach_time: Annotated[Seconds, "the goal is approached at distance / approach_time at most"] = 1.0
    sensing_range: Annotated[
        Annotated[float, Range(LEAST, MOST, "m", or_inf=True)] | None,
        "distance beyond which no obstacle counts; by default 7 m, and 5 m more for each m/s of top speed beyond 1 m/s",
    ] = None
    max_obstacles: Annotated[
        Count | None, "number of discs that count, nearest first, by default all in range; walls in range all count"
    ] = None
    safety_margin: Annotated[float, Range(0.0, MOST, "m"), "added to the combined radius R"] = 0.05

    def reach(self, max_speed: float) -> float:
        """Distance [m] beyond which no obstacle counts for a robot of this top speed [m/s].

        By default what the robot drives in LOOK_AHEAD at top speed and NEAR more, never less than at 1 m/s.
        """
        return NEAR + LOOK_AHEAD * max(max_speed, 1.0) if self.sensing_range is None else self.sensing_range


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalParameters(SightParameters):
    """The goal cost."""

    preview: Annotated[Seconds, "tau: a candidate drives straight on at the heading that it has after this time"] = 0.4
    heading_weight: Annotated[Weight, "w_h, of the heading error in the goal cost"] = 0.6
    speed_change_weight: Annotated[Weight, "w_v, of a change of speed; the default follows the period"] = CHANGE_WEIGHT
    turn_change_weight: Annotated[Weight, "w_omega, of a change of turn rate; the default follows the period"] = (
        CHANGE_WEIGHT
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class GridParameters(GoalParameters):
    """What every method that chooses from the candidate grid has: the grid, and the constraints at the mean."""

    num_v: Annotated[Count, "number of speeds in the grid of candidates"] = 20
    num_omega: Annotated[Count, "number of turn rates in the grid of candidates"] = 20
    window: Annotated[
        str, Choice(WINDOWS), "extent of the grid: what one period reaches, or all between the limits"
    ] = "reachable"
    form: Annotated[str, Choice(FORMS), "of the collision cone f"] = "segment"
    horizon: Annotated[
        float, Range(LEAST, MOST, "s", or_inf=True), "time ahead that the segment form of the cone covers"
    ] = 5.0
    wall_horizon: Annotated[Seconds, "time ahead in which walls are checked"] = 2.0
    lane_horizon: Annotated[Seconds, "time ahead at which the lanes are checked"] = 1.0
    normalise: Annotated[bool, "divide f by R², lane distances by the robot's radius"] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters(GridParameters):
    """What a method has that looks at all samples of each constraint, the safe ones too, for every candidate.

    A method for which a safe sample is as good as any other has no clip.
    """

    clip: Annotated[float, Range(LEAST, MOST, or_inf=True), "no sample counts as safer than this"] = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedParameters(Parameters):
    """Of a method whose risk is added to the goal cost: the weights of that risk."""

    weight: Annotated[Weight, "lambda, of the risk of each disc and wall"] = 10.0
    lane_weights: LaneWeights = (10.0, 10.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingParameters(WeightedParameters):
    """Of a method that compares each constraint's samples with desired ones: how those are chosen."""

    desired_min: Annotated[int, Range(0, int(MOST)), "fewer safe samples than this are topped up"] = 25
    ball: Annotated[float, Range(0.0, MOST, "m"), "epsilon, the ball's radius"] = 0.15


def completed(parameters: LoopParameters) -> Parameters:
    """The parameters that a `Problem` takes: a method's own, and defaults of those that it does not have."""
    if isinstance(parameters, Parameters):
        return parameters
    return Parameters(
        **{f.name: getattr(parameters, f.name) for f in fields(Parameters) if hasattr(parameters, f.name)}
    )


MAX_BYTES = 2e9  # of one decision's arrays
_NUMBER = 8  # [bytes]
# Arrays of the size of the larger one that exist at once: samples of f or of rollouts, their sorted copies.
_COPIES = 2
_SIZES = ("samples", "num_v", "num_omega", "num_components", "rollouts", "steps", "knots")


def check_memory(parameters: Any, rollouts: int | None = None) -> None:
    """Refuses parameters with which one decision takes more than MAX_BYTES of memory.

    Of candidates that is every constraint's samples at each of them, a pair for any two samples of the beliefs; of
    rollouts, as many as are told or as the parameters say, the samples at every step. A parameter that the method does
    not have counts once. Raises InvalidValue.
    """
    samples, num_v, num_omega, components, perturbed, steps, knots = (getattr(parameters, key, 1) for key in _SIZES)
    candidates = num_v * num_omega * max(samples**2, components)
    key, num = ("rollouts", perturbed) if rollouts is None else ("num_speeds", rollouts)
    rolled_out = num * max(steps * samples, knots)
    for name, numbers, what in (
        ("num_v", candidates, f"{num_v} x {num_omega} candidates"),
        (key, rolled_out, f"{num} rollouts of {steps} steps"),
    ):
        size = _COPIES * _NUMBER * numbers
        if size > MAX_BYTES:
            allowed = f"what takes at most {MAX_BYTES / 1e9:g} GB of memory a decision; this takes {size / 1e9:.3g} GB"
            raise InvalidValue(name, f"{what}, {samples} samples of each belief", allowed)
