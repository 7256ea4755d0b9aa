"""The quantities of a run file and their ranges."""

from typing import Annotated

from mjnav.settings import Range

MAX_LENGTH = 1e4  # [m], and [rad] for headings: far beyond any room, far within what physics computes with
MIN_SIZE = 1e-3  # [m]
MIN_RATE, MAX_RATE = 0.1, 1000.0  # [Hz]
MAX_TIME = 1e6  # [s], a week and a half
MAX_SEED = 2**63 - 1
MAX_BODIES = 500  # of people, tables and pillars each: physics needs seconds a tick for as many people
MAX_WALLS = 5000  # of a map: the robot's controller sees the nearest
MAX_POINTS = 1000  # of a route: every metric compares every tick with every leg of it

Coordinate = Annotated[float, Range(-MAX_LENGTH, MAX_LENGTH, "m")]
Angle = Annotated[float, Range(-MAX_LENGTH, MAX_LENGTH, "rad")]
Point = tuple[Coordinate, Coordinate]
Line = tuple[Coordinate, Coordinate, Coordinate]  # a, b, c of a x + b y + c = 0
Size = Annotated[float, Range(MIN_SIZE, MAX_LENGTH, "m")]
Rate = Annotated[float, Range(MIN_RATE, MAX_RATE, "Hz")]
Seed = Annotated[int, Range(0, MAX_SEED)]
