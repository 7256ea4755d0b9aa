"""Effect of the robot on people: how close it was and for how long, social forces, and people's detours.

Distances are between surfaces [m]. The spaces are those of Hall, The Hidden Dimension (1966). A person who is absent
(NaN) is at no distance. HuNavSim (Perez-Higueras et al. 2023) measures from the robot's surface to the person's centre,
which is the person's radius more, and gives the share of each ring alone: here social - personal, personal - intimate.

The social forces between the robot and the people are summed up as HuNavSim does. The force on body i from body j per
unit of mass is that of Moussaid et al. (2009),

    D = lambda (v_i - v_j) + e,   t = D / |D|,   n its left normal,   theta the angle from t to e,   B = gamma |D|,
    f_ij = -A exp(-d / B) [exp(-(n' B theta)^2) t + sign(theta) exp(-(n B theta)^2) n],

with d, e distance and unit vector from i to j. It is antisymmetric, f_ji = -f_ij: the robot pushes a person as hard as
the person pushes it. The nearest wall, leg or pillar pushes the robot with A_o exp(-d_o / B_o) from its surface.

`mjnav.motion.social_force` has this law for people's decisions, as a kernel; here it is an expression over all ticks,
so that a log is inspected without compiled code. A test holds the two equal.

Detours compare people's paths and times with the robot to those without it, under the same seed. A person's path is
compared up to the last of their waypoints that they reach in both runs, and their position at equal times while they
are present in both. A person who leaves or comes in again is compared until then: later trips start where the robot is
not, and differ for that reason.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics import consistency
from mjnav.metrics.definitions import HIGHER, HUNAVSIM, LOWER, NOBODY, TABLE_1, Definition, figures
from mjnav.metrics.effort import velocity
from mjnav.metrics.progress import by_blocks, passings
from mjnav.metrics.safety import people_radius, thing_distance
from mjnav.scene.spec import Scenario

# ---------------------------------------------------------------------------------------- proximity


INTIMATE, PERSONAL, SOCIAL = 0.45, 1.2, 3.6  # [m] outer ends of the spaces; Hall (1966)
COMPLIANT = 0.5  # [m] from which on space is kept; Francis et al. (2023), table 1


def nearest_person(trajectory: Trajectory, scenario: Scenario) -> Array:
    """Distance from the nearest person's surface at each state, (T + 1,) [m]; infinite where nobody is there."""

    def nearest(pose: Array, people: Array, reach: Array) -> Array:
        apart = people - pose[:, None, :2]
        distance = np.hypot(apart[..., 0], apart[..., 1]) - reach
        return np.where(np.isnan(distance), np.inf, distance).min(axis=1, initial=np.inf)

    return by_blocks(nearest, trajectory.robot_pose, trajectory.people_position, radii(trajectory, scenario))


def radii(trajectory: Trajectory, scenario: Scenario) -> Array:
    """The robot's radius plus each person's, at each state, (T + 1, P) [m]."""
    return scenario.robot.radius + people_radius(trajectory, scenario)


@figures(
    "social",
    Definition("mean_human_distance_m", words="mean distance from the nearest person", source=HUNAVSIM),
    Definition("space_compliance", better=HIGHER, source=TABLE_1),
    *(
        Definition(f"{name}_space_share", f"share of the ticks at which somebody's surface is less than {distance} m "
                   "from the robot's", better=LOWER, words=f"share of time in {name} space",
                   source=f"Hall (1966); {HUNAVSIM}")
        for name, distance in (("intimate", INTIMATE), ("personal", PERSONAL), ("social", SOCIAL))
    ),
    null=NOBODY, over_all=True,
)  # fmt: skip
def proximity(trajectory: Trajectory, scenario: Scenario) -> tuple[float | None, ...] | None:
    """How close the robot was to the nearest person; None in a scene without people.

    * mean_human_distance_m: distance of the robot's surface from the nearest person's, mean over the ticks at which
      somebody is there
    * space_compliance: share of the ticks at which every person's surface is at least 0.5 m from the robot's
    """
    if not scenario.people:
        return None
    distance = nearest_person(trajectory, scenario)
    shares = (float((distance < space).mean()) for space in (INTIMATE, PERSONAL, SOCIAL))
    return consistency.mean(distance), float((distance >= COMPLIANT).mean()), *shares


@figures(
    "social",
    Definition("min_time_to_collision_s", better=HIGHER, words="least time to collision", source=TABLE_1,
               over_all=True,
               equation=r"\min_{k,i} \min\{\tau \ge 0 : \lvert r_{ki} + \tau q_{ki}\rvert \le \rho + \rho_i\}",
               null="nobody was ever on a collision course"),
)  # fmt: skip
def min_time_to_collision(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """Least time after which robot and a person touch if both keep the velocities of the tick [s].

    With r the person's position and q its velocity, both relative to the robot's, and R the radii's sum:
    tau = (-r.q - sqrt((r.q)^2 - |q|^2 (|r|^2 - R^2))) / |q|^2 where r.q < 0 and the root is real, 0 in contact; the
    minimum over states and people, None where nobody was ever on a collision course. Source: Francis et al. (2023),
    table 1; Hayward, Near-miss determination through use of a scale of danger (1972).

    * min_time_to_collision_s: time after which robot and a person would touch if both kept their velocities, minimum
      over ticks and people
    """

    def least(pose: Array, own: Array, people: Array, walking: Array, reach: Array) -> Array:
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
    found = float(by_blocks(least, *columns, radii(trajectory, scenario)).min(initial=np.inf))
    return found if np.isfinite(found) else None


# ------------------------------------------------------------------------------------ social forces


# HuNavSim's constants, those of the library lightsfm.
STRENGTH = 2.1  # [m/s^2] A
VELOCITY_WEIGHT = 2.0  # [s/m] lambda
RANGE = 0.35  # [m] gamma
TURN_SHARPNESS, SLOW_SHARPNESS = 2.0, 3.0  # [1/m] n, n'
OBSTACLE_STRENGTH = 10.0  # [m/s^2] A_o
OBSTACLE_RANGE = 0.2  # [m] B_o
STRAIGHT = 1e-9  # [rad] of theta that are rounding: there sign(theta) is 0


@figures(
    "social",
    Definition("social_force_on_people_m_s", words="social force on people",
               equation=r"\sum_k \Delta t \sum_i \lvert f_{ir}\rvert"),
    Definition("social_force_on_robot_m_s", words="social force on the robot",
               equation=r"\sum_k \Delta t\, \lvert\sum_i f_{ri}\rvert"),
    Definition("social_work_m_s", words="social work"),
    better=LOWER, null=NOBODY, source=HUNAVSIM,
)  # fmt: skip
def social_forces(trajectory: Trajectory, scenario: Scenario) -> tuple[float, float, float] | None:
    """The forces of a run per unit of mass, integrated over time; None without people.

    People count whether they see the robot or not. Each tick's force stands for the period after it. HuNavSim adds up
    the samples in place of integrating: its sums are these over the sampling period. Its force on the robot adds the
    sizes of the single forces, and so is that on the people; here it is the size of their sum.

    * social_force_on_people_m_s: sizes of the social forces of the robot on people, each as if they saw it, summed over
      people and integrated over time, per unit of mass; law and constants are HuNavSim's
    * social_force_on_robot_m_s: size of the sum of the social forces of people on the robot, integrated over time
    * social_work_m_s: social_force_on_people_m_s + social_force_on_robot_m_s + that of the nearest wall, leg or pillar
      on the robot
    """
    if not scenario.people:
        return None
    columns = (trajectory.robot_pose, velocity(trajectory), trajectory.people_position, trajectory.people_velocity)
    on_people, on_robot = by_blocks(_sizes, *(column[:-1] for column in columns)).T
    distance = thing_distance(trajectory.robot_pose[:-1, :2], scenario) - scenario.robot.radius
    of_things = OBSTACLE_STRENGTH * np.exp(-distance / OBSTACLE_RANGE)
    period = np.diff(trajectory.time)
    people, robot, things = (float(period @ force) for force in (on_people, on_robot, of_things))
    return people, robot, people + robot + things


def _sizes(pose: Array, own: Array, people: Array, walking: Array) -> Array:
    """The sum of the sizes of the forces between robot and people, and the size of their sum, (T, 2) [m/s^2]."""
    force = np.nan_to_num(pair_force(people - pose[:, None, :2], own[:, None] - walking))
    total = force.sum(axis=1)
    return np.column_stack([np.hypot(force[..., 0], force[..., 1]).sum(axis=1), np.hypot(total[:, 0], total[:, 1])])


def pair_force(apart: Array, closing: Array) -> Array:
    """f_ij for p_j - p_i (..., 2) [m] and v_i - v_j (..., 2) [m/s], (..., 2) [m/s^2]; NaN at one and the same place."""
    with np.errstate(invalid="ignore", divide="ignore"):
        d = np.hypot(apart[..., 0], apart[..., 1])[..., None]
        e = apart / d
        way = VELOCITY_WEIGHT * closing + e
        size = np.hypot(way[..., 0], way[..., 1])[..., None]
        t = way / size
        cross = t[..., :1] * e[..., 1:] - t[..., 1:] * e[..., :1]
        theta, reach = np.arctan2(cross, (t * e).sum(-1, keepdims=True)), RANGE * size
        slow = np.exp(-d / reach - (SLOW_SHARPNESS * reach * theta) ** 2)
        side = np.where(np.abs(theta) < STRAIGHT, 0.0, np.sign(theta))
        turn = side * np.exp(-d / reach - (TURN_SHARPNESS * reach * theta) ** 2)
        normal = np.concatenate([-t[..., 1:], t[..., :1]], axis=-1)
        return -STRENGTH * (slow * t + turn * normal)


# ------------------------------------------------------------------------------------------ detours


@dataclass(frozen=True, slots=True)
class Detour:
    """Means over people; None where nobody counts."""

    path_m: float | None = None  # length with the robot minus without it, to the last waypoint reached in both
    delay_s: float | None = None  # by which this waypoint is reached later with the robot
    displacement_m: float | None = None  # distance between the two positions at equal time, mean over time and people


_NOT_ASKED = "not asked for, or no such people"


@figures(
    "social",
    Definition("detour.path_m", words="detour of people", equation=r"\operatorname{mean}_i (L_i - L_i^0)"),
    Definition("detour.delay_s", words="delay of people", equation=r"\operatorname{mean}_i (\tau_i - \tau_i^0)"),
    Definition("detour.displacement_m", words="displacement of people",
               equation=r"\operatorname{mean}_{k,i} \lvert p_i(t_k) - p_i^0(t_k)\rvert"),
    better=LOWER, null=_NOT_ASKED, over_all=True,
)  # fmt: skip
def detour(trajectory: Trajectory, undisturbed: Array, scenario: Scenario) -> Detour:
    """Of a run against `undisturbed` (T + 1, P, 2), where the people are at the same times without the robot [m].

    * detour.path_m: what the robot adds to people's paths to the last waypoint that they reach with and without it,
      mean over the people who reach one; asked for by --detour
    * detour.delay_s: by how much later than without the robot people reach that waypoint, mean; asked for by --detour
    * detour.displacement_m: distance between where people are and where they are at the same time without the robot,
      mean over ticks and people; asked for by --detour
    """
    paths, delays, displacements = [], [], []
    for i, person in enumerate(scenario.people):
        with_robot, without = _first_stay(trajectory.people_position[:, i]), _first_stay(undisturbed[:, i])
        apart = np.hypot(*(with_robot - without).T)
        displacements.append(apart[np.isfinite(apart)])
        reached, alone = passings(person, with_robot), passings(person, without)
        if common := min(len(reached), len(alone)):
            there, then = int(reached[common - 1]), int(alone[common - 1])
            delays.append(float(trajectory.time[there] - trajectory.time[then]))
            paths.append(_length(with_robot[: there + 1]) - _length(without[: then + 1]))
    apart = np.concatenate([np.zeros(0), *displacements])
    return Detour(*map(consistency.mean, (np.array(paths), np.array(delays), apart)))


def _first_stay(position: Array) -> Array:
    """The positions (T + 1, 2) until the person first goes; NaN before they come and from then on."""
    there = np.isfinite(position[:, 0])
    gone = np.flatnonzero(there[:-1] & ~there[1:])
    if not gone.size:
        return position
    stay = position.copy()
    stay[gone[0] + 1 :] = np.nan
    return stay


def _length(position: Array) -> float:
    """Of a path through positions (n, 2), without what is not known."""
    return float(np.nansum(np.hypot(*np.diff(position, axis=0).T)))
