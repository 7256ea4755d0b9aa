"""One run's figures under the names that `mjnav run --json` gives them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

from mjnav.messages import Trajectory
from mjnav.metrics import consistency, effort, progress, safety
from mjnav.scenarios.spec import Scenario

INFEASIBLE = ("infeasible_nominal", "infeasible")


@dataclass(frozen=True, slots=True)
class Figures:
    """What follows from a trajectory. A figure that is undefined, or not finite, is None."""

    outcome: str | None  # goal, collision, timeout or aborted; None while it goes on
    success: bool  # the goal reached without contact
    collisions: Mapping[str, int]  # by the kind of what was touched
    lane_violation_s: float | None
    time_s: float
    path_length_m: float | None
    straight_line_m: float | None
    path_ratio: float | None
    mean_deviation_m: float | None
    max_deviation_m: float | None
    control_cost: float | None
    min_clearance_m: float | None
    ticks: int
    infeasible_ticks: int
    clipped_ticks: int
    localization_rmse_m: float | None
    tracking_rmse_m: float | None


def summarise(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> Figures:
    """The figures of a run that ended with `outcome`, or goes on."""
    collisions = safety.collisions(trajectory.contacts, scenario.control.period)
    mean_deviation, max_deviation = progress.deviation(trajectory, scenario)
    return Figures(
        outcome=outcome,
        success=outcome == "goal" and not any(collisions.values()),
        collisions=collisions,
        lane_violation_s=_finite(safety.lane_violation(trajectory, scenario)),
        time_s=round(float(trajectory.time[-1] - trajectory.time[0]), 9),  # sums of periods have rounding errors
        path_length_m=_finite(progress.path_length(trajectory)),
        straight_line_m=_finite(progress.length(progress.way(scenario))),
        path_ratio=_finite(progress.path_ratio(trajectory, scenario)),
        mean_deviation_m=_finite(mean_deviation),
        max_deviation_m=_finite(max_deviation),
        control_cost=_finite(effort.control_cost(trajectory.command, scenario.control.period)),
        min_clearance_m=_finite(safety.min_clearance(trajectory, scenario)),
        ticks=len(trajectory.status),
        infeasible_ticks=sum(status in INFEASIBLE for status in trajectory.status),
        clipped_ticks=trajectory.clipped_ticks,
        localization_rmse_m=_finite(consistency.localization_rmse(trajectory)),
        tracking_rmse_m=_finite(consistency.tracking_rmse(trajectory)),
    )


def _finite(figure: float | None) -> float | None:
    return figure if figure is not None and isfinite(figure) else None
