"""What the lidar costs: one scan by beams, people and engine, and a simulated second by model; ratios of one process.

    uv run python benchmarks/lidar.py

CPU time of this process; the least of several rounds counts.
"""

import argparse
import sys
from collections.abc import Callable
from time import process_time

import numpy as np

from mjnav.scene.sensors import LIDARS, LidarSpec
from mjnav.scene.spec import ConstantVelocity, Noise, Person, Physics, Pillar, Robot, Scenario, Sensors, Table, Wall
from mjnav.world.simulator import Simulator

ENGINES = ("mujoco", "kinematic")
BEAMS, PEOPLE = (180, 360, 1081, 3243), (0, 10, 100)  # 3243: three rays for each of 1081 beams
ROUNDS = 5


def hall(engine: str, num_people: int, lidar: LidarSpec | None = None) -> Scenario:
    """A walled room with a table, two pillars and people on a grid who stand or walk slowly."""
    corners = ((-12.0, -12.0), (12.0, -12.0), (12.0, 12.0), (-12.0, 12.0))
    walls = tuple(Wall(corner, corners[(i + 1) % 4]) for i, corner in enumerate(corners))
    places = [(x, y) for y in np.arange(-10.5, 11.0, 1.9) for x in np.arange(-10.5, 11.0, 1.9) if np.hypot(x, y) > 2.0]
    chosen = places[:: max(1, len(places) // max(num_people, 1))][:num_people]
    return Scenario(
        "lidar",
        Robot((0.0, 0.0, 0.0), (9.0, 0.0)),
        walls=walls,
        tables=(Table((1.5, 1.5)),),
        pillars=(Pillar((-1.5, 1.0)), Pillar((1.0, -1.5))),
        people=tuple(Person((float(x), float(y)), ConstantVelocity((0.1, 0.0))) for x, y in chosen),
        noise=Noise("pearson"),
        sensors=Sensors(lidar=lidar),
        physics=Physics(engine),
    )


def least(run: Callable[[], object], calls: int) -> float:
    """CPU time [s] of one call."""
    run()
    found = []
    for _ in range(ROUNDS):
        begin = process_time()
        for _ in range(calls):
            run()
        found.append((process_time() - begin) / calls)
    return min(found)


def print_scans(calls: int) -> None:
    """One scan of exact ranges."""
    unit = None
    print("one scan, exact ranges: CPU time [us], and in units of the first row's")
    for engine in ENGINES:
        for num_people in PEOPLE:
            simulator = Simulator(hall(engine, num_people), 0, lidar=False)
            for num_beams in BEAMS:
                angles = np.linspace(-np.pi, np.pi, num_beams, endpoint=False)
                cost = least(lambda a=angles, s=simulator: s._engine.cast(np.zeros(3), a, 30.0), calls)
                unit = unit or cost
                print(f"  {engine:10} {num_people:4} people {num_beams:5} rays {1e6 * cost:9.1f} {cost / unit:7.2f}")


def print_seconds(duration: float) -> None:
    """A simulated second of the world with each lidar."""
    print("the world with 10 people: CPU time [ms] a simulated second, and over that without a lidar")
    for engine in ENGINES:
        plain = None
        for name in (None, *LIDARS):
            scenario = hall(engine, 10, None if name is None else LidarSpec(name))
            simulator = Simulator(scenario, 0, lidar=name is not None)
            cost = least(lambda s=simulator: s.advance(duration, (0.05, 0.5)), 1) / duration
            plain = plain or cost
            print(f"  {engine:10} {name or 'no lidar':10} {1e3 * cost:8.2f} {cost / plain:7.2f}")


def main() -> int:
    """Prints both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--calls", type=int, default=50, help="scans in a round")
    parser.add_argument("--duration", type=float, default=2.0, help="simulated seconds in a round")
    arguments = parser.parse_args()
    print_scans(arguments.calls)
    print_seconds(arguments.duration)
    return 0


if __name__ == "__main__":
    sys.exit(main())
