"""People for the laws, without a world."""

from dataclasses import dataclass

import numpy as np
import pytest

from mjnav.motion import orca
from mjnav.motion.social_force import FORMS, accelerations

SETTINGS = orca.OrcaSettings(5.0, 0.5, 10.0, 10, 0.5, 0.0, 0.02)


@dataclass(frozen=True)
class People:
    """Everybody walks; with `robot` the last one is the robot, and walks too."""

    position: np.ndarray
    velocity: np.ndarray
    radius: float = 0.3
    discs: np.ndarray | None = None
    boxes: np.ndarray | None = None
    robot: bool = False
    sees: bool = True
    at_rest: bool = False  # what they take the robot for

    def _bodies(self, desired):
        num = len(self.position)
        place = num - 1 if self.robot else -1
        desired = self.velocity if desired is None else np.asarray(desired, float)
        discs = np.zeros((0, 3)) if self.discs is None else self.discs
        boxes = np.zeros((0, 6)) if self.boxes is None else self.boxes
        radius, sees, at_rest = np.full(num, self.radius), np.full(num, self.sees), np.full(num, self.at_rest)
        return (self.position, self.velocity, radius, np.arange(num), desired), (sees, at_rest, place, discs, boxes)

    def accelerations(self, form="moussaid", desired=None, **constants):
        first, last = self._bodies(desired)
        return accelerations(*first, self.velocity, *last, FORMS[form]._replace(**constants))

    def orca(self, desired=None, max_speed=2.0, **settings):
        first, last = self._bodies(desired)
        top = np.full(len(self.position), max_speed)
        return orca.velocities(*first, top, *last, SETTINGS._replace(**settings))


@pytest.fixture
def people():
    def make(position, velocity, **rest):
        position, velocity = (np.array(a, float).reshape(-1, 2) for a in (position, velocity))
        return People(position, velocity, **rest)

    return make


@pytest.fixture
def crowd(people):
    def make(seed, num=8, spread=3.0, **rest):
        rng = np.random.default_rng(seed)
        return people(rng.uniform(-spread, spread, (num, 2)), rng.normal(0.0, 0.8, (num, 2)), **rest)

    return make
