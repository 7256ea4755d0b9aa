"""The people of a MuJoCo world: two slide joints each, behind a velocity servo."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from collections.abc import Sequence
from copy import copy
from math import sqrt

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array
from mjnav.scenarios.ranges import MAX_LENGTH
from mjnav.scenarios.spec import Scenario

ACCELERATION = 6.0  # [m/s^2] more than 250 N on each of two axes give 70 kg, 5.05
OVERLAP = 0.02  # [m] that two people who press against each other may overlap, and more
APART_SPEED = 0.3  # [m/s] beyond their own of people who overlap at the start: contact forces would throw them apart
# Where people are who are not there: beyond the lidar of a robot at the edge of the largest scene, in a row.
AWAY, AWAY_STEP = 3.0 * MAX_LENGTH, 5.0  # [m]


class MujocoPeople:
    """Where people are and how they walk, by views of MuJoCo's state."""

    def __init__(self, model: "mujoco.MjModel", data: "mujoco.MjData", scenario: Scenario, velocities: Array):
        axes = [f"person{i}/{axis}" for i in range(len(scenario.people)) for axis in "xy"]
        self._joints = _stretch([model.joint(name).qposadr[0] for name in axes])
        self._dofs = _stretch([model.joint(name).dofadr[0] for name in axes])
        self._servos = _stretch([model.actuator(name).id for name in axes])
        self._start = np.array([person.start for person in scenario.people], float).reshape(-1, 2)
        self._radii = np.array([person.radius for person in scenario.people], float)
        self._present, self._all_present = np.ones(len(scenario.people), bool), True
        self._bind(data)
        self._velocities[:] = velocities
        # Some may overlap at the start, and never again: newcomers wait for a free place.
        self.overlap = bool(_overlapping(self._start, self._radii).any())

    def bound(self, data: "mujoco.MjData") -> "MujocoPeople":
        """The same people in another state of the same model."""
        twin = copy(self)
        twin._present = self._present.copy()
        twin._bind(data)
        return twin

    def _bind(self, data: "mujoco.MjData") -> None:
        self._moves = data.qpos[self._joints].reshape(-1, 2)  # [m] since the start
        self._velocities = data.qvel[self._dofs].reshape(-1, 2)  # [m/s]
        self._desired = data.ctrl[self._servos].reshape(-1, 2)  # [m/s]

    def __len__(self) -> int:
        return len(self._radii)

    def walk(self, velocities: Array) -> None:
        """See `Engine`."""
        self._desired[:] = velocities

    def place(self, person: int, position: ArrayLike, velocity: ArrayLike) -> None:
        """See `Engine`."""
        self._moves[person] = np.asarray(position, float) - self._start[person]
        self._velocities[person] = velocity
        self._present[person] = True
        self._all_present = bool(self._present.all())

    def remove(self, person: int) -> None:
        """See `Engine`."""
        self.place(person, (AWAY, AWAY + AWAY_STEP * person), (0.0, 0.0))
        self._desired[person] = 0.0
        self._present[person] = self._all_present = False

    def position(self) -> Array:
        """See `Engine`."""
        return self._of_present(self._start + self._moves)

    def velocity(self) -> Array:
        """See `Engine`."""
        return self._of_present(self._velocities.copy())

    def _of_present(self, values: Array) -> Array:
        if not self._all_present:
            values[~self._present] = np.nan
        return values

    def nearest(self, x: float, y: float, radius: float) -> tuple[float, float, float]:
        """Clearance [m] from a disc to the nearest person, and bounds of any person's speed and acceleration.

        Of P people who push one another, one may take over the kinetic energy of all and be pushed by the forces of
        all: sqrt(P) times the fastest one's speed and P times the acceleration.
        """
        clearance, fastest = _nearest(x, y, self._start + self._moves, self._velocities, self._radii + radius)
        return clearance, fastest * sqrt(len(self)), ACCELERATION * len(self)

    def part(self, timestep: float) -> None:
        """Slows those who overlap, in the step that was made last; once nobody does, `overlap` is over for good."""
        overlapping = _overlapping(self._start + self._moves, self._radii)
        self.overlap = bool(overlapping.any())
        for i in np.flatnonzero(overlapping).tolist():
            speed, limit = np.hypot(*self._velocities[i]), np.hypot(*self._desired[i]) + APART_SPEED
            if speed > limit:
                self._moves[i] -= (1.0 - limit / speed) * timestep * self._velocities[i]
                self._velocities[i] *= limit / speed


def _stretch(places: Sequence[int]) -> slice:
    """The slice of these places, which follow one another as people do in the model: a slice is a view."""
    if not len(places):
        return slice(0, 0)
    assert np.all(np.diff(places) == 1), "people's joints and servos follow one another"
    return slice(int(places[0]), int(places[-1]) + 1)


@exact
def _overlapping(positions: Matrix, radii: Vector):
    """(P,) who overlaps with somebody by more than OVERLAP."""
    found = np.zeros(len(radii), np.bool_)
    for i in range(len(radii)):
        for j in range(i):
            distance = np.hypot(positions[i, 0] - positions[j, 0], positions[i, 1] - positions[j, 1])
            if distance < radii[i] + radii[j] - OVERLAP:
                found[i] = found[j] = True
    return found


@exact
def _nearest(x: float, y: float, positions: Matrix, velocities: Matrix, reach: Vector):
    """Clearance [m] of the person nearest to touching, and the fastest one's speed [m/s]."""
    clearance, fastest = np.inf, 0.0
    for i in range(len(reach)):
        clearance = min(clearance, np.hypot(positions[i, 0] - x, positions[i, 1] - y) - reach[i])
        fastest = max(fastest, np.hypot(velocities[i, 0], velocities[i, 1]))
    return clearance, fastest
