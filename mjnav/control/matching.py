"""What the methods that match each constraint's distribution with a collision-free one share: the desired sets."""

from dataclasses import dataclass
from typing import ClassVar, TypeVar

from mjnav.control.base import WeightedController
from mjnav.control.parameters import LoopParameters, WeightedParameters, at_least, finite
from mjnav.control.problem.desired import Desired
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingParameters(WeightedParameters):
    """The desired set."""

    desired_min: int = 25  # fewer safe samples than this are topped up
    ball: float = 0.15  # [m] epsilon, the ball's radius

    def __post_init__(self):
        WeightedParameters.__post_init__(self)
        for key in ("desired_min", "ball"):
            at_least(key, getattr(self, key), 0.0)
        finite(self, "ball")


M = TypeVar("M", bound=MatchingParameters)


class MatchingController(WeightedController[M]):
    """A method whose risk is a distance from the desired distributions: a subclass gives `risk`."""

    parameters_type: ClassVar[type[LoopParameters]] = MatchingParameters
    _wanted: Desired | None = None

    def desired(self, problem: Problem) -> Desired:
        """The desired sets of a problem; asked for the same one again, the same sets."""
        if self._wanted is None or self._wanted.problem is not problem:
            self._wanted = Desired(problem, self.parameters.desired_min, self.parameters.ball)
        return self._wanted

    def desired_cone(self, problem: Problem, block: int) -> Array:
        """F^des of one disc or wall."""
        return self.desired(problem).cone(block)
