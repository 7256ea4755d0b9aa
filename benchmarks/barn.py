"""BARN's worlds (Perille et al. 2020) by the challenge's protocol and score, world by world, for several methods.

    python benchmarks/barn.py FOLDER [--method NAME ...] [--seeds N] [--told] [--no-route] [--worlds N ...]
        [--set KEY=VALUE ...]

FOLDER has world_N.world, and path_N.npy, the published reference path, beside each. From (-2.25, 3) towards a goal 10 m
ahead, which is reached within 1 m, in 100 s, at 2 m/s at most. The clock starts after 0.1 m. With T_o = path / 2 m/s,

    score = T_o / clip(T, 2 T_o, 8 T_o) of a success, 0 of all else: 0.5 at most         (the clip from 2025 on)

and with the clip of before, 4 T_o in place of 2 T_o, 0.25 at most. Scores are means over worlds of their means. These
are BARN's worlds in MuJoCo with mjnav's robot, and no entries of the challenge, which drives a Jackal in Gazebo.

By default the robot has no map: it draws one by a lidar of 270 degrees and 720 beams, with the noise `pearson` on
lidar, wheels and gyro. `--told` gives it the exact map and a pose sensor with that noise. Without `--method` it is
`rkhs-plan`, and `mppi`, `dwa` and `rkhs` by their classes' defaults, which are not those of their names.
"""

import argparse
import re
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context
from os import cpu_count
from pathlib import Path

import numpy as np

import mjnav
from mjnav.scene.overrides import Override

START, GOAL = [-2.25, 3.0, np.pi / 2.0], [-2.25, 13.0]
FAST = {"robot.max_speed": 2.0, "robot.preferred_speed": 2.0, "robot.max_acceleration": 2.0}
PROTOCOL = {**FAST, "robot.start": START, "robot.goal": GOAL, "robot.goal_tolerance": 1.0, "time_limit": 100.0}
ROUTE = {"route.planner": "shortest"}
LIDAR = {
    "estimation.map.source": "lidar",
    "estimation.robot.source": "lidar",
    "estimation.obstacles.source": "lidar",
    "sensors.lidar": {"model": "ideal", "beams": 720, "field_of_view": 1.5 * np.pi, "max_range": 30.0},
}
MOVED = 0.1  # [m] after which the clock starts
BY_CLASS = {
    f"mjnav.control.methods.{place}": name
    for place, name in (("mppi:Mppi", "mppi"), ("dwa:Dwa", "dwa"), ("rkhs:Rkhs", "rkhs"))
}
CELL, CORNER = 0.15, np.array([-4.575, 5.075])  # [m] of a reference path's grid


def path_length(file: Path) -> float:
    """Of a reference path from the start to the goal [m]."""
    cells = np.load(file)
    points = np.vstack([START[:2], CELL * cells + CORNER, GOAL])
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def drive(world: Path, method: str, seed: int, told: bool, route: bool, more: list[str]) -> tuple[str, float]:
    """The outcome of a run, and its time [s] on the challenge's clock."""
    overrides = {**PROTOCOL, **(ROUTE if route else {}), **({} if told else LIDAR)}
    given = [*(Override(*item) for item in overrides.items()), *more]
    result = mjnav.run(mjnav.load_scenario(str(world), given, controller=method, seed=seed), log=False)
    away = np.hypot(*(result.trajectory.robot_pose[:, :2] - START[:2]).T)
    begun = result.trajectory.time[int(np.argmax(away > MOVED))]
    return result.summary["outcome"], float(result.summary["time_s"] - begun)


def main() -> None:
    """Runs all and prints a row for each world, and the means of each method."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--method", nargs="+", default=["rkhs-plan", *BY_CLASS])
    parser.add_argument("--worlds", nargs="+", type=int, help="numbers of worlds; all in the folder by default")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--told", action="store_true", help="with the exact map and a pose sensor")
    parser.add_argument("--no-route", action="store_true", help="methods drive straight to the goal")
    parser.add_argument("--set", action="append", default=[], help="any key of the run file, KEY=VALUE")
    parser.add_argument("--workers", type=int, default=cpu_count())
    options = parser.parse_args()
    found = {int(re.findall(r"\d+", file.stem)[-1]): file for file in options.folder.glob("world_*.world")}
    worlds = {n: found[n] for n in sorted(options.worlds or found)}
    best = {n: path_length(options.folder / f"path_{n}.npy") / 2.0 for n in worlds}
    jobs = list(product(options.method, worlds, range(1, options.seeds + 1)))
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        runs = pool.map(
            drive,
            *zip(
                *((worlds[n], m, s, options.told, not options.no_route, options.set) for m, n, s in jobs), strict=True
            ),
        )
        rows = [(m, n, outcome, time) for (m, n, _), (outcome, time) in zip(jobs, runs, strict=True)]
    print("method       world  success  collision  time-out  time [s]  score  score to 2024")
    for method in options.method:
        means = []
        for n in worlds:
            own = [(outcome, time) for m, w, outcome, time in rows if (m, w) == (method, n)]
            shares = [np.mean([outcome == kind for outcome, _ in own]) for kind in ("goal", "collision", "timeout")]
            times = [time for outcome, time in own if outcome == "goal"]
            scores = [
                np.mean([best[n] / np.clip(t, k * best[n], 8.0 * best[n]) * (o == "goal") for o, t in own])
                for k in (2.0, 4.0)
            ]
            means.append([*shares, np.mean(times) if times else np.nan, *scores])
            print(row(BY_CLASS.get(method, method), str(n), means[-1]))
        print(row(BY_CLASS.get(method, method), "all", [*np.nanmean(means, axis=0)]))


def row(method: str, world: str, figures: list[float]) -> str:
    """A line of the table."""
    success, collision, timeout, time, score, old = figures
    return (
        f"{method:12} {world:>5} {success:8.3f} {collision:10.3f} {timeout:9.3f} {time:9.1f} {score:6.3f} {old:14.3f}"
    )


if __name__ == "__main__":
    main()
