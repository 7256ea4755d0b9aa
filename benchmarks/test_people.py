"""What people cost at one decision of theirs, every 0.02 s, by behaviour: 0.7 people a square metre among pillars.

    pytest benchmarks/test_people.py -n 0 --benchmark-enable --benchmark-only

prints the median and least CPU time of 300 decisions while people walk, with routes, temperaments and presence, and
ratios to the forces between all pairs by vectorised NumPy in the same run, which takes twice as long at least. Without
the option each runs once.
"""

import time

import numpy as np
import pytest

from mjnav.messages import WorldState
from mjnav.scene.people import PERIOD, TEMPERAMENTS, Diagonal, Trip
from mjnav.scene.spec import Orca, Person, Physics, Pillar, Robot, Scenario, SocialForce, Wall, Waypoints
from mjnav.world.kinematic_engine import KinematicEngine
from mjnav.world.people.pedestrians import Pedestrians

NUM, BUDGET = 100, 3e-4  # [s]
NUMPY = "forces between all pairs, NumPy"
NOISE = {"unsteadiness": 0.04, "diagonal": Diagonal(probability=0.001)}
LAWS = {
    "waypoints": lambda goal: Waypoints((goal,), loop=False),
    "social_force": lambda goal: SocialForce(waypoints=(goal,), loop=False),
    "social_force, moussaid": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="moussaid", **NOISE),
    "social_force, helbing": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="helbing"),
    "orca": lambda goal: Orca(waypoints=(goal,), loop=False),
}
MIXED = "a mixed crowd that comes and goes"
AGAIN = {"loop": False, "at_end": "again", "trips": (Trip(((-9.0, -7.0), (19.0, 18.0)), ((-9.0, -7.0), (19.0, 18.0))),)}


class Crowd:
    """People on a jittered grid between two walls, on their ways around pillars, in the kinematic world."""

    def __init__(self, name: str, num: int = NUM):
        rng, side = np.random.default_rng(0), int(np.sqrt(num))
        grid = 1.2 * np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
        start = grid + rng.uniform(-0.2, 0.2, (len(grid), 2))
        way = rng.normal(0.0, 1.0, (len(grid), 2))
        goals = np.clip(start + 8.0 * way / np.hypot(*way.T)[:, None], (-90.0, -6.0), (90.0, 17.0))
        pairs = zip(start.tolist(), goals.tolist(), strict=True)
        people = tuple(_person(name, i, tuple(p), tuple(g)) for i, (p, g) in enumerate(pairs))
        walls = (Wall((-10.0, -8.0), (20.0, -8.0)), Wall((-10.0, 19.0), (20.0, 19.0)))
        pillars = tuple(Pillar((x + 0.6, y + 0.6), 0.1) for x, y in grid[::11].tolist())
        robot, physics = Robot((-0.9, 5.0, 0.0), (15.0, 5.0)), Physics("kinematic")
        scenario = Scenario("crowd", robot, people=people, walls=walls, pillars=pillars, physics=physics)
        self._people, self._steps = Pedestrians(scenario, 0), round(PERIOD / physics.timestep)
        world = WorldState(0.0, np.array(robot.start), np.array([1.0, 0.0]), start, np.zeros_like(start))
        self._engine, self._decisions = KinematicEngine(scenario, self._people.velocities(world)), 0

    def walk(self) -> WorldState:
        """Until the next decision."""
        self._engine.advance(np.tile([0.3, 0.0], (self._steps, 1)))
        self._decisions += 1
        engine = self._engine
        position, velocity = engine.people_position(), engine.people_velocity()
        return WorldState(self._decisions * PERIOD, engine.robot_pose(), engine.robot_twist(), position, velocity)

    def decide(self, world: WorldState) -> None:
        """All that people do every PERIOD."""
        self._people.decide(world, self._engine)


def _person(name: str, i: int, start, goal) -> Person:
    if name != MIXED:
        return Person(start, LAWS[name](goal), sees_robot=True)
    if i % 4 == 3:
        behaviour = (Orca, SocialForce)[i % 8 // 4](waypoints=(goal,), **AGAIN)
    else:
        behaviour = list(LAWS.values())[i % len(LAWS)](goal)
    return Person(start, behaviour, sees_robot=i % 3 > 0, temperament=list(TEMPERAMENTS)[i % 6] if i % 3 > 0 else None)


@pytest.fixture(scope="module")
def times(lines):
    """Median and least times [s] by name; printed with their ratios when all benchmarks have run."""
    found: dict[str, tuple[float, float]] = {}
    yield found
    if NUMPY in found:
        lines += [
            f"{name:44s} {1e3 * median:6.3f} ms, least {1e3 * least:6.3f} ms of {1e3 * BUDGET:g} ms   "
            f"{found[NUMPY][1] / least:5.1f} x as fast as NumPy"
            for name, (median, least) in found.items()
        ]


def timed(benchmark, times, name, function, before=tuple):
    value = benchmark.pedantic(function, setup=lambda: (before(), {}), rounds=300, warmup_rounds=20)
    if benchmark.stats is not None:
        times[name] = benchmark.stats.stats.median, benchmark.stats.stats.min
    return value


@pytest.mark.benchmark(timer=time.thread_time)
@pytest.mark.parametrize(("name", "num"), [*((law, NUM) for law in LAWS), (MIXED, NUM), (MIXED, 16)])
def test_one_decision_of_all_people(benchmark, times, name, num):
    crowd = Crowd(name, num)
    timed(benchmark, times, f"{num} people, {name}", crowd.decide, before=lambda: (crowd.walk(),))
    assert np.isfinite(crowd.walk().people_velocity).any(axis=0).all()


@pytest.mark.benchmark(timer=time.thread_time)
def test_forces_between_all_pairs_by_numpy(benchmark, times):
    """Moussaid's f_ij alone, without routes, walls, lookahead and the robot."""
    world = Crowd("orca").walk()
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
    if NUMPY in times:  # an absolute time would fail on a slower machine
        assert max(2.0 * least for name, (_, least) in times.items() if name != NUMPY) <= times[NUMPY][1]
