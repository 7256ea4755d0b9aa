"""Rows of episodes that were never run."""

from dataclasses import fields
from typing import Any

from mjnav.study.store import COLUMNS, Row

FIELDS = frozenset(field.name for field in fields(Row))


def labelled_row(scene: str, setting: str, method: str, seed: int, figures: dict[str, Any], **values: Any) -> Row:
    """A row with these labels and figures; `values` replace any other field."""
    place = {"scene": scene, "setting": setting, "method": method, "seed": seed}
    other = {"id": f"{scene} {setting} {method} {seed}", "study": "made up", "controller": "mean", "parameters": "{}"}
    other |= {"control": "{}", "scenario": "", "machine": "here", "revision": "1", "wall_s": 0.1, "made_with": {}}
    return Row(**{**place, **other, "figures": figures, **values})


def row(
    method: str,
    seed: int,
    cost: float,
    *,
    hit: bool = False,
    error: str | None = None,
    scene: str = "s",
    setting: str = "default",
    **columns: Any,
) -> Row:
    """A row whose figures depend on `cost`; a failed one has an error and no figures. `columns` replace any value."""
    figures = {
        **{name: 0 for name in COLUMNS if name.startswith("collisions_")},
        "collisions_person": int(hit),
        "success": not hit,
        "control_cost": cost,
        "time_s": 10.0 * cost,
        "min_clearance_m": -0.01 if hit else cost,
        "ticks": 10,
        "infeasible_ticks": int(hit),
        "compute_ms_control_p50": cost,
        "compute_ms_control_p99": 2.0 * cost,
        **{name: value for name, value in columns.items() if name not in FIELDS},
    }
    values = {name: value for name, value in columns.items() if name in FIELDS}
    return labelled_row(scene, setting, method, seed, figures if error is None else {}, error=error, **values)
