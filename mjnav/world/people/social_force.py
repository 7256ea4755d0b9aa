"""People pushed by social forces."""

from math import cos

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Flags, Indices, Matrix, Vector
from mjnav.messages import Array, WorldState
from mjnav.motion.social_force import FORMS, SocialForce, accelerations
from mjnav.scenarios.people import PERIOD
from mjnav.scenarios.people.avoiding import SocialForce as SocialForceKeys
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.avoiding import AvoidingWalk, groups

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
        avoids, discs, boxes = self._temperaments.avoids, self._floor.discs, self._floor.boxes
        for group, law in self._groups:
            _follow(
                self._will, group, wanted, self._speed, self.index, avoids,
                bodies.position, bodies.velocity, self._radius, bodies.robot, discs, boxes, law,
            )  # fmt: skip
        return self.unsteady(self._will)


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
def _follow(
    will: Matrix,
    group: Indices,
    wanted: Matrix,
    speed: Vector,
    index: Indices,
    avoids: Flags,
    position: Matrix,
    velocity: Matrix,
    radius: Vector,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    law: SocialForce,
):
    """Moves the wills (n, 2) of a `group` on by PERIOD under a law, no faster than its `excess` times what is wanted.

    `wanted`, `speed`, `index` and `avoids` are of all n people, `position`, `velocity` and `radius` of all bodies. Who
    slows down to stand comes to rest in STANDING_TIME where the form has no relaxation time.
    """
    push = accelerations(
        position, velocity, radius, index[group], wanted[group], will[group], avoids[group], robot, discs, boxes, law
    )
    for g in range(len(group)):
        i = group[g]
        size = np.hypot(wanted[i, 0], wanted[i, 1])
        stands = not law.relaxation_time > 0.0 and size < (1.0 - 1e-9) * speed[i]
        for k in range(2):
            a = push[g, k]
            if stands:
                a += (wanted[i, k] - will[i, k]) / STANDING_TIME - law.drive * wanted[i, k]
            will[i, k] += PERIOD * a
        fastest = law.excess * max(speed[i], size)
        share = min(1.0, fastest / max(np.hypot(will[i, 0], will[i, 1]), 1e-9))
        will[i, 0] *= share
        will[i, 1] *= share


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
