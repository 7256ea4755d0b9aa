"""One run's figures under the names that `mjnav run --json` gives them."""

from math import isfinite
from typing import Any

from mjnav.messages import Trajectory
from mjnav.metrics import consistency, effort, progress, safety
from mjnav.scenarios.spec import Scenario

INFEASIBLE = ("infeasible_nominal", "infeasible")


def summarise(trajectory: Trajectory, scenario: Scenario, *, outcome: str) -> dict[str, Any]:
    """Everything that follows from what happened; a figure that is undefined is None.

    `outcome` is goal, collision, timeout or aborted. Success is the goal reached without contact.
    """
    collisions = safety.collisions(trajectory.contacts, scenario.control.period)
    mean_deviation, max_deviation = progress.deviation(trajectory, scenario)
    figures = {
        "outcome": outcome,
        "success": outcome == "goal" and not any(collisions.values()),
        "collisions": collisions,
        "lane_violation_s": safety.lane_violation(trajectory, scenario),
        "time_s": round(float(trajectory.time[-1] - trajectory.time[0]), 9),  # without the dust of binary fractions
        "path_length_m": progress.path_length(trajectory),
        "straight_line_m": progress.length(progress.way(scenario)),
        "path_ratio": progress.path_ratio(trajectory, scenario),
        "mean_deviation_m": mean_deviation,
        "max_deviation_m": max_deviation,
        "control_cost": effort.control_cost(trajectory.command, scenario.control.period),
        "min_clearance_m": safety.min_clearance(trajectory, scenario),
        "ticks": len(trajectory.status),
        "infeasible_ticks": sum(status in INFEASIBLE for status in trajectory.status),
        "clipped_ticks": trajectory.clipped_ticks,
        "localization_rmse_m": consistency.localization_rmse(trajectory),
        "tracking_rmse_m": consistency.tracking_rmse(trajectory),
    }
    return {
        name: None if isinstance(figure, float) and not isfinite(figure) else figure for name, figure in figures.items()
    }
