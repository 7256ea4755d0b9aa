"""What the simulator asks of an engine, and the contacts that one reports."""

from typing import Protocol

from numpy.typing import ArrayLike

from mjnav.errors import MjnavError
from mjnav.messages import Array, Contact


class DivergedError(MjnavError):
    """The physics diverged: a number out of bounds, or no memory for contacts. The state is lost."""


class ContactLog:
    """What the robot touched, each body once: when first, and how hard at most."""

    def __init__(self):
        self._seen: dict[str, Contact] = {}

    def add(self, name: str, force: float, time: float) -> None:
        """Body `name` ("person3", whose kind is person) touched with a normal `force` [N]."""
        before = self._seen.get(name)
        if before is None or force > before.force:
            self._seen[name] = Contact(name.rstrip("0123456789"), name, force, time if before is None else before.time)

    def clear(self) -> None:
        """Forgets all."""
        self._seen.clear()

    def seen(self) -> tuple[Contact, ...]:
        """In the order in which they were first seen."""
        return tuple(self._seen.values())


class Engine(Protocol):
    """Moves robot and people. Everything that it tells holds for the present moment.

    The same steps with the same set-points end in the same bits, however they are grouped into calls.
    """

    contacts: ContactLog

    def advance(self, twists: Array) -> None:
        """One step for each row of `twists` (n, 2), the wheels' set-points as v [m/s], omega [rad/s].

        Raises DivergedError.
        """
        ...

    def walk(self, velocities: Array) -> None:
        """From now on people want to walk with `velocities` (P, 2) [m/s], zero for those who are not there."""
        ...

    def place(self, person: int, position: ArrayLike, velocity: ArrayLike) -> None:
        """A person comes in at a place (2,) [m] free of everything else, with a velocity (2,) [m/s]."""
        ...

    def remove(self, person: int) -> None:
        """A person goes: nothing can touch them, and the lidar does not see them."""
        ...

    def teleport(self, pose: Array) -> None:
        """Puts the robot at a pose (3,) that is free, with the same speeds; encoders and `yaw` do not notice."""
        ...

    def spin(self, angles: Array) -> None:
        """Wheels turn on the spot by left and right angles (n, 2) [rad], row by row: the encoders count them."""
        ...

    def robot_pose(self) -> Array:
        """(3,) x, y [m], heading [rad] in (-pi, pi]."""
        ...

    def robot_twist(self) -> Array:
        """(2,) v along the heading [m/s], omega [rad/s]."""
        ...

    def yaw(self) -> float:
        """The heading with its full turns [rad], without what teleporting changed."""
        ...

    def wheel_angles(self) -> tuple[float, float]:
        """Left and right encoder [rad]."""
        ...

    def people_position(self) -> Array:
        """(P, 2) [m], NaN for people who are not there."""
        ...

    def people_velocity(self) -> Array:
        """(P, 2) [m/s], NaN for people who are not there."""
        ...

    def cast(self, mount: Array, angles: Array, max_range: float) -> Array:
        """(n,) exact ranges [m] of beams from a place on the body, inf where one meets nothing within `max_range` [m].

        `mount` (3,) is the place's x, y [m] and yaw [rad] on the body, `angles` (n,) [rad] count from that yaw.
        """
        ...

    def state_bytes(self) -> bytes:
        """Everything on which the future depends, bit for bit."""
        ...
