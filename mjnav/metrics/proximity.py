"""How close the robot was to people, and for how long; distances are between surfaces [m].

The spaces are those of Hall, The Hidden Dimension (1966). A person who is not there (NaN) is at no distance.
HuNavSim (Perez-Higueras et al. 2023) measures from the robot's surface to the person's centre, which is the person's
radius more, and gives the share of each ring alone: here social - personal, personal - intimate.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks
from mjnav.metrics.kinematics import velocity
from mjnav.scenarios.spec import Scenario

INTIMATE, PERSONAL, SOCIAL = 0.45, 1.2, 3.6  # [m] outer ends of the spaces; Hall (1966)
COMPLIANT = 0.5  # [m] from which on space is kept; Francis et al. (2023), table 1


@dataclass(frozen=True, slots=True)
class Proximity:
    """Shares of the states at the ticks."""

    mean_distance: float | None  # [m] from the nearest person, over the states at which somebody is there
    compliance: float  # at least COMPLIANT from everybody
    intimate: float  # somebody nearer than INTIMATE
    personal: float  # nearer than PERSONAL, so at least as much as `intimate`
    social: float  # nearer than SOCIAL


def nearest_person(trajectory: Trajectory, scenario: Scenario) -> Array:
    """Distance from the nearest person's surface at each state, (T + 1,) [m]; infinite where nobody is there."""
    reach = radii(scenario)

    def nearest(pose: Array, people: Array) -> Array:
        apart = people - pose[:, None, :2]
        distance = np.hypot(apart[..., 0], apart[..., 1]) - reach
        return np.where(np.isnan(distance), np.inf, distance).min(axis=1, initial=np.inf)

    return by_blocks(nearest, trajectory.robot_pose, trajectory.people_position)


def radii(scenario: Scenario) -> Array:
    """The robot's radius plus each person's, (P,) [m]."""
    return scenario.robot.radius + np.array([person.radius for person in scenario.people])


def proximity(trajectory: Trajectory, scenario: Scenario) -> Proximity | None:
    """How close the robot was to the nearest person; None in a scene without people."""
    if not scenario.people:
        return None
    distance = nearest_person(trajectory, scenario)
    there = np.isfinite(distance)
    return Proximity(
        mean_distance=float(distance[there].mean()) if there.any() else None,
        compliance=float((distance >= COMPLIANT).mean()),
        intimate=float((distance < INTIMATE).mean()),
        personal=float((distance < PERSONAL).mean()),
        social=float((distance < SOCIAL).mean()),
    )


def min_time_to_collision(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """Least time after which robot and a person touch if both keep the velocities of the tick [s].

    With r the person's position and q its velocity, both relative to the robot's, and R the radii's sum:
    tau = (-r.q - sqrt((r.q)^2 - |q|^2 (|r|^2 - R^2))) / |q|^2 where r.q < 0 and the root is real, 0 in contact; the
    minimum over states and people, None where nobody was ever on a collision course. Source: Francis et al. (2023),
    table 1; Hayward, Near-miss determination through use of a scale of danger (1972).
    """
    reach = radii(scenario)

    def least(pose: Array, own: Array, people: Array, walking: Array) -> Array:
        r, q = people - pose[:, None, :2], walking - own[:, None]
        closing, squared = (r * q).sum(-1), (q * q).sum(-1)
        outside = (r * r).sum(-1) - reach**2
        root = closing**2 - squared * outside
        meets = (closing < 0.0) & (root >= 0.0) & (outside > 0.0)
        tau = np.full(closing.shape, np.inf)
        # The form without cancellation: outside / (-closing + sqrt(root)) is the same.
        np.divide(outside, np.sqrt(np.maximum(root, 0.0)) - closing, out=tau, where=meets)
        tau[outside <= 0.0] = 0.0
        return tau.min(axis=1, initial=np.inf)

    columns = (trajectory.robot_pose, velocity(trajectory), trajectory.people_position, trajectory.people_velocity)
    found = float(by_blocks(least, *columns).min(initial=np.inf))
    return found if np.isfinite(found) else None
