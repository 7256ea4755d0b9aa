"""One episode as a flat row: the columns of the store, fixed for every study.

A figure that is undefined is null, and so are all of a failed episode, whose `error` says why.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from mjnav.loop.provenance.facts import FACTS

Row = dict[str, Any]

ROW_SCHEMA = 2  # of these columns; rows of the first one do not say it

STRING, INTEGER, NUMBER, TRUTH = "string", "int64", "double", "bool"

# column -> (Arrow type, what it says)
LABELS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "id": (
            STRING,
            "the episode: a hash of its labels, scenario, parameters and seed, and of all facts that decide its bits",
        ),
        "study": (STRING, "the study file's name"),
        "scene": (STRING, "the scene's name"),
        "setting": (STRING, "the setting's name and swept values of the study's grid; default without either"),
        "method": (STRING, "the method's name and swept values"),
        "seed": (INTEGER, ""),
        "controller": (STRING, "control.method"),
        "parameters": (STRING, 'the swept values by key as JSON: {"control.weight": 0.3}'),
        "control": (STRING, "every parameter of the controller with its value, as JSON"),
        "scenario": (STRING, "the run file, every default explicit; `mjnav run` repeats the episode with it and seed"),
    }
)
FIGURES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "error": (STRING, "why there is no result, in a line; null where there is one"),
        "outcome": (STRING, "goal, collision, timeout or aborted"),
        "success": (TRUTH, "the goal, without contact, in time"),
        **{f"collisions_{kind}": (INTEGER, "contacts") for kind in ("person", "table", "wall", "pillar")},
        "lane_violation_s": (NUMBER, "time over a lane's boundary; null without lanes"),
        "min_lane_clearance_m": (NUMBER, "the robot's edge to the nearer boundary; null without lanes"),
        "mean_lane_clearance_m": (NUMBER, "the same, mean over time"),
        "time_s": (NUMBER, "simulated time to the end"),
        "path_length_m": (NUMBER, ""),
        "straight_line_m": (NUMBER, "length of the way over the waypoints"),
        "path_ratio": (NUMBER, "path over way"),
        "mean_deviation_m": (NUMBER, "lateral distance from the way, mean over time"),
        "max_deviation_m": (NUMBER, ""),
        "control_cost": (NUMBER, "m^2/s^3"),
        "min_clearance_m": (NUMBER, "surface to surface; null in an empty room"),
        "time_to_avoid_s": (NUMBER, "from the nominal control's first leaving of the way to its last; null without"),
        "ticks": (INTEGER, ""),
        "infeasible_ticks": (INTEGER, "the two below"),
        "ticks_without_nominal": (INTEGER, "status infeasible_nominal: nothing met the constraints at the mean"),
        "ticks_without_own": (INTEGER, "status infeasible: nothing met the method's own constraint"),
        "stopped_ticks": (INTEGER, "status stopped"),
        "clipped_ticks": (INTEGER, "ticks whose decision was beyond the robot's limits"),
        "localization_rmse_m": (NUMBER, ""),
        "tracking_rmse_m": (NUMBER, "null where nobody was tracked"),
        "robot_skew": (NUMBER, "of the robot samples' x and y that the controller got"),
        "robot_kurtosis": (NUMBER, "3 for a Gaussian"),
        "people_skew": (NUMBER, "the same of people's samples; null without people"),
        "people_kurtosis": (NUMBER, ""),
        "min_safe_share": (NUMBER, "of the closest obstacle's samples at the chosen control, least over ticks"),
        "mean_safe_share": (NUMBER, "mean over ticks; null where the method never met an obstacle"),
        **{
            f"compute_ms_{phase}_{level}": (NUMBER, "wall time of a tick's phase")
            for phase in ("sense", "estimate", "control", "record", "tick")
            for level in ("p50", "p99", "max")
        },
        "real_time_factor": (NUMBER, ""),
        "deadline_misses": (INTEGER, "0 without a pacer"),
        "state_hash": (STRING, "of everything that happened: equal where the episode was the same"),
    }
)
PLACE: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "wall_s": (NUMBER, "the episode's own wall time"),
        "machine": (STRING, "the host's name"),
        "revision": (STRING, "mjnav's version and git revision"),
    }
)
# What decides an episode's bits beside its labels: column -> the fact of `loop.provenance` that it holds.
MADE_WITH: Mapping[str, str] = MappingProxyType({fact.replace(".", "_"): fact for fact in FACTS})
COLUMNS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        **LABELS,
        **FIGURES,
        **PLACE,
        "row_schema": (INTEGER, "the version of these columns"),
        **{column: (STRING, FACTS[fact][1]) for column, fact in MADE_WITH.items()},
    }
)
CELL = ("study", "scene", "setting", "method")  # the labels that the rows of one cell share
PLACE_IN_STUDY = (*CELL, "seed")  # the labels of one episode


def made_with(row: Mapping[str, Any]) -> dict[str, str | None]:
    """The facts that a row carries; None where the version of mjnav that wrote it did not record them."""
    return {fact: row.get(column) for column, fact in MADE_WITH.items()}


def flatten(summary: Mapping[str, Any], prefix: str = "") -> Row:
    """A run's summary with one key a figure: compute_ms_control_p50."""
    row: Row = {}
    for key, value in summary.items():
        row |= flatten(value, f"{prefix}{key}_") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return row
