"""What localisation by lidar costs, by beams and particles, and how well it does: error, coverage, kidnappings.

    uv run python benchmarks/localisation.py hall rooms --seeds 3 --set sensors.lidar.model=lds-01

The first table is the CPU time of the likelihood of all particles, in ms, in the first scene. The second drives the
robot by its lidar through each scene: root mean square error of the position, share of the true positions within the
95 % ellipses, CPU time of an update. The third carries the robot away --kidnappings times, to where another drive
through the same scene begins: how often, and after how many seconds in the median, the belief is again within NEAR.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from time import process_time

import numpy as np

import mjnav
from mjnav.errors import InputError
from mjnav.loop.prepare import load_scenario
from mjnav.messages import Array, Reading
from mjnav.robot.estimation import make_localizer
from mjnav.robot.estimation.base import assumed_noise
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar

BEAMS, PARTICLES = (15, 30, 60, 120, 360), (200, 500, 2000)
INSIDE_95 = 5.991  # 95 % quantile of chi-squared with 2 degrees of freedom
NEAR, AGAIN = 0.2, 10.0  # [m] from the truth, [s] within which it has to come about
DRIVE = 12.0  # [s]


def by_lidar(scenario: Scenario, source: str = "lidar") -> Scenario:
    """The scenario with another source of the pose."""
    estimation = scenario.estimation
    return replace(scenario, estimation=replace(estimation, robot=replace(estimation.robot, source=source)))


def drive(scenario: Scenario, seconds: float) -> list[tuple[Reading, Array]]:
    """Readings and true poses of a drive by the pose sensor."""
    found: list[tuple[Reading, Array]] = []
    scenario = by_lidar(replace(scenario, stop_on_collision=False, time_limit=seconds), "pose")
    with mjnav.Simulation(scenario, log=False, scan=True) as simulation:
        while not simulation.done:
            found += [(reading, simulation.truth.robot_pose.copy()) for reading in simulation.readings]
            simulation.step(simulation.decide())
    return found


def cost(scenario: Scenario) -> Iterator[str]:
    """The first table."""
    floor, noise = floor_of_lidar(scenario), assumed_noise(scenario)["lidar.range"]
    field = LikelihoodField.of(floor, scenario.sensors.scanner, noise)
    rng = np.random.default_rng(0)
    poses = np.array(scenario.robot.start) + rng.normal(size=(max(PARTICLES), 3)) * [0.05, 0.05, 0.02]
    points = rng.normal(size=(360, 2)) * 3.0
    yield "beams" + "".join(f"{f'{num} particles':>18s}" for num in PARTICLES)
    for num_beams in BEAMS:
        beams, cells = field.beams(points, num_beams), ""
        for num in PARTICLES:
            field.log_ratio(poses[:num], beams)
            times = []
            for _ in range(20):
                start = process_time()
                field.log_ratio(poses[:num], beams)
                times.append(process_time() - start)
            cells += f"{1e3 * min(times):15.3f} ms"
        yield f"{num_beams:5d}{cells}"


def tracked(scenario: Scenario) -> tuple[float, float, float]:
    """Root mean square error [m], coverage and median CPU time of an update [ms] of one drive."""
    localizer = make_localizer(by_lidar(scenario), scenario.seed)
    errors, inside, times = [], [], []
    for reading, truth in drive(scenario, DRIVE):
        start = process_time()
        belief = localizer.update(reading)
        times.append(process_time() - start)
        error = (belief.mean - truth)[:2]
        errors.append(float(error @ error))
        inside.append(error @ np.linalg.solve(belief.covariance[:2, :2], error) < INSIDE_95)
    return float(np.sqrt(np.mean(errors))), float(np.mean(inside)), 1e3 * float(np.median(times))


def recovery(scenario: Scenario, there: Scenario) -> float:
    """Seconds after a kidnapping from which on the belief stays near the truth; inf where it does not."""
    localizer = make_localizer(by_lidar(scenario), scenario.seed)
    for reading, _ in drive(scenario, 3.0):
        localizer.update(reading)
    away = [
        float(np.hypot(*(localizer.update(reading).mean - truth)[:2])) > NEAR
        for reading, truth in drive(there, DRIVE)[1:]
    ]
    last = np.flatnonzero(away)
    seconds = 0.0 if not len(last) else float(last[-1] + 1) / scenario.sensors.rate
    return seconds if seconds <= AGAIN and not away[-1] else np.inf


def elsewhere(scene: str, overrides: list[str], rng: np.random.Generator) -> Scenario:
    """The scene with the robot at another free place, on its way to its start or its goal, whichever is farther."""
    whole = load_scenario(scene, overrides)
    ends = np.array([(wall.start, wall.end) for wall in whole.walls]).reshape(-1, 2)
    goals = np.array([whole.robot.start[:2], whole.robot.route[-1]])
    while True:
        x, y = rng.uniform(ends.min(axis=0), ends.max(axis=0)).tolist()
        goal = goals[np.hypot(*(goals - (x, y)).T).argmax()].tolist()
        start = f"robot.start=[{x}, {y}, {rng.uniform(-np.pi, np.pi)}]"
        try:
            return load_scenario(scene, [*overrides, start, f"robot.goal={goal}", "robot.preferred_speed=0.4"])
        except InputError:
            continue


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["hall"])
    parser.add_argument("--set", action="append", default=[], dest="overrides")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--kidnappings", type=int, default=0)
    arguments = parser.parse_args()
    overrides = ["physics.engine=kinematic", *arguments.overrides]
    print(*cost(load_scenario(arguments.scenes[0], overrides)), sep="\n")
    print(f"\n{'scene':>12s}{'seed':>6s}{'rmse m':>9s}{'coverage':>10s}{'update ms':>11s}")
    for scene in arguments.scenes:
        for seed in range(arguments.seeds):
            rmse, coverage, update = tracked(load_scenario(scene, [*overrides, f"seed={seed}"]))
            print(f"{scene:>12s}{seed:6d}{rmse:9.4f}{coverage:10.3f}{update:11.3f}")
    for scene in arguments.scenes * bool(arguments.kidnappings):
        rng, start = np.random.default_rng(0), load_scenario(scene, overrides)
        seconds = [recovery(start, elsewhere(scene, overrides, rng)) for _ in range(arguments.kidnappings)]
        found = np.isfinite(seconds)
        print(f"{scene}: {found.sum()} of {len(seconds)} kidnappings, median {np.median(seconds):.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
