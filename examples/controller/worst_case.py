"""A controller: the worst samples of every constraint decide.

    mjnav run crossing1 --controller worst_case.py:WorstCase --set control.worst=50

A method that has another idea of risk gives that, for all candidates at once, and inherits the rest: the candidates,
the goal cost, the constraints and the choice. A controller may also be any class that has `decide(observation)`.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.base import WeightedController, sample_risk
from mjnav.control.parameters import WeightedParameters
from mjnav.control.problem.problem import Problem
from mjnav.settings import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstCaseParameters(WeightedParameters):
    """Beside what all methods share, and the weight of the risk."""

    worst: Annotated[int, Range(1, 625), "of the pairs of samples"] = 30


class WorstCase(WeightedController[WorstCaseParameters]):
    """J + weight * the mean of the worst samples of every constraint, where that is unsafe."""

    def risk(self, problem: Problem) -> tuple[np.ndarray, np.ndarray]:
        """Of every disc and wall in reach, (K, B), and of the lanes, (K, 2)."""

        def worst_samples(samples: np.ndarray) -> np.ndarray:  # (n, K) of one constraint, safe where <= 0
            worst = np.sort(samples, axis=0)[-self.parameters.worst :]
            return np.maximum(worst.mean(axis=0), 0.0)

        return sample_risk(problem, worst_samples)
