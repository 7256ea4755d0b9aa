"""The reward of a step: a weighted sum of named terms, each with its source.

    reward = Σ weight × term

Rewards see the truth, which no policy does.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import hypot
from types import MappingProxyType

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.errors import InvalidValue, unknown_name
from mjnav.geometry.floor import point_segment
from mjnav.loop.events import GOAL
from mjnav.messages import Array, WorldState, number
from mjnav.metrics.effort import control_cost
from mjnav.scene.spec import Scenario

COMFORT = 0.2  # [m] between surfaces, below which people feel uneasy; Chen et al. 2019


@dataclass(frozen=True)
class Transition:
    """One step of the world."""

    scenario: Scenario
    before: WorldState
    after: WorldState
    target: Array  # (2,) the point of the route that the robot was on its way to
    command_before: Array  # (2,) v, omega decided in the step before, 0 in the first
    command: Array  # (2,) v, omega decided in this step
    outcome: str | None  # how the run ended, if it did

    @cached_property
    def clearance(self) -> float:
        """Least distance between the robot's surface and anyone's within the step [m]; inf where nobody is there.

        Both are taken to move straight.
        """
        if not self.scenario.people:
            return np.inf
        start, end = (state.people_position - state.robot_pose[:2] for state in (self.before, self.after))
        told = self.after.people_radius
        radii = np.array([person.radius for person in self.scenario.people]) if told is None else told
        return _clearance(start, end, radii + self.scenario.robot.radius)

    def progress(self) -> float:
        """How much nearer the robot came to `target` [m]."""
        before, after = (hypot(*(state.robot_pose[:2] - self.target).tolist()) for state in (self.before, self.after))
        return before - after


@exact
def _clearance(start: Matrix, end: Matrix, reach: Vector):
    """Least distance from the origin to the segments from `start` to `end` (P, 2) less `reach` (P,).

    Of who comes or goes, whose start or end is NaN, the other counts.
    """
    least = np.inf
    for i in range(len(reach)):
        x0, y0, x1, y1 = start[i, 0], start[i, 1], end[i, 0], end[i, 1]
        if np.isnan(x0):
            x0, y0 = x1, y1
        if np.isnan(x1):
            x1, y1 = x0, y0
        gap = point_segment(0.0, 0.0, x0, y0, x1, y1) - reach[i]
        if gap < least:  # a NaN, of who is not there, is not
            least = gap
    return least


@dataclass(frozen=True, slots=True)
class Term:
    """One term: its value in words, where it comes from, and its function."""

    formula: str
    source: str
    value: Callable[[Transition], float]


def _discomfort(step: Transition) -> float:
    clearance = step.clearance
    return -0.1 + 0.5 * clearance if 0.0 <= clearance < COMFORT and not step.after.contacts else 0.0


def _control(step: Transition) -> float:
    commands = np.array([step.command_before, step.command])
    scenario = step.scenario
    return -control_cost(commands - step.command_before, scenario.control.period, scenario.robot.track_width)


TERMS: Mapping[str, Term] = MappingProxyType(
    {
        "goal": Term(
            "1 in the step that reaches the goal", "Chen et al. 2017, 2019",
            lambda step: float(step.outcome == GOAL),
        ),
        "collision": Term(
            "-0.25 in a step with a contact, with whatever it is", "Chen et al. 2017, 2019",
            lambda step: -0.25 if step.after.contacts else 0.0,
        ),
        "discomfort": Term(
            "-0.1 + d/2 where the least distance d from a person within the step is below 0.2 m; 0 in a contact",
            "Chen et al. 2019", _discomfort,
        ),
        "progress": Term(
            "metres by which the robot came nearer to the next point of its route",
            "potential-based shaping, Ng, Harada & Russell 1999, with the distance as potential and no discount",
            Transition.progress,
        ),
        "time": Term(
            "minus the control period [s]", "a constant cost of time", lambda step: -step.scenario.control.period
        ),
        "control": Term(
            "-(Δv² + (b/2)² Δω²) / Δt over decisions, b the track width [m²/s³]",
            "the control cost of `mjnav run`", _control,
        ),
    }
)  # fmt: skip

# The reward of Chen et al. 2019 (SARL), which goes back to Chen et al. 2017 (CADRL). They decide every 0.25 s and give
# one term a step; here the goal's and the discomfort's may come together.
PUBLISHED: Mapping[str, float] = MappingProxyType({"goal": 1.0, "collision": 1.0, "discomfort": 1.0})


class Reward:
    """The weighted sum. Raises InvalidValue for a term that does not exist and a weight that is no finite number."""

    def __init__(self, weights: Mapping[str, float]):
        if not isinstance(weights, Mapping):
            raise InvalidValue("reward", weights, "a mapping, the weight of each term")
        for name in weights:
            if name not in TERMS:
                raise unknown_name("reward", name, TERMS, what="terms")
        self._weights = {name: number(f"reward.{name}", weight) for name, weight in weights.items()}

    def terms(self, step: Transition) -> dict[str, float]:
        """Each term times its weight, by name; the reward is their sum."""
        return {name: weight * TERMS[name].value(step) for name, weight in self._weights.items()}
