"""The crowds of CrowdNav, CrowdNav++ and DS-RNN, case by case: how each case is drawn, and how its people walk.

CrowdNav: Chen et al. 2019 (vita-epfl/CrowdNav). CrowdNav++: Liu et al. 2023 (CrowdNav_Prediction_AttnGraph of
Shuijing725). DS-RNN: Liu et al. 2021 (CrowdNav_DSRNN of Shuijing725), with the unicycle. NumPy's legacy generator under
a case's seed, and the order of the draws, define the case: these draws come from no stream of `mjnav.rng`.

People walk by ORCA (`mjnav.motion.orca`) and do not see the robot. Each has a simulator of their own: what they assume
of everybody's radius, and of the distance up to which others count, was true when they took their first step. The
originals compute it in single precision, so positions, velocities and radii are rounded to that here, too.
"""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from mjnav.compile.compiled import Flags
from mjnav.geometry.distances import segment_distance
from mjnav.messages import Array

# ------------------------------------------------------------------------------------- constants of the crowds


ROBOT_RADIUS = 0.3  # [m]
HORIZON = 5.0  # [s] of ORCA
NEIGHBOUR_DISTANCE = 10.0  # [m] between centres, beyond which nobody counts; of varied people in CrowdNav++ 5 to 10
MARGIN = 0.01  # [m] that every radius counts for more
GOALS_EVERY = 5.0  # [s] between chances to change one's goal
WIDEST_NOISE = 2.0  # [m] along x and y, of starts in CrowdNav++


@dataclass(frozen=True, slots=True, kw_only=True)
class CrowdRules:
    """What tells one crowd from the others; the defaults are those of the later two."""

    first_seed: int  # of case 0
    seeds_each: int = 2  # from one case to the next
    num_people: int
    period: float  # [s] of a step
    circle: float  # [m] radius on which people start
    apart: float = 0.25  # [m] between surfaces where somebody is drawn, also from the others' goals
    robot_apart: float | None = None  # [m] the same between the centres of robot and person; None: as for people
    safety: float = 0.15  # [m] that every radius counts for more, beside MARGIN
    varied: bool = True  # whether radius and speed are drawn
    at_goal: Literal["stays", "new goal", "newcomer"]
    change: float  # probability of another goal, every GOALS_EVERY
    swept: bool = False  # contact over the whole step, with the velocity of the step before; or overlap at its end
    limit_first: bool = True  # whether the time limit comes before a contact and the goal


CROWDS = MappingProxyType(
    {
        "crowdnav": CrowdRules(
            first_seed=1000, seeds_each=1, num_people=5, period=0.25, circle=4.0, apart=0.2, safety=0.0, varied=False,
            at_goal="stays", change=0.0, swept=True, limit_first=False,
        ),
        "crowdnav-plus": CrowdRules(
            first_seed=1425, num_people=20, period=0.25, circle=6.0 * np.sqrt(2.0), at_goal="newcomer", change=0.5
        ),
        "dsrnn": CrowdRules(
            first_seed=1000, num_people=5, period=0.1, circle=6.0, robot_apart=3.0, at_goal="new goal", change=0.25
        ),
    }
)  # fmt: skip
MAX_CASE = 10**9  # the generator's seeds end at 2**32

# --------------------------------------------------------------------------------------------------- a case


class PublishedCrowd:
    """One case as it runs: `velocities` of the step to come, then `move`, and so on.

    Arrays are replaced, never changed. All are of the P people: position, velocity, goal (P, 2), radius and highest
    speed (P,). The velocity is that of the step before, zero for who is new.
    """

    def __init__(self, name: str, case: int):
        self.rules = rules = CROWDS[name]
        self._rng = np.random.RandomState(rules.first_seed + rules.seeds_each * case)
        self._neighbour_distance = NEIGHBOUR_DISTANCE  # of the simulators that are made next
        self.robot_pose, self.robot_goal = self._robot(name)
        self.robot = self.robot_pose[:2]  # where it was at the last step
        self.time = 0.0
        num = rules.num_people
        self.position = self.velocity = self.goal = np.zeros((0, 2))
        self.radius = self.max_speed = np.zeros(0)
        if name == "crowdnav-plus":
            self._rng.randint(num, num + 1)  # the number of people
        for _ in range(num):
            row = self._person()
            self.position, self.goal = np.vstack([self.position, row[:2]]), np.vstack([self.goal, -row[:2]])
            self.radius, self.max_speed = np.append(self.radius, row[2]), np.append(self.max_speed, row[3])
        self.velocity = np.zeros((num, 2))
        self._new = np.ones(num, bool)  # who has no simulator yet
        self._assumed = np.zeros((num, num))  # [m] radius of everybody in each person's simulator
        self._reach = np.zeros(num)  # [m] neighbour distance in it

    def velocities(self) -> Array:
        """The velocities of the step to come, (P, 2) [m/s]."""
        from mjnav.motion.orca import AMONG_PEOPLE, OrcaSettings, velocities  # other runs do without its kernels

        rules, num = self.rules, len(self.position)
        self._assumed[self._new] = _single(self.radius + MARGIN + rules.safety)
        self._reach[self._new] = self._neighbour_distance
        self._new[:] = False
        way = self.goal - self.position
        length = np.linalg.norm(way, axis=1)
        desired = _single(way / np.maximum(length, 1.0)[:, None])
        position, velocity, nobody = _single(self.position), _single(self.velocity), np.zeros(1, bool)
        found = np.empty((num, 2))
        for i in range(num):
            settings = OrcaSettings(HORIZON, HORIZON, self._reach[i], num, AMONG_PEOPLE, 0.0, rules.period)
            found[i] = velocities(
                position, velocity, self._assumed[i], np.array([i]), desired[i : i + 1], self.max_speed[i : i + 1],
                nobody, nobody, -1, np.zeros((0, 3)), np.zeros((0, 6)), settings,
            )[0]  # fmt: skip
        return _single(found)

    def move(self, velocity: Array, robot: Array) -> tuple[Flags, list[int]]:
        """All walk with `velocity` (P, 2) for a step, at whose end the robot is at `robot` (2,) [m].

        Returns (P,) who is in contact with it, and who was replaced by a newcomer.
        """
        rules = self.rules
        before = self.position - self.robot
        after = before + self.velocity * rules.period - (robot - self.robot)
        self.position, self.velocity = self.position + velocity * rules.period, velocity
        self.robot, self.time = robot, self.time + rules.period
        if rules.change and self.time % GOALS_EVERY == 0.0:
            for i in range(len(self.position)):
                if self._rng.random_sample() <= rules.change:
                    self._put(i, goal=self._goal(i))
        newcomers = self._at_goal()
        if rules.swept:
            distance = segment_distance(np.zeros(2), before, after)
        else:
            distance = np.linalg.norm(self.position - robot, axis=1)
        return distance < self.radius + ROBOT_RADIUS, newcomers

    def _at_goal(self) -> list[int]:
        """What becomes of those who have reached their goals; returns who was replaced."""
        rules, replaced = self.rules, []
        for i in range(len(self.position) if rules.at_goal != "stays" else 0):
            if not np.linalg.norm(self.goal[i] - self.position[i]) < self.radius[i]:
                continue
            if rules.at_goal == "new goal":
                self._rng.random_sample()  # whether there is one: always
                self._put(i, goal=self._goal(i))
                continue
            row = self._person()
            self._put(i, position=row[:2], goal=-row[:2], velocity=0.0, radius=row[2], max_speed=row[3])
            self._new[i] = True
            replaced.append(i)
        return replaced

    def _put(self, person: int, **values: Array | float) -> None:
        """Replaces a person's row of these arrays."""
        for name, value in values.items():
            changed = getattr(self, name).copy()
            changed[person] = value
            setattr(self, name, changed)

    # ------------------------------------------------------------------------------------------- draws

    def _robot(self, name: str) -> tuple[Array, Array]:
        """The robot's first pose (3,) and its goal (2,). Only DS-RNN draws a heading; the others face the goal."""
        rng, side = self._rng, 6.0
        if name == "crowdnav":
            start, goal = np.array([0.0, -4.0]), np.array([0.0, 4.0])
        elif name == "dsrnn":
            angle = rng.uniform(0.0, 2.0 * np.pi)
            start = goal = side * np.array([np.cos(angle), np.sin(angle)])
            while np.linalg.norm(start - goal) < 6.0:
                goal = rng.uniform(-side, side, 2)
            return np.array([*start, rng.uniform(0.0, 2.0 * np.pi)]), goal
        else:
            start = goal = np.zeros(2)
            while np.linalg.norm(start - goal) < 8.0:
                start, goal = rng.uniform(-side, side, 4).reshape(2, 2)
        return np.array([*start, np.arctan2(*(goal - start)[::-1])]), goal

    def _person(self) -> Array:
        """Somebody new: x, y, radius, highest speed. The goal lies opposite."""
        rng, rules, radius, speed = self._rng, self.rules, 0.3, 1.0
        arrives = rules.at_goal == "newcomer"
        if arrives:
            self._neighbour_distance = rng.uniform(5.0, 10.0)
        if rules.varied:
            speed, radius = rng.uniform(0.5, 1.5), rng.uniform(0.3, 0.5)
        others = np.vstack([self.position, self.goal])
        reach = radius + np.tile(self.radius, 2) + rules.apart
        robot_reach = radius + ROBOT_RADIUS + rules.apart if rules.robot_apart is None else rules.robot_apart
        while True:
            point = self._on_circle(0.0, WIDEST_NOISE) if arrives else self._on_circle(0.5, speed)
            if self._is_free(point, others, reach, robot_reach):
                return np.array([*point, radius, speed])

    def _goal(self, person: int) -> Array:
        """Another goal of a person, (2,)."""
        radius, speed, rules = self.radius[person], self.max_speed[person], self.rules
        rest = np.arange(len(self.position)) != person
        others = np.vstack([self.position[rest], self.goal[rest]])
        reach = radius + np.tile(self.radius[rest], 2) + rules.apart
        while True:
            point = self._on_circle(0.5, speed)
            if self._is_free(point, others, reach, radius + ROBOT_RADIUS + rules.apart):
                return point

    def _on_circle(self, centre: float, noise: float) -> Array:
        """A random point of the circle, off by (U - centre) noise along x and y, U in [0, 1)."""
        angle = self._rng.random_sample() * np.pi * 2
        off = (self._rng.random_sample(2) - centre) * noise
        return np.array([self.rules.circle * np.cos(angle) + off[0], self.rules.circle * np.sin(angle) + off[1]])

    def _is_free(self, point: Array, others: Array, reach: Array, robot_reach: float) -> bool:
        """Whether a point keeps these distances from the others' places and goals, and from the robot's."""
        robot = np.stack([self.robot, self.robot_goal])
        near = np.linalg.norm(others - point, axis=1) < reach
        return not near.any() and not (np.linalg.norm(robot - point, axis=1) < robot_reach).any()


def _single(values: Array) -> Array:
    """Rounded to single precision."""
    return values.astype(np.float32).astype(float)
