"""What 100 people cost at one decision of theirs, every 0.02 s: 0.7 people a square metre, who all see the robot.

    pytest tests/benchmarks/test_people.py --benchmark-enable --benchmark-only

prints least times, and ratios to the forces between all pairs by vectorised NumPy in the same run. Without the option
each runs once.
"""

import numpy as np
import pytest

from mjnav.messages import WorldState
from mjnav.scenarios.spec import Orca, Person, Physics, Robot, Scenario, SocialForce, Wall
from mjnav.world.people.pedestrians import Pedestrians

NUM, BUDGET = 100, 3e-4  # [s]
NUMPY = "forces between all pairs, NumPy"
LAWS = {
    "social_force": lambda goal: SocialForce(waypoints=(goal,), loop=False),
    "social_force, moussaid": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="moussaid"),
    "social_force, helbing": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="helbing"),
    "orca": lambda goal: Orca(waypoints=(goal,), loop=False),
}


def crowd(law):
    """People on a jittered grid between two walls, on their ways, and their decisions."""
    rng = np.random.default_rng(0)
    start = 1.2 * np.stack(np.meshgrid(np.arange(10), np.arange(10)), -1).reshape(-1, 2) + rng.uniform(
        -0.2, 0.2, (NUM, 2)
    )
    way = rng.normal(0.0, 1.0, (NUM, 2))
    velocity = way / np.hypot(*way.T)[:, None]
    goals = np.clip(start + 8.0 * velocity, (-90.0, -6.0), (90.0, 17.0))
    people = tuple(Person(tuple(p), LAWS[law](tuple(g))) for p, g in zip(start.tolist(), goals.tolist(), strict=True))
    walls = (Wall((-10.0, -8.0), (20.0, -8.0)), Wall((-10.0, 19.0), (20.0, 19.0)))
    robot = Robot(start=(-5.0, 0.0, 0.0), goal=(15.0, 0.0))
    scenario = Scenario(name="crowd", robot=robot, people=people, walls=walls, physics=Physics(engine="kinematic"))
    world = WorldState(0.0, np.array([-0.8, 5.0, 0.0]), np.array([1.0, 0.0]), start, velocity)
    return Pedestrians(scenario, 0), world


@pytest.fixture(scope="module")
def times(lines):
    """Least times [s] by name; printed with their ratios when all benchmarks have run."""
    least: dict[str, float] = {}
    yield least
    if NUMPY in least:
        lines += [
            f"{name:32s} {1e3 * time:7.3f} ms of {1e3 * BUDGET:g} ms   {least[NUMPY] / time:6.1f} x as fast as NumPy"
            for name, time in least.items()
        ]


def timed(benchmark, times, name, function):
    value = benchmark.pedantic(function, rounds=300, warmup_rounds=20)
    if benchmark.stats is not None:
        times[name] = benchmark.stats.stats.min
    return value


@pytest.mark.parametrize("law", LAWS)
def test_one_decision_of_a_hundred_people(benchmark, times, law):
    people, world = crowd(law)
    velocities = timed(benchmark, times, law, lambda: people.velocities(world))
    assert velocities.shape == (NUM, 2)
    assert np.isfinite(velocities).all()
    if benchmark.stats is not None:
        assert times[law] <= BUDGET


def test_forces_between_all_pairs_by_numpy(benchmark, times):
    """Moussaid's f_ij alone, without routes, walls, lookahead and the robot."""
    _, world = crowd("orca")
    p, v = world.people_position, world.people_velocity

    def forces():
        way = p - p[:, None] + 1e3 * np.eye(NUM)[..., None]
        distance = np.hypot(way[..., 0], way[..., 1])
        e = way / distance[..., None]
        to = 2.0 * (v[:, None] - v) + e
        size = np.hypot(to[..., 0], to[..., 1])
        t = to / size[..., None]
        theta = np.arctan2(t[..., 0] * e[..., 1] - t[..., 1] * e[..., 0], (t * e).sum(-1))
        reach = 0.35 * size
        slow, turn = (np.exp(-distance / reach - (n * reach * theta) ** 2) for n in (3.0, 2.0))
        aside = np.stack([-t[..., 1], t[..., 0]], -1)
        return -4.5 * (slow[..., None] * t + (np.sign(theta) * turn)[..., None] * aside).sum(1)

    assert np.isfinite(timed(benchmark, times, NUMPY, forces)).all()
