"""People who walk as they were recorded."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from mjnav.config import Length, Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.ranges import MAX_TIME, Coordinate

MAX_ROWS = 50_000  # of a track: five hours at 2.5 Hz
LEAST_STEP = 1e-3  # [s]

Row = tuple[Annotated[float, Range(-MAX_TIME, MAX_TIME, "s")], Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class Replay:
    """Walks along a recorded track, on a cubic spline through its rows; from beside it, walks to it."""

    track: Annotated[tuple[Row, ...], Length(2, MAX_ROWS), "[t, x, y] each: where the person is at which time"]

    def __post_init__(self):
        settle(self)
        for i, (before, after) in enumerate(pairwise(self.track), start=1):
            if after[0] < before[0] + LEAST_STEP:
                allowed = f"a time at least {LEAST_STEP:g} s after that of the row before, {before[0]:g} s"
                raise InvalidValue(f"track.{i}.0", after[0], allowed)
