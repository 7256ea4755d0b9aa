"""People pushed by social forces."""

from math import cos

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Indices, Matrix, Vector
from mjnav.messages import Array, WorldState
from mjnav.motion.social_force import FORMS, SocialForce, accelerations
from mjnav.scenarios.people import PERIOD
from mjnav.scenarios.people.avoiding import SocialForce as SocialForceKeys
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.avoiding import AvoidingWalk, Bodies, groups

STANDING_TIME = 0.5  # [s] in which who arrives comes to rest where a form has no tau (libpedsim)


class SocialForceWalk(AvoidingWalk):
    """Velocities that follow the accelerations of `motion.social_force`, by Euler's steps of PERIOD.

    The velocity that is integrated is the person's will: a body that others hold back, or a servo that lags, leaves it.
    It is at most the wanted speed, times a factor of the form.
    """

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        laws = [law_of(behaviour) for behaviour in found if isinstance(behaviour, SocialForceKeys)]
        self._groups = groups(laws)
        # In MuJoCo bodies that touch slide past one another; in the kinematic world they stand.
        self.sidesteps = scenario.physics.engine == "kinematic"
        self._will = np.full((len(index), 2), np.nan)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        _begin(self._will, wanted, bodies.position, bodies.velocity, self.index)
        for group, law in self._groups:
            self._will[group] = self._followed(group, law, wanted[group], bodies)
        return self.unsteady(self._will)

    def _followed(self, group: Indices | slice, law: SocialForce, wanted: Array, bodies: Bodies) -> Array:
        own = self._will[group]
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
        return _stepped(own, push, wanted, self._speed[group], law.relaxation_time > 0.0, law.drive, law.excess)


@exact
def _begin(will: Matrix, wanted: Matrix, position: Matrix, velocity: Matrix, index: Indices):
    """Gives a will (n, 2) to those who have none yet or are not there; it becomes everybody's velocity.

    It is what the others react to: noise is not.
    """
    for i in range(len(will)):
        body = index[i]
        if np.isnan(will[i, 0]) or np.isnan(position[body, 0]):
            will[i, 0], will[i, 1] = wanted[i, 0], wanted[i, 1]
        velocity[body, 0], velocity[body, 1] = will[i, 0], will[i, 1]


@exact
def _stepped(own: Matrix, push: Matrix, wanted: Matrix, speed: Vector, relaxes: bool, drive: float, excess: float):
    """The wills (n, 2) after PERIOD under accelerations `push` (n, 2), no faster than `excess` times what is wanted.

    Who slows down to stand comes to rest in STANDING_TIME where the form has no relaxation time.
    """
    found = np.empty(own.shape)
    for i in range(len(own)):
        size = np.hypot(wanted[i, 0], wanted[i, 1])
        stands = not relaxes and size < (1.0 - 1e-9) * speed[i]
        for k in range(2):
            a = push[i, k]
            if stands:
                a += (wanted[i, k] - own[i, k]) / STANDING_TIME - drive * wanted[i, k]
            found[i, k] = own[i, k] + PERIOD * a
        fastest = excess * max(speed[i], size)
        share = min(1.0, fastest / max(np.hypot(found[i, 0], found[i, 1]), 1e-9))
        found[i, 0] *= share
        found[i, 1] *= share
    return found


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
