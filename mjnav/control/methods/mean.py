"""`mean`: the constraints at the mean only, as if there were no uncertainty.

The candidate of least goal cost among those outside every collision cone: a sampled velocity obstacle (Fiorini &
Shiller 1998, "Motion Planning in Dynamic Environments Using Velocity Obstacles").
"""

from math import inf

import numpy as np

from mjnav.control.base import GridController, candidate_costs
from mjnav.control.parameters import GridParameters
from mjnav.control.problem.candidates import least_violating
from mjnav.control.problem.problem import Problem
from mjnav.messages import CandidateCosts


class Mean(GridController[GridParameters]):
    """Chooses the nominal control."""

    def evaluate(self, problem: Problem) -> CandidateCosts:
        """Goal cost where the mean violates nothing, or least where all violate; infinite elsewhere."""
        total = np.where(least_violating(problem.violation), problem.goal_cost, inf)
        num, num_blocks = len(total), len(problem.cone.blocks.column)
        return candidate_costs(problem, np.zeros((num, num_blocks)), np.zeros((num, 2)), total)
