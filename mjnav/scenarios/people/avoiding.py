"""People who walk from waypoint to waypoint and avoid one another, the robot, walls and furniture."""

from dataclasses import dataclass, fields
from math import pi
from typing import Annotated

from mjnav.config import Choice, Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.people.walkers import Walker
from mjnav.scenarios.ranges import MAX_LENGTH, MAX_TIME

FORM_NAMES = ("moussaid", "moussaid_2009", "helbing")
Weight = Annotated[float, Range(0.0, 1000.0)]
Push = Annotated[float, Range(0.0, 1000.0, "m/s²")]
Metres = Annotated[float, Range(1e-3, MAX_LENGTH, "m")]
Seconds = Annotated[float, Range(1e-3, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Diagonal:
    """A change of mind: from some moment on the person walks 45° to the left of the way, until the next trip."""

    probability: Annotated[float, Range(0.0, 1.0), "of it, each time that it is drawn"] = 0.025
    every: Annotated[int, Range(1, 10_000), "decisions (of 0.02 s) between two draws"] = 4

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Avoiding(Walker):
    """What both laws share."""

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

    def __post_init__(self):
        Walker.__post_init__(self)
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

    time_horizon: Annotated[Seconds, "τ, time ahead free of collisions with people, the robot and pillars"] = 2.0
    wall_horizon: Annotated[Seconds, "time ahead free of collisions with walls and tables"] = 0.5
    neighbour_distance: Annotated[Metres, "between centres, beyond which nobody counts"] = 10.0
    max_neighbours: Annotated[int, Range(0, 1000), "the nearest of them count"] = 10
    robot_share: Annotated[
        float, Range(0.0, 1.0), "of the avoidance that the person takes where the robot is met: 1/2 as between people"
    ] = 0.5

    def __post_init__(self):
        Walker.__post_init__(self)
