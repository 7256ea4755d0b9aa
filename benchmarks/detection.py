"""What a scan shows of people: recall, error and coverage by distance and visibility, false detections, and the cost.

    uv run python benchmarks/detection.py hall office --set sensors.lidar.model=lds-02

The robot drives about in the kinematic engine, and the detector is given its true pose with Gaussian noise of the
--pose std and that covariance. A person counts as found where a detection is nearer than NEAR to where they were when
its beams were taken; each detection counts for one person. Errors are along the line of sight and across it, with their
predicted standard deviations; coverage is the share of the errors within the 95 % ellipse. The cost is the median of
the wall time of `Detector.detect`, and of `visible` for five discs, in ms.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from time import perf_counter

import numpy as np
from scipy.optimize import linear_sum_assignment

from mjnav.loop.prepare import load_scenario
from mjnav.messages import Array, RobotBelief, WorldState
from mjnav.robot.estimation.lidar.detector import Detector, ScanDetections
from mjnav.scene.spec import Scenario
from mjnav.world.simulator import Simulator

PERIOD = 0.1  # [s]
NEAR = 0.5  # [m]
INSIDE_95 = 5.991  # 95 % quantile of chi-squared with 2 degrees of freedom
DISTANCES = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)  # [m]
VISIBLE = (0.02, 0.3, 0.9, 1.01)  # share of the silhouette
REPEATS = 5  # of a timed call, of which the quickest counts
RADIUS = 0.3  # [m] of the discs that `visible` is asked for


@dataclass
class Tally:
    """What was seen, a row for each person and scan: distance, visible, found, along, across, their stds, inside."""

    rows: list[tuple[float, ...]] = field(default_factory=list)
    scans: int = 0
    false: int = 0
    detect: list[float] = field(default_factory=list)  # [ms]
    visible: list[float] = field(default_factory=list)  # [ms]

    def add(self, truth: WorldState, scan: ScanDetections) -> None:
        """One scan."""
        there = ~np.isnan(truth.people_position[:, 0])
        people, velocity = truth.people_position[there], truth.people_velocity[there]
        places = np.array([d.position for d in scan.detections]).reshape(-1, 2)
        ages = truth.time - np.array([d.time for d in scan.detections])
        then = people[:, None] - ages[:, None] * velocity[:, None]  # (P, D, 2)
        away = np.linalg.norm(then - places, axis=2)
        pairs = zip(*linear_sum_assignment(np.minimum(away, NEAR)), strict=True)
        found = {int(i): int(j) for i, j in pairs if away[i, j] < NEAR}
        self.scans += 1
        self.false += len(scan.detections) - len(found)
        for i, share in enumerate(scan.visible(people, RADIUS)):
            ray = people[i] - truth.robot_pose[:2]
            distance = float(np.hypot(*ray))
            row = (distance, float(share), float(i in found))
            if i not in found:
                self.rows.append((*row, *[np.nan] * 5))
                continue
            detection = scan.detections[found[i]]
            error = detection.position - then[i, found[i]]
            u = ray / distance
            axes = np.array([u, (-u[1], u[0])])
            stds = np.sqrt(np.diag(axes @ detection.covariance @ axes.T))
            inside = error @ np.linalg.solve(detection.covariance, error) < INSIDE_95
            self.rows.append((*row, *(axes @ error), *stds, float(inside)))

    def lines(self) -> Iterator[str]:
        """The table."""
        yield f"{'distance':>12s}{'visible':>12s}{'n':>7s}{'recall':>8s}{'rmse':>8s}{'along std, predicted':>22s}" + (
            f"{'across std, predicted':>23s}{'coverage':>10s}"
        )
        rows = np.array(self.rows).reshape(-1, 8)
        for near, far in pairwise(DISTANCES):
            for low, high in pairwise(VISIBLE):
                chosen = rows[(near <= rows[:, 0]) & (rows[:, 0] < far) & (low <= rows[:, 1]) & (rows[:, 1] < high)]
                seen = chosen[chosen[:, 2] == 1.0]
                if not len(seen):
                    continue
                errors, stds = seen[:, 3:5], seen[:, 5:7].mean(axis=0)
                rmse, spread = np.sqrt((errors**2).sum(axis=1).mean()), errors.std(axis=0)
                yield f"{near:6.0f}-{far:3.0f} m{low:8.2f}-{min(high, 1.0):.1f}{len(chosen):7d}" + (
                    f"{len(seen) / len(chosen):8.3f}{rmse:8.3f}{spread[0]:13.3f}{stds[0]:9.3f}"
                    f"{spread[1]:14.3f}{stds[1]:9.3f}{seen[:, 7].mean():10.3f}"
                )
        hidden = rows[rows[:, 1] < VISIBLE[0]]
        yield f"found where less than {VISIBLE[0]:.0%} is visible: {int(hidden[:, 2].sum())} of {len(hidden)}"
        yield f"false detections a scan: {self.false / max(self.scans, 1):.4f} in {self.scans} scans"


def drive(scenario: Scenario, duration: float, pose_std: Array, tally: Tally) -> None:
    """One episode."""
    simulator, detector = Simulator(scenario, scenario.seed), Detector.of(scenario)
    rng = np.random.default_rng(scenario.seed)
    while simulator.time < duration:
        v, omega = 0.5 * np.sin(0.3 * simulator.time + scenario.seed), 0.6 * np.sin(0.5 * simulator.time)
        simulator.advance(PERIOD, (v, omega))
        truth = simulator.state()
        for reading in simulator.sense():
            if not reading.scan.size or reading.time < truth.time:
                detector.follow(reading)
                continue
            pose = truth.robot_pose + pose_std * rng.standard_normal(3)
            belief = RobotBelief(reading.time, pose[None], np.ones(1), pose, np.diag(pose_std**2), 1.0)
            scan = detector.detect(reading, belief)
            tally.add(truth, scan)
            points = rng.uniform(-5.0, 5.0, (5, 2))
            tally.visible.append(quickest(lambda s=scan, p=points: s.visible(p, RADIUS)))
            again = Detector.of(scenario)
            again.follow(reading)
            tally.detect.append(quickest(lambda r=reading, b=belief, d=again: d.detect(r, b)))


def quickest(call: Callable[[], object]) -> float:
    """[ms]"""
    times = []
    for _ in range(REPEATS):
        began = perf_counter()
        call()
        times.append(perf_counter() - began)
    return 1e3 * min(times)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["hall"])
    parser.add_argument("--set", action="append", default=[], dest="overrides")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--duration", type=float, default=15.0, help="simulated [s] of an episode")
    parser.add_argument("--pose", type=float, nargs=3, default=(0.02, 0.02, 0.01), help="std of x, y [m] and heading")
    parser.add_argument("--cost", action="store_true", help="the cost alone, by beams and people")
    arguments = parser.parse_args()
    pose_std = np.array(arguments.pose)
    for scene in arguments.scenes:
        if arguments.cost:
            print(f"\n{scene}\n{'beams':>6s}{'people':>8s}{'detect ms':>11s}{'p99':>8s}{'5 visible ms':>14s}")
            for beams in (90, 180, 360, 720, 1440):
                report_cost(scene, [*arguments.overrides, f"sensors.lidar_beams={beams}"], pose_std, beams)
            continue
        tally = Tally()
        for seed in range(arguments.seeds):
            scenario = load_scenario(scene, ["physics.engine=kinematic", f"seed={seed}", *arguments.overrides])
            drive(scenario, arguments.duration, pose_std, tally)
        print(f"\n{scene} {' '.join(arguments.overrides)}")
        print(*tally.lines(), sep="\n")
        print(f"detect {np.median(tally.detect):.3f} ms, visible {np.median(tally.visible):.3f} ms")
    return 0


def report_cost(scene: str, overrides: list[str], pose_std: Array, beams: int) -> None:
    """A line for all people of the scene, one for half of them and one for none."""
    whole = load_scenario(scene, ["physics.engine=kinematic", *overrides])
    num = len(whole.people)
    for people in sorted({0, num // 2, num}):
        tally = Tally()
        drive(replace(whole, people=whole.people[:people]), 3.0, pose_std, tally)
        print(
            f"{beams:6d}{people:8d}{np.median(tally.detect):11.3f}{np.quantile(tally.detect, 0.99):8.3f}"
            f"{np.median(tally.visible):14.3f}"
        )


if __name__ == "__main__":
    sys.exit(main())
