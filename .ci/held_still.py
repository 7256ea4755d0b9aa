"""What a change of the code's form must not change: states, figures and keys of short runs.

    uv run python .ci/held_still.py write FILE        # before the change
    uv run python .ci/held_still.py compare FILE      # after it: exits with 1 where something differs

12 scenes x 4 methods x 2 engines x told or by lidar, 3 s each: the state hash and the keys of `mjnav run --json` must
be equal, every figure equal to 1e-9. Figures of the wall clock and of the installation are left out.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import mjnav
from mjnav.errors import MjnavError

SCENES = (
    "hall",
    "hall-lidar",
    "crossing3",
    "table",
    "lane",
    "rooms",
    "crowds",
    "corridor12",
    "doorway",
    "office",
    "blind7",
    "robot_crowding",
)
METHODS = ("rkhs", "rkhs-plan", "orca", "mppi")
ENGINES = ("mujoco", "kinematic")
SOURCES = ("told", "lidar")
CLOCK = (
    "ms",
    "seconds",
    "real_time",
    "deadline",
    "jitter",
    "version",
    "digest",
    "revision",
    "scenario",
    "log",
    "replay",
)
TOLERANCE = 1e-9


def _figures(scene: str, method: str, engine: str, source: str) -> dict[str, Any]:
    lidar = {f"estimation.{what}.source": "lidar" for what in ("robot", "obstacles")} if source == "lidar" else {}
    sensors = {"sensors.lidar": {"model": "rplidar-a1"}} if source == "lidar" else {}
    overrides = {"time_limit": 3.0, "seed": 3, "control.method": method, "physics.engine": engine, **sensors, **lidar}
    try:
        scenario = mjnav.load_scenario(scene, overrides)
        return dict(mjnav.run(scenario, log=None).summary)
    except MjnavError as error:
        return {"error": str(error)}


def _measured() -> dict[str, Any]:
    cases = [(s, m, e, o) for s in SCENES for m in METHODS for e in ENGINES for o in SOURCES]
    return {" ".join(case): json.loads(json.dumps(_figures(*case))) for case in cases}


def _differences(name: str, before: Any, after: Any) -> list[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        keys = sorted(before.keys() | after.keys())
        lost = [f"{name}.{key}: only {'before' if key in before else 'after'}" for key in before.keys() ^ after.keys()]
        common = [key for key in keys if key in before and key in after and not any(word in key for word in CLOCK)]
        return lost + [line for key in common for line in _differences(f"{name}.{key}", before[key], after[key])]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        pairs = enumerate(zip(before, after, strict=True))
        return [line for i, pair in pairs for line in _differences(f"{name}.{i}", *pair)]
    if (
        isinstance(before, float)
        and isinstance(after, float)
        and abs(before - after) <= TOLERANCE * max(1, abs(before))
    ):
        return []
    return [] if before == after else [f"{name}: {before!r} -> {after!r}"]


def main() -> int:
    """Writes the figures, or says where they differ from those in the file."""
    parser = argparse.ArgumentParser()
    parser.add_argument("action", choices=("write", "compare"))
    parser.add_argument("file", type=Path)
    given = parser.parse_args()
    measured = _measured()
    if given.action == "write":
        given.file.write_text(json.dumps(measured, indent=1))
        return 0
    lines = _differences("", json.loads(given.file.read_text()), measured)
    print("\n".join(lines[:60]) or f"{len(measured)} runs as before")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
