"""Every figure of a run: its definition by name, and its value under the name that `mjnav run --json` gives it."""

from collections.abc import Mapping
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Trajectory
from mjnav.metrics import consistency, effort, ending, progress, safety, social, timing, tracking
from mjnav.metrics.definitions import HIGHER, LOWER, TRUTH, Definition, FigureFunction
from mjnav.scene.spec import Scenario

# In the order in which figures are listed within their groups.
OF_RUNS: tuple[FigureFunction[..., Any], ...] = (
    *(ending.ending, safety.collision_counts, safety.fault_counts, safety.people_see_robot, ending.start),
    *(ending.duration, progress.aggregated_time, progress.failures_to_progress),
    *(progress.path_length, progress.straight_line, progress.path_ratio, progress.spl, progress.deviation),
    *(safety.clearances, safety.lane_violation),
    *(effort.command_cost, effort.smoothness, effort.stalled_time, effort.time_not_moving, effort.heading_change),
    *(social.proximity, social.min_time_to_collision, social.social_forces, ending.decisions),
    *(consistency.localization_rmse, consistency.tracking_rmse, consistency.seen_tracking_rmse),
    *(tracking.gospa, tracking.identity, consistency.robot_consistency, consistency.people_consistency),
    *(consistency.effective_sizes, consistency.kidnappings),
)
OF_EPISODES = (safety.lane_clearance, effort.time_to_avoid, ending.statuses)  # that sweeps compute beside them
# Computed where what they take is known: by the loop, and in sweeps from what is drawn.
_ELSEWHERE = (social.detour, consistency.skew_and_kurtosis, timing.compute_ms)
_GROUPS = ("ending", "path", "motion", "social", "decisions", "knowledge", "consistency", "computing")


def _grouped() -> Mapping[str, Mapping[str, Definition]]:
    """Group -> column -> definition. Raises InvalidValue for a name that two have."""
    functions = (*OF_RUNS, *OF_EPISODES, *_ELSEWHERE)
    definitions = [one for function in functions for one in function.definitions]
    groups: dict[str, dict[str, Definition]] = {name: {} for name in _GROUPS}
    for one in (*definitions, ending.STATE_HASH, *ending.SAFE_SHARES, *timing.CLOCK):
        if one.column in groups or any(one.column in group for group in groups.values()):
            raise InvalidValue("name", one.column, "a name that no other figure or group has")
        groups[one.group][one.column] = one
    return MappingProxyType({name: MappingProxyType(group) for name, group in groups.items()})


GROUPS = _grouped()  # as `mjnav compare --figure` takes them
FIGURES: Mapping[str, Definition] = MappingProxyType(
    {name: one for group in GROUPS.values() for name, one in group.items()}
)
# What `compare` computes from the columns of many episodes.
DERIVED: Mapping[str, Definition] = MappingProxyType({one.name: one for one in (
    Definition("collision", "the robot touched a person, a table, a wall or a pillar",
               type=TRUTH, better=LOWER, over_all=True),
    Definition("fault", "the robot touched a person, and it was its fault: robot_at_fault is above 0",
               type=TRUTH, better=LOWER, over_all=True, words="person hit by the robot's fault"),
    Definition("collision_moving", "the robot touched a person while it moved: collisions_moving is above 0",
               type=TRUTH, better=LOWER, over_all=True, words="person hit by the robot while moving"),
    Definition("collision_at_rest", "a person touched the robot while it stood: collisions_at_rest is above 0",
               type=TRUTH, over_all=True, words="person walked into the robot at rest"),
    Definition("collision_thing", "the robot touched a table, a wall or a pillar",
               type=TRUTH, better=LOWER, over_all=True, words="thing hit"),
    Definition("win_ratio", "pairs of the same seed in which the method did better than the reference, over those in "
               "which it did worse: a contact is worst, then a goal not reached in time; of two successes "
               "time_s decides",
               better=HIGHER, null="no pair that the method lost", source="Pocock et al. (2012)"),
    Definition("infeasible_share", "share of all ticks at which nothing met the constraints: the sum of "
               "infeasible_ticks over the sum of ticks", better=LOWER, words="ticks without a control"),
    Definition("decision_ms", "wall time of a decision: median over episodes of compute_ms_control_p50",
               better=LOWER, words="time of a decision"),
    Definition("decision_p99_ms", "wall time that 99 % of an episode's decisions keep below: median over episodes of "
               "compute_ms_control_p99", better=LOWER, words="time of a decision, p99"),
)})  # fmt: skip


def summarise(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> dict[str, Any]:
    """The figures of a run that ended with `outcome`, or goes on; None where they are undefined or not finite.

    Those of a table are a mapping of their own, as `collisions` by kind.
    """
    summary: dict[str, Any] = {}
    for name, value in measured(OF_RUNS, trajectory, scenario, outcome=outcome).items():
        table, dot, key = name.partition(".")
        if dot:
            summary.setdefault(table, {})[key] = value
        else:
            summary[name] = value
    return summary


def measured(
    functions: tuple[FigureFunction[..., Any], ...], trajectory: Trajectory, scenario: Scenario, *, outcome: str | None
) -> dict[str, Any]:
    """What these functions say of a run, by the figures' names."""
    run = {"trajectory": trajectory, "scenario": scenario, "outcome": outcome}
    success = ending.succeeded(trajectory, scenario, outcome)
    values: dict[str, Any] = {}
    with np.errstate(invalid="ignore", over="ignore"):  # where the physics broke, figures are None
        for function in functions:
            values |= function.of_run(**run, success=success)
    return {name: None if isinstance(one, float) and not isfinite(one) else one for name, one in values.items()}
