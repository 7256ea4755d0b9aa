"""From a recording to tracks in the scene's metres and seconds, cut where nobody can follow them."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.crowd.reader import Recording
from mjnav.scenarios.people import MAX_WALKING_SPEED
from mjnav.scenarios.ranges import MAX_TIME

Bools = NDArray[np.bool_]
Box = tuple[tuple[float, float], tuple[float, float]]  # two opposite corners [m]
_LONGER = 1.5  # times a recording's usual step: a step in which a row is missing
_SHORTEST = 1e-3  # [s] between two rows
MAX_MISSING = 1_000_000  # rows at the usual step that the gaps within tracks lack: a survey fills them in


@dataclass(frozen=True, slots=True)
class Placement:
    """How a recording lies in a scene: scaled, mirrored (y to -y), rotated about the origin, moved, then cropped."""

    scale: float = 1.0  # metres a unit of the file
    mirror: bool = False
    rotation: float = 0.0  # [rad]
    offset: tuple[float, float] = (0.0, 0.0)  # [m]
    crop: Box | None = None  # what lies outside is left out

    def placed(self, position: Array) -> Array:
        """Positions (..., 2) of the file, in the scene [m]."""
        c, s = cos(self.rotation), sin(self.rotation)
        flip = -1.0 if self.mirror else 1.0
        x, y = self.scale * position[..., 0], flip * self.scale * position[..., 1]
        return np.stack([c * x - s * y + self.offset[0], s * x + c * y + self.offset[1]], axis=-1)

    def inside(self, position: Array) -> Bools:
        """Whether placed positions (n, 2) lie in the crop: (n,) of bool."""
        if self.crop is None:
            return np.ones(len(position), bool)
        low, high = np.min(self.crop, axis=0), np.max(self.crop, axis=0)
        return ((position >= low) & (position <= high)).all(axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One person, from where they come into the recording to where they leave it, in k >= 2 rows."""

    label: str  # the id in the file
    rows: Array  # (k, 3) time [s] since the recording's first frame, x, y [m]

    @property
    def speeds(self) -> Array:
        """Mean speed in each step, (k - 1,) [m/s]."""
        return np.hypot(*np.diff(self.rows[:, 1:], axis=0).T) / np.diff(self.rows[:, 0])


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """All tracks of a recording, and what was cut."""

    tracks: tuple[Track, ...]
    num_gaps: int  # steps longer than the longest that is allowed: the person leaves, and comes in again after it
    num_bridged: int  # steps with rows missing over which a track goes on
    num_jumps: int  # steps faster than MAX_WALKING_SPEED, cut as gaps are
    num_single: int  # pieces of one row, which are left out


def tracks_of(recording: Recording, frame_rate: float, placement: Placement, max_gap: float) -> Tracks:
    """The tracks of a recording whose frame column counts `frame_rate` a second; steps beyond max_gap [s] cut them.

    Raises InvalidValue where the recording would last longer than any run, or tracks lack too many rows.
    """
    duration = float(np.ptp(recording.frame)) / frame_rate
    if duration > MAX_TIME:
        allowed = f"a rate at which the recording lasts at most {MAX_TIME:g} s, not {duration:g} s"
        raise InvalidValue("frame_rate", frame_rate, allowed)
    time = (recording.frame - recording.frame.min()) / frame_rate
    position = placement.placed(recording.position)
    inside = placement.inside(position)
    usual = recording.usual_step / frame_rate
    tracks: list[Track] = []
    gaps = bridged = jumps = single = 0
    for label, rows in recording.rows():
        at = np.column_stack([time[rows], position[rows]])
        duration = np.diff(at[:, 0])
        too_long = duration > max_gap
        way = np.hypot(*np.diff(at[:, 1:], axis=0).T)
        too_fast = ~too_long & ((way > MAX_WALKING_SPEED * duration) | (duration < _SHORTEST))
        gaps += int(too_long.sum())
        jumps += int(too_fast.sum())
        bridged += int((~too_long & ~too_fast & (duration > _LONGER * usual)).sum())
        for piece in _pieces(at, too_long | too_fast, inside[rows]):
            if len(piece) > 1:
                tracks.append(Track(label, piece))
            else:
                single += 1
    missing = sum((track.rows[-1, 0] - track.rows[0, 0]) / usual - len(track.rows) for track in tracks)
    if missing > MAX_MISSING:
        allowed = f"a time that bridges gaps of at most {MAX_MISSING} missing rows in all, not {missing:.3g}"
        raise InvalidValue("max_gap", max_gap, allowed)
    return Tracks(tuple(tracks), gaps, bridged, jumps, single)


def _pieces(rows: Array, cut: Bools, inside: Bools) -> Iterator[Array]:
    """Rows that follow one another inside, without a cut between them."""
    part = np.cumsum(np.concatenate([[False], cut | (np.diff(inside.astype(int)) != 0)]))
    for number in np.unique(part[inside]):
        yield rows[(part == number) & inside]
