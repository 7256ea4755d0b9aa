"""The table [crowd] of a run file: which recording, how it lies in the scene, and what its people do."""

from dataclasses import dataclass
from typing import Annotated

from mjnav.config import Choice, Length, Range, below, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.crowd.reader import COLUMNS, check_columns
from mjnav.scenarios.people import TEMPERAMENTS
from mjnav.scenarios.ranges import MAX_LENGTH, MAX_TIME, Angle, Point

MAX_FRAME_RATE = 1e6
RADIUS = 0.25  # [m]

Seconds = Annotated[float, Range(0.0, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Crowd:
    """People from a recording; they stand behind those of `people`, and in the resolved scene among them."""

    file: Annotated[str, "the recording, from the run file's folder or else the working folder"]
    frame_rate: Annotated[
        float, Range(0.0, MAX_FRAME_RATE, "Hz", open_low=True), "what the column of frames counts a second"
    ]
    columns: Annotated[
        tuple[Annotated[str, Choice(COLUMNS)], ...],
        Length(0, 100),
        'what the columns are, "-" for those without use; by default by the header, or by their number',
    ] = ()
    scale: Annotated[float, Range(0.0, MAX_LENGTH, "m", open_low=True), "a unit of the file"] = 1.0
    mirror: Annotated[bool, "turn y round, as for coordinates of pictures, whose y points down"] = False
    rotation: Annotated[Angle, "of the recording about its origin, counter-clockwise"] = 0.0
    offset: Annotated[Point, "where the recording's origin lies"] = (0.0, 0.0)
    crop: Annotated[tuple[Point, Point] | None, "two corners: people outside are not there"] = None
    window: Annotated[
        tuple[Seconds, Seconds] | None, "the part of the recording, from its first frame on; all of it by default"
    ] = None
    max_gap: Annotated[Seconds, "the longest time without a row over which a track goes on"] = 2.0
    people: Annotated[
        str,
        Choice(("replay", "react")),
        "replay: as recorded; react: social_force from the recorded start to the recorded end at the recorded speed",
    ] = "replay"
    radius: Annotated[float, Range(0.1, 1.0, "m"), "of everybody's round body"] = RADIUS
    sees_robot: Annotated[bool | None, "whether the robot exists for them; by default for those who react"] = None
    temperament: Annotated[
        Annotated[str, Choice(tuple(TEMPERAMENTS))] | None, "how they take a robot that they see: regular by default"
    ] = None

    def __post_init__(self):
        settle(self)
        if self.columns:
            check_columns("columns", self.columns)
        if self.window is not None and not self.window[0] < self.window[1]:
            raise InvalidValue("window", self.window, "[from, to] with from < to")
        if self.crop is not None:
            (x0, y0), (x1, y1) = self.crop
            with below("crop"):
                if x0 == x1 or y0 == y1:
                    raise InvalidValue("1", self.crop[1], f"the corner opposite to {self.crop[0]}")
