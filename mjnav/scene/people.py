"""People of a run file: temperaments, the keys of each behaviour, and the keys that every person has.

A temperament is how a person reacts to a robot that they see. People walk straight on, from waypoint to waypoint, or as
they were recorded. With `social_force` and `orca` they walk from waypoint to waypoint and avoid one another, the robot,
walls and furniture. A trip has an area in which it begins and one in which it ends.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from math import hypot, pi
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

from mjnav.errors import InvalidValue
from mjnav.motion import WALKING_ACCELERATION
from mjnav.scene.ranges import MAX_LENGTH, MAX_POINTS, MAX_TIME, Coordinate, Point
from mjnav.settings import Beside, Choice, Key, Length, Range, Settled, Variants
from mjnav.settings.plugins import BehaviourPlugin

# ------------------------------------------------------------------------------------- temperaments


REGULAR, YIELDS, IMPASSIVE = "regular", "yields", "impassive"
CURIOUS, SCARED, THREATENING = "curious", "scared", "threatening"

# After the six of HuNavSim (Perez-Higueras et al. 2023), where `yields` is called surprised.
TEMPERAMENTS: Mapping[str, str] = MappingProxyType(
    {
        REGULAR: "takes the robot as the behaviour does: as anybody, or not at all",
        YIELDS: "stands while the robot is near",
        IMPASSIVE: "takes the robot for a thing at rest",
        CURIOUS: "walks up to the robot",
        SCARED: "walks slowly, and away from the robot",
        THREATENING: "steps in front of the robot",
    }
)


# -------------------------------------------------------------------------------------- straight on


class Behaviour(Settled):
    """What the keys of every behaviour have in common."""

    __slots__ = ()
    walk: ClassVar[str]  # "module:Class" in mjnav.world.people, which moves the people who have this behaviour
    heeds_robot: ClassVar[bool] = False  # whether they take account of the robot, unless the file says otherwise


PERIOD = 0.02  # [s] between people's decisions
MAX_WALKING_SPEED = 5.0  # [m/s]

Component = Annotated[float, Range(-MAX_WALKING_SPEED, MAX_WALKING_SPEED, "m/s")]
Velocity = tuple[Component, Component]


def _check_speed(velocity: Velocity) -> None:
    if not hypot(*velocity) <= MAX_WALKING_SPEED:
        raise InvalidValue("velocity", velocity, f"at most {MAX_WALKING_SPEED:g} m/s")


@dataclass(frozen=True, slots=True)
class ConstantVelocity(Behaviour):
    """Walks straight on, until something is in the way."""

    walk = "walk:Straight"
    velocity: Annotated[Velocity, "along x and y"]

    def _check(self):
        _check_speed(self.velocity)


@dataclass(frozen=True, slots=True)
class StopAndGo(Behaviour):
    """Walks for `go_time`, stands for `stop_time`, and so on, until something is in the way."""

    walk = "walk:Straight"
    velocity: Annotated[Velocity, "along x and y, while walking"]
    go_time: Annotated[float, Range(1e-3, MAX_TIME, "s"), "walked before each stop"] = 2.0
    stop_time: Annotated[float, Range(0.0, MAX_TIME, "s"), "of each stop"] = 1.0

    def _check(self):
        _check_speed(self.velocity)


# -------------------------------------------------------------------------------------------- trips


STAY, LEAVE, AGAIN = "stay", "leave", "again"
AT_END = (STAY, LEAVE, AGAIN)
AGAIN_WITHIN = 2.0  # [m] from the goal, as in the corridor of mpc_planner (tud-amr)
CLEAR_OF_ROBOT = 5.0  # [m], likewise

Area = tuple[Point, Point]


@dataclass(frozen=True, slots=True)
class Trip(Settled):
    """A way from a random point of one area to a random point of another."""

    start: Annotated[Area, Key("from"), "two opposite corners of the area where the way begins"]
    goal: Annotated[Area, Key("to"), "two opposite corners of the area where it ends"]


# ------------------------------------------------------------------------ from waypoint to waypoint


REACHED = 0.2  # [m] from a waypoint on the way at which the next one counts
MAX_TRIPS = 100
Distance = Annotated[float, Range(0.0, MAX_LENGTH, "m")]


@dataclass(frozen=True, slots=True)
class Walker(Behaviour):
    """Whoever walks from point to point.

    A key that may be None is not in a dump unless it was given: the cells of older studies keep their names.
    """

    waypoints: Annotated[tuple[Point, ...], Length(1, MAX_POINTS), "points to walk through, in order"]
    speed: Annotated[float, Range(0.0, MAX_WALKING_SPEED, "m/s"), "between the points"] = 1.0
    loop: Annotated[bool, "walk on from the last point to the first; false by default where at_end is given"] = True
    at_end: Annotated[
        Annotated[str, Choice(AT_END)] | None,
        "at the last point: stay there (the default), leave the scene, or leave and come again on one of the trips",
    ] = None
    trips: Annotated[
        Annotated[tuple[Trip, ...], Length(1, MAX_TRIPS)] | None,
        'ways of at_end = "again", of which each has the same chance',
    ] = None
    again_within: Annotated[
        Distance | None, f"from the last point, where the person leaves to come again; {AGAIN_WITHIN:g} by default"
    ] = None
    clear_of_robot: Annotated[
        Distance | None, f"between robot and person, at least, where one comes again; {CLEAR_OF_ROBOT:g} by default"
    ] = None

    def _check(self):
        if self.loop and self.at_end is not None:
            raise InvalidValue("at_end", self.at_end, "nothing beside loop = true: who loops has no end")
        if self.at_end == AGAIN and self.trips is None:
            raise InvalidValue("trips", None, 'an array of tables with from and to; at_end = "again" requires it')
        for key in ("trips", "again_within", "clear_of_robot"):
            if self.at_end != AGAIN and getattr(self, key) is not None:
                found = f"{len(self.trips)} of them" if key == "trips" and self.trips else getattr(self, key)
                raise InvalidValue(key, found, 'nothing without at_end = "again"')

    @staticmethod
    def dependent_defaults(arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Who is told what to do at the end has one."""
        return {"loop": arguments.get("at_end") is None}

    @property
    def leaves_within(self) -> float | None:
        """The distance from the last point at which the person leaves the scene [m]; None for those who do not."""
        if self.at_end in (None, STAY):
            return None
        return (AGAIN_WITHIN if self.again_within is None else self.again_within) if self.trips else REACHED

    def legs(self, start: Point) -> list[tuple[int, Point, Point]]:
        """The straight legs of the way from `start`: index of the waypoint that each leads to, and both ends."""
        back = self.waypoints[:1] if self.loop and len(self.waypoints) > 1 else ()
        points = (start, *self.waypoints, *back)
        return [(i % len(self.waypoints), *leg) for i, leg in enumerate(pairwise(points))]


@dataclass(frozen=True, slots=True)
class Waypoints(Walker):
    """Walks from point to point; with `loop` from the last back to the first, else stands there."""

    walk = "walk:Route"


# -------------------------------------------------------------------------------------- as recorded


MAX_ROWS = 50_000  # of a track: five hours at 2.5 Hz
LEAST_STEP = 1e-3  # [s]

Row = tuple[Annotated[float, Range(-MAX_TIME, MAX_TIME, "s")], Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class Replay(Behaviour):
    """Walks along a recorded track, on a cubic spline through its rows; from beside it, walks to it."""

    walk = "walk:Replayed"
    track: Annotated[tuple[Row, ...], Length(2, MAX_ROWS), "[t, x, y] each: where the person is at which time"]

    def _check(self):
        for i, (before, after) in enumerate(pairwise(self.track), start=1):
            if after[0] < before[0] + LEAST_STEP:
                allowed = f"a time at least {LEAST_STEP:g} s after that of the row before, {before[0]:g} s"
                raise InvalidValue(f"track.{i}.0", after[0], allowed)


# ---------------------------------------------------------------------------------- avoiding others


FORM_NAMES = ("moussaid", "moussaid_2009", "helbing")
Weight = Annotated[float, Range(0.0, 1000.0)]
Push = Annotated[float, Range(0.0, 1000.0, "m/s²")]
Metres = Annotated[float, Range(1e-3, MAX_LENGTH, "m")]
Seconds = Annotated[float, Range(1e-3, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Diagonal(Settled):
    """A change of mind: from some moment on the person walks 45° to the left of the way, until the next trip."""

    probability: Annotated[float, Range(0.0, 1.0), "of it, each time that it is drawn"] = 0.025
    every: Annotated[int, Range(1, 10_000), "decisions (of 0.02 s) between two draws"] = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Avoiding(Walker):
    """What both laws share."""

    heeds_robot = True
    personal_space: Annotated[
        float, Range(0.0, 5.0, "m"), "that the person keeps from the robot, surface to surface, where there is room"
    ] = 0.2
    acceleration: Annotated[float, Range(0.1, 1000.0, "m/s²"), "at most; at 1000 people turn round at once"] = (
        WALKING_ACCELERATION
    )
    unsteadiness: Annotated[
        float, Range(0.0, 5.0, "m/s"), "standard deviation of the noise on each component of the velocity, each 0.02 s"
    ] = 0.0
    diagonal: Annotated[Diagonal | None, "changes of mind: the person walks on at 45° to the way; none by default"] = (
        None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SocialForce(Avoiding):
    """Walks from point to point, pushed away from people, the robot, walls and furniture by social forces.

    Constants that are not given are those of the form.
    """

    walk = "avoiding:SocialForceWalk"
    form: Annotated[
        str,
        Choice(FORM_NAMES),
        "moussaid_2009: Moussaïd et al. 2009; moussaid: the same with the weights, walls and push of the corridor in "
        "which T-MPC and DRA-MPPI were measured; helbing: Helbing & Molnár 1995",
    ] = "moussaid_2009"
    relaxation_time: Annotated[Seconds | None, "τ, in which the velocity follows the wanted one"] = None
    drive: Annotated[Weight | None, "k, push along the way over the wanted speed, in place of τ"] = None
    strength: Annotated[Weight | None, "of the force between people: A [m/s²], or helbing's V⁰ [m²/s²]"] = None
    velocity_weight: Annotated[Weight | None, "λ, weight of the relative velocity"] = None
    interaction_range: Annotated[Metres | None, "γ, or helbing's σ"] = None
    turn_sharpness: Annotated[Weight | None, "n, angular width of turning aside"] = None
    slow_sharpness: Annotated[Weight | None, "n', angular width of slowing down"] = None
    step_time: Annotated[Seconds | None, "Δt of helbing's ellipse"] = None
    field_of_view: Annotated[
        Annotated[float, Range(0.0, 2.0 * pi, "rad")] | None, "2φ of helbing's; who is outside counts less"
    ] = None
    unseen: Annotated[Annotated[float, Range(0.0, 1.0)] | None, "c, how much less"] = None
    cut: Annotated[Metres | None, "distance beyond which nobody counts"] = None
    obstacle_strength: Annotated[Push | None, "of walls and furniture"] = None
    obstacle_range: Annotated[Metres | None, "of walls and furniture"] = None
    lookahead: Annotated[Weight | None, "of the push aside from those who come towards the person"] = None

    def _check(self):
        Walker._check(self)
        foreign = _HELBING if self.form != "helbing" else _MOUSSAID
        for key in foreign:
            if getattr(self, key) is not None:
                raise InvalidValue(
                    key, getattr(self, key), f'no value with form = "{self.form}", which has no such key'
                )
        if self.relaxation_time is not None and self.drive is not None:
            raise InvalidValue("drive", self.drive, "no value beside relaxation_time")

    @property
    def constants(self) -> dict[str, float]:
        """What was given in place of the form's own, by its name."""
        given = {field.name: getattr(self, field.name) for field in fields(SocialForce)[_FIRST_CONSTANT:]}
        return {key: value for key, value in given.items() if value is not None}


_HELBING = ("step_time", "field_of_view", "unseen")
_MOUSSAID = ("velocity_weight", "turn_sharpness", "slow_sharpness")
_FIRST_CONSTANT = [field.name for field in fields(SocialForce)].index("relaxation_time")


@dataclass(frozen=True, slots=True, kw_only=True)
class Orca(Avoiding):
    """Walks from point to point by optimal reciprocal collision avoidance (van den Berg et al. 2011)."""

    walk = "avoiding:OrcaWalk"
    time_horizon: Annotated[Seconds, "τ, time ahead free of collisions with people, the robot and pillars"] = 2.0
    wall_horizon: Annotated[Seconds, "time ahead free of collisions with walls and tables"] = 0.5
    neighbour_distance: Annotated[Metres, "between centres, beyond which nobody counts"] = 10.0
    max_neighbours: Annotated[int, Range(0, 1000), "the nearest of them count"] = 10
    robot_share: Annotated[
        float, Range(0.0, 1.0), "of the avoidance that the person takes where the robot is met: 1/2 as between people"
    ] = 0.5


# ----------------------------------------------------------------------------------------- a person


BEHAVIOURS: Mapping[str, type[Behaviour]] = MappingProxyType(
    {
        "constant_velocity": ConstantVelocity,
        "stop_and_go": StopAndGo,
        "waypoints": Waypoints,
        "social_force": SocialForce,
        "orca": Orca,
        "replay": Replay,
    }
)
Walking = Annotated[Behaviour | BehaviourPlugin, Variants("behaviour", BEHAVIOURS, BehaviourPlugin)]

Moment = Annotated[float, Range(0.0, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Person(Settled):
    """A walking person; the file has the behaviour's name in `behaviour` and its keys beside it.

    A key that may be None is not in a dump unless it was given: the cells of older studies keep their names.
    """

    start: Annotated[Point, "where the person stands at first"]
    behaviour: Annotated[Walking, Beside(), "how the person walks"]
    radius: Annotated[float, Range(0.1, 1.0, "m"), "of the round body"] = 0.3
    sees_robot: Annotated[
        bool | None,
        "whether the robot exists for this person; true by default for social_force, orca, behaviours of one's own and "
        "temperaments but regular and impassive, false for all others, which walk as if it were not there",
    ] = None
    temperament: Annotated[
        Annotated[str, Choice(tuple(TEMPERAMENTS))] | None,
        "how the person takes a robot that they see: regular by default",
    ] = None
    enters: Annotated[
        Moment | None, "when the person comes in, or as soon as the place is free; from the beginning by default"
    ] = None
    leaves: Annotated[Moment | None, "when the person goes; never by default"] = None

    def _check(self):
        if self.leaves is not None and self.leaves <= (self.enters or 0.0):
            raise InvalidValue("leaves", self.leaves, f"a time after enters ({self.enters or 0.0:g} s)")

    @property
    def from_the_start(self) -> bool:
        """Whether the person is there when the run begins."""
        return not self.enters

    @property
    def sees(self) -> bool:
        """Whether the robot exists for this person: `sees_robot`, or the default of behaviour and temperament."""
        if self.sees_robot is not None:
            return self.sees_robot
        return self.behaviour.heeds_robot or self.temperament not in (None, REGULAR, IMPASSIVE)
