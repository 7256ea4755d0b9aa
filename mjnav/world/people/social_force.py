"""People pushed by social forces."""

from math import cos

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.motion.social_force import FORMS, SocialForce, accelerations
from mjnav.scenarios.people.avoiding import SocialForce as SocialForceKeys
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.avoiding import AvoidingWalk
from mjnav.world.people.walk import PERIOD, Index

STANDING_TIME = 0.5  # [s] in which who arrives comes to rest where a form has no tau (libpedsim)


class SocialForceWalk(AvoidingWalk):
    """Velocities that follow the accelerations of `motion.social_force`, by Euler's steps of PERIOD.

    The velocity that is integrated is the person's will: a body that others hold back, or a servo that lags, leaves it.
    It is at most the wanted speed, times a factor of the form.
    """

    def __init__(self, scenario: Scenario, index: Index, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        laws = [law_of(behaviour) for behaviour in found if isinstance(behaviour, SocialForceKeys)]
        # One call of the law for all who have the same constants.
        self._groups = [(np.array([i for i, law in enumerate(laws) if law == one]), one) for one in dict.fromkeys(laws)]
        # In MuJoCo bodies that touch slide past one another; in the kinematic world they stand.
        self.sidesteps = scenario.physics.engine == "kinematic"
        self._will = np.full((len(index), 2), np.nan)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        new = np.isnan(self._will[:, 0]) | np.isnan(bodies.position[self.index, 0])
        self._will[new] = wanted[new]
        bodies.velocity[self.index] = self._will  # the others' noise is not what people react to
        for group, law in self._groups:
            self._will[group] = self._followed(group, law, wanted[group], bodies)
        return self.unsteady(self._will)

    def _followed(self, group: Index, law: SocialForce, wanted: Array, bodies) -> Array:
        own, speed = self._will[group], np.maximum(self._speed[group], np.hypot(*wanted.T))
        push = accelerations(
            bodies.position,
            bodies.velocity,
            self._radius,
            self.index[group],
            wanted,
            own,
            self._temperaments.avoids[group],
            bodies.robot,
            self._floor.discs,
            self._floor.boxes,
            law,
        )
        if law.relaxation_time == 0.0:
            slower = np.hypot(*wanted.T) < (1.0 - 1e-9) * self._speed[group]
            push[slower] += (wanted - own)[slower] / STANDING_TIME - law.drive * wanted[slower]
        will = own + PERIOD * push
        size = np.hypot(*will.T)
        return will * np.minimum(1.0, law.excess * speed / np.maximum(size, 1e-9))[:, None]


def law_of(keys: SocialForceKeys) -> SocialForce:
    """The constants of a run file's form, with those that the file gives in their place."""
    law, given = FORMS[keys.form], keys.constants
    if "field_of_view" in given:
        given["view_cosine"] = cos(0.5 * given.pop("field_of_view"))
    if "relaxation_time" in given:
        given["drive"] = 0.0
    elif "drive" in given:
        given["relaxation_time"] = 0.0
    return law._replace(**given)
