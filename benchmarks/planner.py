"""What one decision of `rkhs-plan` costs, by people, joint samples and rollouts.

    uv run python benchmarks/planner.py --decisions 300

A robot in a corridor 7 m wide that it knows, among people at random within 6 m who walk towards it. Each row is CPU
time of one decision in ms, the median and the 99 % quantile, and the ratio of the medians to `rkhs` by its class's
defaults among twelve people, which is measured in the same run.
"""

import argparse
from time import process_time

import numpy as np

from mjnav.control import make_controller
from mjnav.control.base import Controller
from mjnav.control.methods.rkhs import Rkhs
from mjnav.control.problem.fan import num_rollouts
from mjnav.messages import KnownMap, Observation, ObstacleSamples, RobotLimits

# people, joint samples, turn rates of the first moves; the first row is the budget's
ROWS = (
    (12, 48, 7),
    (0, 48, 7),
    (4, 48, 7),
    (20, 48, 7),
    (12, 12, 7),
    (12, 200, 7),
    (12, 48, 3),
    (12, 48, 25),
)
PERIOD = 0.1  # [s]
SPREAD = 0.08  # [m, m/s] standard deviation of the beliefs of people
WALLS = np.array([[[-10.0, -3.5], [20.0, -3.5]], [[-10.0, 3.5], [20.0, 3.5]]])
CORRIDOR = KnownMap(WALLS, np.zeros(2), np.zeros((0, 3)))
WARM_UP = 20  # decisions


def observation(tick: int, num_people: int, num_samples: int) -> Observation:
    """One of the observations that every method gets; another at each tick."""
    rng, people = np.random.default_rng(tick), []
    for _ in range(num_people):
        angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(0.8, 6.0)
        towards = -np.array([np.cos(angle), np.sin(angle)])
        position = -distance * towards + SPREAD * rng.normal(size=(num_samples, 2))
        velocity = 0.8 * towards + 0.3 * rng.normal(size=2) + SPREAD * rng.normal(size=(num_samples, 2))
        people.append(ObstacleSamples(position, velocity, 0.3))
    pose = np.array([0.015, 0.015, 0.02]) * rng.normal(size=(num_samples, 3))
    noise = np.array([0.03, 0.05]) * rng.normal(size=(num_samples, 2))
    twist, goal = np.array([0.6, rng.uniform(-0.3, 0.3)]), np.array([15.0, 0.0])
    return Observation(pose, noise, twist, tuple(people), goal, WALLS, time=PERIOD * tick, map=CORRIDOR)


def measured(controller: Controller, num_people: int, decisions: int) -> np.ndarray:
    """CPU times of decisions, (decisions,) [ms]."""
    times, num_samples = [], controller.parameters.samples
    for tick in range(WARM_UP + decisions):
        seen = observation(tick, num_people, num_samples)
        start = process_time()
        controller.decide(seen)
        times.append(process_time() - start)
    return 1e3 * np.array(times[WARM_UP:])


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--decisions", type=int, default=300, help="decisions in each row")
    decisions, limits = parser.parse_args().decisions, RobotLimits()
    unit = measured(make_controller(Rkhs, limits, PERIOD), 12, decisions)
    print(f"rkhs, 12 people: {np.median(unit):.2f} ms p50, {np.quantile(unit, 0.99):.2f} ms p99")
    print("people  samples  rollouts     p50     p99   ratio")
    for num_people, samples, turn_rates in ROWS:
        controller = make_controller("rkhs-plan", limits, PERIOD, samples=samples, num_turn_rates=turn_rates)
        found = measured(controller, num_people, decisions)
        p50, p99 = np.quantile(found, [0.5, 0.99])
        row = f"{num_people:6d}{samples:9d}{num_rollouts(3, turn_rates, reverses=False):10d}{p50:8.2f}{p99:8.2f}"
        print(f"{row}{p50 / np.median(unit):8.1f}", flush=True)


if __name__ == "__main__":
    main()
