"""Over time: whether beliefs are as sure as they may be, and how many of their particles count."""

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array, Trajectory
from mjnav.metrics.consistency import COVERED, people_nees, region, robot_nees, robot_particles
from mjnav.report.run_page.packed import Packer
from mjnav.scenarios.spec import Scenario

MOST = 1e6  # of NEES over its bound: what is infinite is drawn there


def pack_consistency(
    packer: Packer, trajectory: Trajectory, scenario: Scenario, rows: NDArray[np.intp], people_ess: Array
) -> None:
    """Packs `nees`, the NEES of the robot and the largest of people's over the bound of their 95 % region, (F, 2).

    And `ess`, the effective sample size of the robot's belief and the least of people's over the number of particles,
    (F, 2). `rows` are the frames' rows of the trajectory, of which the last is the state at its end; `people_ess` is
    the least of people's at each frame.
    """
    largest = np.fmax.reduce(people_nees(trajectory), axis=1, initial=np.nan) / region(COVERED, 4)
    nees = np.column_stack([robot_nees(trajectory) / region(COVERED, 3), largest])
    robot = trajectory.robot_ess / robot_particles(trajectory, scenario)
    ess = np.column_stack([_at(robot, rows), people_ess / scenario.estimation.obstacles.particles])
    packer.numbers("nees", np.minimum(_at(nees, rows), MOST).astype(np.float32))
    packer.numbers("ess", ess.astype(np.float32))


def _at(values: Array, rows: NDArray[np.intp]) -> Array:
    """The rows of a figure of ticks; NaN for the state at the end."""
    return np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)])[rows]
