"""`mean`: the constraints at the mean only, as if there were no uncertainty.

The candidate of least goal cost among those outside every collision cone: a sampled velocity obstacle (Fiorini &
Shiller 1998, "Motion Planning in Dynamic Environments Using Velocity Obstacles").
"""

from math import inf

import numpy as np

from mjnav.control.base import GridController
from mjnav.control.nominal import least_violating
from mjnav.control.problem import Problem
from mjnav.messages import CandidateCosts


class Mean(GridController):
    """Chooses the nominal control."""

    def evaluate(self, problem: Problem) -> CandidateCosts:
        """Goal cost where the mean violates nothing, or least where all violate; infinite elsewhere."""
        o, c = problem.observation, problem.candidates
        total = np.where(least_violating(problem.violation), problem.goal, inf)
        return CandidateCosts(
            v=c.v,
            omega=c.omega,
            goal=problem.goal,
            cone=np.zeros((len(c.v), len(o.obstacles) + len(o.walls))),
            lane=np.zeros((len(c.v), 2)),
            total=total,
            nominal=problem.nominal,
        )
