"""A run's figures as an HTML table, for notebooks."""

from collections.abc import Iterator, Mapping
from html import escape
from types import MappingProxyType
from typing import Any

# key of the summary -> what it is, and its form
_ROWS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "time_s": ("time", "{:.1f} s"),
        "min_clearance_m": ("least clearance", "{:.2f} m"),
        "min_human_distance_m": ("least distance from people", "{:.2f} m"),
        "path_length_m": ("path", "{:.2f} m"),
        "mean_deviation_m": ("mean deviation", "{:.2f} m"),
        "max_deviation_m": ("largest deviation", "{:.2f} m"),
        "control_cost": ("control cost", "{:.2f} m²/s³"),
        "localization_rmse_m": ("robot's estimate, RMSE", "{:.3f} m"),
        "tracking_rmse_m": ("people's estimates, RMSE", "{:.3f} m"),
        "real_time_factor": ("speed", "{:.1f} × real time"),
    }
)


def result_table(summary: Mapping[str, Any]) -> str:
    """The table of a summary as `Result.summary` gives it; figures that are undefined are left out."""
    rows = (f"<tr><th scope='row'>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in _rows(summary))
    title = f"{summary['scene']}, {summary['controller']}, seed {summary['seed']}: {summary['outcome']}"
    return f"<table><caption>{escape(title)}</caption><tbody>{''.join(rows)}</tbody></table>"


def _rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "collisions", ", ".join(f"{n} × {kind}" for kind, n in summary["collisions"].items() if n) or "none"
    for key, (name, form) in _ROWS.items():
        if summary[key] is not None:
            yield name, form.format(summary[key])
    if summary["people_see_robot"] is not None:
        yield "people who see the robot", str(summary["people_see_robot"])
    yield "infeasible", f"{summary['infeasible_ticks']} of {summary['ticks']} ticks"
    for name, value in summary["metrics"].items():
        if value is not None:
            yield name, f"{value:.4g}"
    if summary["log"]:
        yield "log", str(summary["log"])
