"""How far replayed and reacting people are from their recorded tracks, because they are discs and do not overlap.

    MJNAV_PEOPLE_DATA=FOLDER uv run python benchmarks/replay_deviation.py [--react] [--engine mujoco]

Of every recording in the folder all windows of 30 s are walked through, with the robot 200 m away.
"""

import argparse
import os
from pathlib import Path

import numpy as np

from mjnav.cli.terminal import print_table
from mjnav.messages import Array
from mjnav.scene.crowd import Crowd, Track, TrackSplines, in_window, people_of
from mjnav.scene.crowd_import import import_crowd
from mjnav.scene.load import loads
from mjnav.scene.spec import Scenario
from mjnav.scene.toml import toml_text
from mjnav.world.simulator import Simulator

FRAME_RATE = 25.0  # [Hz] of ETH and UCY
LENGTH = 30.0  # [s] of a window
EVERY = 0.1  # [s]
OFF = 0.05  # [m] from the track, beyond which somebody is off it


def deviations(tracks: list[Track], scenario: Scenario, first: float, last: float) -> Array:
    """Distance [m] of each person from their track at each moment, (T, P); NaN for who is not in the recording.

    Inf for who should be there and is not.
    """
    simulator = Simulator(scenario, 0, lidar=False)
    splines = TrackSplines([track.rows for track in tracks])
    comes = np.array([track.rows[0, 0] for track in tracks])
    goes = np.array([track.rows[-1, 0] for track in tracks])
    found = []
    while first + simulator.time < last - 1e-6:
        time = first + simulator.time
        distance = np.hypot(*(simulator.state().people_position - splines.positions(time)).T)
        found.append(np.where((comes <= time) & (time < goes), np.nan_to_num(distance, nan=np.inf), np.nan))
        simulator.advance(EVERY, (0.0, 0.0))
    return np.array(found)


def measured(path: Path, people: str, engine: str, radius: float) -> tuple[str, ...]:
    """A row of the table."""
    imported = import_crowd(path, {"frame_rate": FRAME_RATE}, LENGTH)
    end = max(track.rows[-1, 0] for track in imported.tracks.tracks)
    windows = num = touched = 0
    all_of_them = []
    for first in np.arange(0.0, end - LENGTH + 1e-9, LENGTH):
        tracks = in_window(imported.tracks.tracks, first, first + LENGTH)
        if not tracks:
            continue
        crowd = Crowd(str(path), FRAME_RATE, window=(first, first + LENGTH), people=people, radius=radius)
        tables = {
            "schema": 1,
            "name": "deviation",
            "robot": {"start": [200.0, 0.0, 0.0], "goal": [210.0, 0.0]},
            "physics": {"engine": engine},
            "people": people_of(crowd, path),
        }
        found = deviations(tracks, loads(toml_text(tables)), float(first), float(first + LENGTH))
        windows, num = windows + 1, num + len(tracks)
        touched += int((np.nan_to_num(found, posinf=0.0).max(axis=0) > OFF).sum())
        all_of_them.append(found[~np.isnan(found)])
    found = np.concatenate(all_of_them)
    there = found[np.isfinite(found)]
    return (
        path.stem,
        f"{radius:g}",
        str(windows),
        str(num),
        f"{there.mean():.4f}",
        f"{np.quantile(there, 0.99):.3f}",
        f"{there.max():.2f}",
        f"{100.0 * (there > OFF).mean():.1f}",
        f"{100.0 * touched / num:.1f}",
        f"{100.0 * np.isinf(found).mean():.1f}",
    )


def main() -> None:
    """Prints a row for each recording and radius."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--react", action="store_true")
    parser.add_argument("--engine", default="kinematic")
    parser.add_argument("--radius", type=float, nargs="+", default=[0.2, 0.25, 0.3])
    arguments = parser.parse_args()
    heads = (
        "recording",
        "radius",
        "windows",
        "people",
        "mean m",
        "99 % m",
        "max m",
        "off %",
        "people off %",
        "absent %",
    )
    recordings = sorted(Path(os.environ["MJNAV_PEOPLE_DATA"]).glob("*.txt"))
    people = "react" if arguments.react else "replay"
    rows = [measured(path, people, arguments.engine, radius) for path in recordings for radius in arguments.radius]
    print_table(rows, heads, numbers=range(1, len(heads)))


if __name__ == "__main__":
    main()
