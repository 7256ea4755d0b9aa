"""Rows of episodes that were never run."""

from typing import Any

from mjnav.study.store.row import COLUMNS, Row


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
    """One row, whose figures are told from `cost`; a failed one has an error and no figures."""
    labels = {"id": f"{scene} {setting} {method} {seed}", "scene": scene, "setting": setting, "method": method}
    labels |= {"seed": seed, "study": "made up", "revision": "1", "scenario": "", "parameters": "{}", "machine": "here"}
    if error is not None:
        return {**dict.fromkeys(COLUMNS), **labels, "error": error, **columns}
    return {
        **dict.fromkeys(COLUMNS),
        **labels,
        **{name: 0 for name in COLUMNS if name.startswith("collisions_")},
        "collisions_person": int(hit),
        "success": not hit,
        "control_cost": cost,
        "time_s": 10.0 * cost,
        "min_clearance_m": -0.01 if hit else cost,
        "ticks": 10,
        "infeasible_ticks": int(hit),
        "compute_ms_control_p50": cost,
        **columns,
    }
