"""The people of a published crowd in a run, and the engine in which they and the robot pass through one another.

As in the originals, people walk straight from one step of the crowd to the next, nothing stops anybody, and contacts
are judged at the end of each step. The robot is the scene's unicycle, which moves as in `kinematic_engine`.

Who is replaced is gone for one step; the newcomer comes in at the end of their first one. So nobody jumps, trackers
drop the track, and the robot hears of newcomers when the original does.
"""

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.scene.published import Published
from mjnav.scene.spec import Scenario
from mjnav.world.engine import Engine
from mjnav.world.kinematic_engine import KinematicEngine


class PublishedEngine(KinematicEngine):
    """People go straight on from where they were put last, whatever is there; the robot meets nobody."""

    def __init__(self, scenario: Scenario, velocities: Array):
        super().__init__(scenario, velocities)
        self._put_at, self._put_in = self._people[:, :2].copy(), 0  # where people were put, in which step

    def put(self, position: Array, velocity: Array, radius: Array) -> None:
        """People are at places (P, 2) with velocities (P, 2) and radii (P,); NaN is somebody who is not there."""
        self._people = np.column_stack([position, velocity + 0.0 * position, radius])
        self._put_at, self._put_in = self._people[:, :2].copy(), self._steps

    def advance(self, twists: Array) -> None:
        """See `Engine`."""
        people, desired = self._people, self._desired
        self._people, self._desired = people[:0], desired[:0]  # the robot moves as if nobody were there
        super().advance(twists)
        self._people, self._desired = people, desired
        duration = (self._steps - self._put_in) * self._timestep  # counted anew: no sum of single steps
        people[:, :2] = self._put_at + desired * duration
        people[:, 2:4] = desired + 0.0 * self._put_at  # NaN for who is not there


class PublishedPeople:
    """All people of a published crowd, in place of `Pedestrians`."""

    first = True  # sensors read once contacts are judged and people replaced
    stranded = ()

    def __init__(self, scenario: Scenario, published: Published):
        self._crowd = published.made()
        self._velocities: Array | None = None  # of the step under way
        self._time_limit = scenario.time_limit if self._crowd.rules.limit_first else np.inf
        self.period = self._crowd.rules.period  # [s]

    @property
    def radius(self) -> Array:
        """(P,) [m]"""
        return self._crowd.radius

    def at_start(self, world: WorldState) -> tuple[WorldState, Array]:
        """The world as it is, and the velocities that are reported first: everybody stands."""
        return world, np.zeros_like(world.people_position)

    def decide(self, world: WorldState, engine: Engine) -> None:
        """Ends a step of the crowd, with its contacts and newcomers, and begins the next one."""
        assert isinstance(engine, PublishedEngine)
        crowd = self._crowd
        if self._velocities is not None:
            touched, replaced = crowd.move(self._velocities, world.robot_pose[:2])
            if world.time < self._time_limit - 1e-9:
                for person in np.flatnonzero(touched).tolist():
                    engine.contacts.add(f"person{person}", 0.0, world.time)
            position = crowd.position.copy()
            position[replaced] = np.nan
            engine.put(position, crowd.velocity, crowd.radius)
        self._velocities = crowd.velocities()
        engine.walk(self._velocities)
