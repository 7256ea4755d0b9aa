"""Who hit whom: for every contact with a person, whether the robot moved, and whether it was its fault.

The velocities are those of the last tick before the contact; n is the direction from the robot to the person, u the
robot's velocity, w the person's. The robot approaches with u.n, the person with -w.n.

* At rest the robot is not at fault: it did what passive motion safety asks, which is to be at rest when a collision
  takes place (Macek, Vasquez Govea, Fraichard & Siegwart, Towards Safe Vehicle Navigation in Dynamic Urban Scenarios,
  2009; Bouraine, Fraichard & Salhi 2012).
* It moves, and the person does not see it, or never takes account of anybody: its fault, whatever the person did.
* It moves, and the person sees it: its fault if it approaches at least as fast as the person, u.n >= -w.n. Both can
  give way, and each owes half of it (reciprocal avoidance, van den Berg, Guy, Lin & Manocha 2011).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Contact, Trajectory
from mjnav.metrics.kinematics import STALLED_SPEED
from mjnav.metrics.safety import PERSON, beginnings
from mjnav.scenarios.people.person import SEEING
from mjnav.scenarios.people.temperament import REGULAR
from mjnav.scenarios.spec import Scenario


@dataclass(frozen=True, slots=True)
class Touch:
    """The beginning of a contact with a person."""

    person: int
    time: float  # [s]
    speed: float  # [m/s] of the robot
    moving: bool
    at_fault: bool

    def __str__(self) -> str:
        if not self.moving:
            return "the robot stood"
        whose = "its own fault" if self.at_fault else "the person came faster"
        return f"the robot moved at {self.speed:.2f} m/s: {whose}"


def touches(trajectory: Trajectory, scenario: Scenario) -> tuple[Touch, ...]:
    """Every beginning of a contact with a person, in order of time."""
    begun = beginnings(trajectory.contacts, scenario.control.period)
    return tuple(
        judged(
            contact,
            trajectory.robot_pose[row],
            trajectory.robot_twist[row],
            trajectory.people_position[row],
            trajectory.people_velocity[row],
            sees=sees_robot(scenario),
        )
        for contact in begun
        if contact.kind == PERSON
        for row in [max(int(np.searchsorted(trajectory.time, contact.time + 1e-9)) - 1, 0)]
    )


def judged(
    contact: Contact, pose: Array, twist: Array, people: Array, walking: Array, *, sees: Sequence[bool]
) -> Touch:
    """One contact with a person, from the state before it: pose (3,), twist (2,), people and velocities (P, 2)."""
    person = int(contact.name.removeprefix(PERSON))
    own = twist[0] * np.array([np.cos(pose[2]), np.sin(pose[2])])
    towards = people[person] - pose[:2]
    speed = abs(float(twist[0]))
    faster = float((own + walking[person]) @ towards) >= 0.0  # u.n >= -w.n
    moving = speed > STALLED_SPEED
    return Touch(person, contact.time, speed, moving, moving and (faster or not sees[person]))


def sees_robot(scenario: Scenario) -> tuple[bool, ...]:
    """Whether each person sees the robot and takes account of it, (P,).

    A person of a behaviour that walks on whatever happens does not, unless a temperament makes them: for them
    `sees_robot = true` alone changes nothing.
    """
    return tuple(
        person.sees and (isinstance(person.behaviour, SEEING) or person.temperament not in (None, REGULAR))
        for person in scenario.people
    )


def people_see_robot(scenario: Scenario) -> str | None:
    """How many do: "all", "none" or "3 of 5"; None without people."""
    sees = sees_robot(scenario)
    if not sees:
        return None
    return "all" if all(sees) else f"{sum(sees)} of {len(sees)}" if any(sees) else "none"
