"""What figures are called, their units, and what they are: the definitions are those of the columns of a sweep."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from mjnav.study.store.row import COLUMNS


class FigureName(NamedTuple):
    """A figure in words, and its unit: "" where it has none."""

    words: str
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.words} [{self.unit}]" if self.unit else self.words


# By column of a sweep's rows, and what comparisons add to those. Rates and shares are shown in per cent.
FIGURE_NAMES: Mapping[str, FigureName] = MappingProxyType(
    {
        "success": FigureName("success", "%"),
        "collision": FigureName("collision", "%"),
        "infeasible_share": FigureName("ticks without a control", "%"),
        "decision_ms": FigureName("time of a decision", "ms"),
        "time_s": FigureName("time to the goal", "s"),
        "control_cost": FigureName("control cost", "m²/s³"),
        "mean_deviation_m": FigureName("mean deviation", "m"),
        "max_deviation_m": FigureName("greatest deviation", "m"),
        "path_ratio": FigureName("path over straight line"),
        "min_clearance_m": FigureName("least clearance", "m"),
        "min_lane_clearance_m": FigureName("least distance from the lane's edge", "m"),
        "mean_lane_clearance_m": FigureName("mean distance from the lane's edge", "m"),
        "lane_violation_s": FigureName("time over a lane's edge", "s"),
        "localization_rmse_m": FigureName("error of the robot's belief", "m"),
        "tracking_rmse_m": FigureName("error of beliefs of people", "m"),
        "mean_safe_share": FigureName("mean share of safe samples"),
        "min_safe_share": FigureName("least share of safe samples"),
    }
)
_UNITS: Mapping[str, str] = MappingProxyType({"_s": "s", "_m": "m", "_ms": "ms"})  # at the end of a column's name
_QUANTILES: Mapping[str, str] = MappingProxyType(
    {"_p50": "median over ticks", "_p99": "99 % of ticks are below", "_max": "the longest of all ticks"}
)
# What is no column of a sweep, or not of one episode.
_DEFINITIONS: Mapping[str, str] = MappingProxyType(
    {
        "collision": "the robot touched a person, a table, a wall or a pillar",
        "infeasible_share": "share of all ticks at which nothing met the constraints",
        "infeasible_ticks": "ticks at which nothing met the constraints",
        "decision_ms": "wall time of a decision: median over episodes of their median over ticks",
        "success": "the goal was reached in time without contact",
    }
)
_PHASES: Mapping[str, str] = MappingProxyType(
    {
        "control": "wall time of a decision of the controller",
        "tick": "wall time of a whole tick, all phases together",
    }
)


def figure_name(column: str) -> FigureName:
    """The words and the unit of a column; of one that has no words of its own, its name and the unit at its end."""
    if column in FIGURE_NAMES:
        return FIGURE_NAMES[column]
    for end, unit in _UNITS.items():
        if column.endswith(end):
            return FigureName(column.removesuffix(end).replace("_", " "), unit)
    return FigureName(column.replace("_", " "))


def definition(key: str) -> str:
    """What a figure is, by its column or its key in `mjnav inspect --json`; "" where nothing is known of it."""
    column = key.removeprefix("figures.").removeprefix("timing.").removeprefix("result.").replace(".", "_")
    if column in _DEFINITIONS:
        return _DEFINITIONS[column]
    text = COLUMNS[column].text if column in COLUMNS else ""
    for end, quantile in _QUANTILES.items():
        if text and column.endswith(end):
            phase = column.removeprefix("compute_ms_").removesuffix(end)
            return f"{_PHASES.get(phase, f'wall time of the phase {phase!r} of a tick')}; {quantile}"
    return text
