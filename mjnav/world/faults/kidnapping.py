"""Kidnappings: the robot is put elsewhere, wherever it is and whatever it does."""

from math import hypot

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import Engine
from mjnav.world.grid import NEVER

ROOM = 0.02  # [m] between the robot and the people where it is put down


class Kidnappings:
    """The kidnappings of a run that are still to come."""

    def __init__(self, scenario: Scenario):
        given = () if scenario.faults is None else scenario.faults.kidnappings
        timestep = scenario.physics.timestep
        self._waiting = [(round(one.time / timestep), np.array(one.pose)) for one in given]
        self._reach = np.array([person.radius for person in scenario.people]) + scenario.robot.radius + ROOM
        self.next = self._waiting[0][0] if self._waiting else NEVER  # step

    def pass_moment(self, step: int, engine: Engine) -> None:
        """Puts the robot elsewhere where that is due, or with the next step where somebody stands there."""
        while self._waiting and step >= self._waiting[0][0]:
            pose = self._waiting[0][1]
            if self._taken(pose, engine.people_position()):
                self.next = step + 1
                return
            engine.teleport(pose)
            del self._waiting[0]
            self.next = self._waiting[0][0] if self._waiting else NEVER

    def _taken(self, pose: Array, people: Array) -> bool:
        return any(hypot(x - pose[0], y - pose[1]) < reach for (x, y), reach in zip(people, self._reach, strict=True))
