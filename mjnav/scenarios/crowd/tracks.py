"""Tracks of a recorded crowd: splines between the frames, conversion to the scene's units, and the frame rate.

A track between its frames is a cubic spline through every recorded position. Each piece is
p(t) = c0 (t - t_k)^3 + c1 (t - t_k)^2 + c2 (t - t_k) + c3 on [t_k, t_k+1], with continuous velocity and acceleration
("not a knot" at both ends; de Boor, A Practical Guide to Splines, 1978). Two positions give a line.

The recording becomes tracks in the scene's metres and seconds, cut where nobody can follow them.

Where the user gives no frame rate (frames of the recording's column in a second), it is guessed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.crowd.reader import Recording
from mjnav.scenarios.people import MAX_WALKING_SPEED
from mjnav.scenarios.ranges import MAX_TIME

# ------------------------------------------------------------------------------------------ splines


_ROUNDING = 1e-9  # [s] of clocks that count steps


class TrackSplines:
    """The splines of n tracks, evaluated together; before its first and after its last frame a person stands there."""

    def __init__(self, tracks: Sequence[Array]):
        """Each track (k, 3): time [s], strictly ascending, x and y [m]; k is at least 2."""
        from scipy.interpolate import CubicSpline

        splines = [CubicSpline(track[:, 0], track[:, 1:]) for track in tracks]
        self._first = np.array([track[0, 0] for track in tracks])  # (n,)
        self._last = np.array([track[-1, 0] for track in tracks])
        pieces = [len(track) - 1 for track in tracks]
        self._ends = np.cumsum(pieces) - 1  # (n,) last piece of each
        self._starts = self._ends - np.array(pieces, int) + 1
        self._knots = np.concatenate([track[:-1, 0] for track in tracks])  # (K,) where each piece starts
        self._coefficients = np.concatenate([spline.c.transpose(1, 0, 2) for spline in splines])  # (K, 4, 2)
        # One sorted array finds the piece of every person at once: each has a stretch of time of their own.
        span = float(self._last.max() - self._first.min()) + 1.0
        self._shift = span * np.arange(len(tracks))
        self._shifted = self._knots + np.repeat(self._shift, pieces)

    def positions(self, time: float) -> Array:
        """Where all are at `time` [s]: (n, 2) [m]."""
        return self._evaluated(np.clip(time, self._first, self._last))

    def velocities(self, time: float, duration: float, ahead: float = 0.0) -> Array:
        """Mean velocities, (n, 2) [m/s], over `duration` [s] from `ahead` [s] after `time` on; 0 outside of a track.

        Within `ahead` and `duration` of its end a track goes on as its last piece does.
        """
        begin = np.clip(time, self._first, self._last) + ahead
        mean = (self._evaluated(begin + duration) - self._evaluated(begin)) / duration
        return np.where(((time > self._first - _ROUNDING) & (time < self._last))[:, None], mean, 0.0)

    def _evaluated(self, times: Array) -> Array:
        """At a time (n,) for each track, with the nearest piece beyond its ends: (n, 2)."""
        piece = np.searchsorted(self._shifted, times + self._shift, side="right") - 1
        piece = np.clip(piece, self._starts, self._ends)
        c, h = self._coefficients[piece], (times - self._knots[piece])[:, None]
        return ((c[:, 0] * h + c[:, 1]) * h + c[:, 2]) * h + c[:, 3]


# ---------------------------------------------------------------------------- tracks of a recording


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


# --------------------------------------------------------------------------------------- frame rate


RATES = (25.0, 30.0, 29.97, 50.0, 60.0, 24.0, 20.0, 16.0, 15.0, 12.5, 12.0, 10.0, 8.0, 7.5, 5.0, 2.5, 2.0, 1.0)  # usual
STEP = 0.4  # [s] between the annotated frames of ETH (Pellegrini et al. 2009), UCY (Lerner et al. 2007) and their heirs
FREE_SPEED = 1.34  # [m/s] of people who walk freely (Weidmann 1993)
_WALKING = (0.6, 2.2)  # [m/s] between which the median speed of people who walk lies in any recording of walkers
_LEAST = 1e-12  # [m/frame] of a step
_SLOW = 0.25  # of the fastest tenth's speed: slower steps are people who stand


@dataclass(frozen=True, slots=True)
class RateGuess:
    """A frame rate, what speaks for it, and whether that is enough to go on."""

    frame_rate: float
    basis: str
    sure: bool


def guess_frame_rate(recording: Recording, scale: float = 1.0) -> RateGuess | None:
    """The likely frame rate; None where nobody has two rows. `scale` are metres a unit of the file."""
    same = np.diff(recording.person) == 0
    frames = np.diff(recording.frame)[same]
    if not len(frames):
        return None
    way = scale * np.hypot(*np.diff(recording.position, axis=0)[same].T)
    if recording.velocity is not None:
        rate = _by_velocities(recording, same, frames, way, scale)
        if rate is not None:
            return RateGuess(rate, "the recorded velocities", True)
    speed = _walking_speed(way / frames)  # [m/frame]
    step = recording.usual_step
    if step > 0.0 and _WALKING[0] <= speed * step / STEP <= _WALKING[1]:
        rate = _neat(step / STEP)
        return RateGuess(rate, f"steps of {step:g} frames as {STEP:g} s: people walk at {speed * rate:.2f} m/s", True)
    rate = min(RATES, key=lambda one: abs(np.log(max(speed, _LEAST) * one / FREE_SPEED)))
    walking = speed * rate
    return RateGuess(rate, f"the usual rate at which people walk at {walking:.2f} m/s", False)


def _by_velocities(
    recording: Recording, same: np.ndarray, frames: np.ndarray, way: np.ndarray, scale: float
) -> float | None:
    """Speed of the velocity columns over distance a frame, of the steps in which people walk."""
    assert recording.velocity is not None
    told = scale * np.hypot(*recording.velocity.T)
    told = 0.5 * (told[:-1] + told[1:])[same]
    walked = way / frames
    moving = walked > max(_SLOW * np.quantile(walked, 0.9), _LEAST)
    if not moving.any() or not told[moving].any():
        return None
    return _neat(float(np.median(told[moving] / walked[moving])))


def _walking_speed(speeds: np.ndarray) -> float:
    """The median speed of steps that are no standing, in the unit of `speeds`."""
    return float(np.median(speeds[speeds >= _SLOW * np.quantile(speeds, 0.9)]))


def _neat(rate: float) -> float:
    """The usual rate within 2 % of it, or else three digits."""
    nearest = min(RATES, key=lambda one: abs(one - rate))
    return nearest if abs(nearest - rate) <= 0.02 * rate else float(f"{rate:.3g}")
