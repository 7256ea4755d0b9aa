"""Recorded crowds: the table [crowd] of a run file, and the people that it makes of somebody's recording.

A recording is a text with a row for each person and frame, in any order. Columns are separated by white space, commas
or semicolons. Four columns are `frame id x y` (the common form of ETH, Pellegrini et al. 2009, and UCY, Lerner et al.
2007), eight are `frame id x z y vx vz vy` (`obsmat` of ETH, with z upwards). Any other row needs a header line above it
that names frame, id, x and y among its columns. Lines that begin with #, %, // or ; are comments.

A track is one person's way from where they come into the recording to where they leave it. Between its rows it is a
cubic spline through every recorded position. Each piece is p(t) = c0 (t - t_k)^3 + c1 (t - t_k)^2 + c2 (t - t_k) + c3
on [t_k, t_k+1], with continuous velocity and acceleration ("not a knot" at both ends; de Boor, A Practical Guide to
Splines, 1978). Two positions give a line.
"""

import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import cos, sin
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scene import toml as files
from mjnav.scene.people import MAX_WALKING_SPEED, PERIOD, TEMPERAMENTS
from mjnav.scene.ranges import MAX_BODIES, MAX_LENGTH, MAX_TIME, Angle, Point
from mjnav.settings import Choice, Range, Settled, below, settled

# -------------------------------------------------------------------------------------- the table [crowd]


Seconds = Annotated[float, Range(0.0, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Crowd(Settled):
    """People from a recording; they stand behind those of `people`, and in the resolved scene among them."""

    file: Annotated[str, "the recording, from the run file's folder or else the working folder"]
    frame_rate: Annotated[float, Range(0.0, 1e6, "Hz", open_low=True), "what the column of frames counts a second"]
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
    radius: Annotated[float, Range(0.1, 1.0, "m"), "of everybody's round body"] = 0.25
    sees_robot: Annotated[bool | None, "whether the robot exists for them; by default for those who react"] = None
    temperament: Annotated[
        Annotated[str, Choice(tuple(TEMPERAMENTS))] | None, "how they take a robot that they see: regular by default"
    ] = None

    def _check(self):
        if self.window is not None and not self.window[0] < self.window[1]:
            raise InvalidValue("window", self.window, "[from, to] with from < to")
        if self.crop is not None:
            (x0, y0), (x1, y1) = self.crop
            if x0 == x1 or y0 == y1:
                raise InvalidValue("crop.1", self.crop[1], f"the corner opposite to {self.crop[0]}")

    def placed(self, position: Array) -> Array:
        """Positions (..., 2) of the file in the scene [m]: scaled, mirrored (y to -y), rotated, then moved."""
        c, s = cos(self.rotation), sin(self.rotation)
        flip = -1.0 if self.mirror else 1.0
        x, y = self.scale * position[..., 0], flip * self.scale * position[..., 1]
        return np.stack([c * x - s * y + self.offset[0], s * x + c * y + self.offset[1]], axis=-1)

    def holds(self, position: Array) -> NDArray[np.bool_]:
        """Whether positions (n, 2) of the scene lie in the crop: (n,)."""
        if self.crop is None:
            return np.ones(len(position), bool)
        low, high = np.min(self.crop, axis=0), np.max(self.crop, axis=0)
        return ((position >= low) & (position <= high)).all(axis=1)


# -------------------------------------------------------------------------------------------- a recording


REQUIRED = ("frame", "id", "x", "y")
FORMATS: Mapping[int, tuple[str, ...]] = MappingProxyType(
    {4: REQUIRED, 8: ("frame", "id", "x", "z", "y", "vx", "vz", "vy")}
)
ALLOWED = (
    f"rows of {' '.join(FORMATS[4])}, rows of {' '.join(FORMATS[8])}, "
    "or a header line above the rows that names each of frame, id, x and y once"
)
MAX_BYTES = 100_000_000
MAX_STEPS = 1_000_000  # from the first frame to the last: 9 hours at 30 Hz, 4 days of annotated steps of 0.4 s
_LARGEST = 1e15  # of a number: beyond any clock and any map
_DIGITS = 6  # of frames: a person's rows are at one frame where they are nearer
_MARKS = ("#", "%", "//", ";")  # that begin a comment


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """The R rows of a recording by person and frame; people in the order in which they first appear.

    Its arrays cannot be written to: who reads the same file again gets the same recording.
    """

    columns: tuple[str, ...]
    labels: tuple[str, ...]  # id of each person
    person: NDArray[np.int64]  # (R,) index into labels, ascending
    frame: Array  # (R,) ascending for each person
    position: Array  # (R, 2) in the file's unit
    num_skipped: int  # lines of comments and headers
    num_repeated: int  # rows whose person and frame, to 10^-6, another row had before them

    def rows(self) -> Iterator[tuple[str, slice]]:
        """Label and rows of each person."""
        ends = np.searchsorted(self.person, np.arange(len(self.labels) + 1))
        for label, first, last in zip(self.labels, ends[:-1], ends[1:], strict=True):
            yield label, slice(int(first), int(last))

    @property
    def usual_step(self) -> float:
        """The median step between two rows of a person, in frames; 0 where nobody has two."""
        steps = np.diff(self.frame)[np.diff(self.person) == 0]
        return float(np.quantile(steps, 0.5, method="lower").round(_DIGITS)) if len(steps) else 0.0


def read_recording(path: Path | str) -> Recording:
    """The recording in a text file. Raises InvalidValue with the file and the line.

    Of rows with the same person and frame the first counts.
    """
    with files.readable("a recording", file=str(path)):
        data = files.read_regular(path, MAX_BYTES)
    with below(file=str(path)):
        return _parsed(data)


@lru_cache(2)  # all cells of a study read the same file, one after the other
def _parsed(data: bytes) -> Recording:
    """The recording in a file's bytes; the keys of errors are lines."""
    lines = files.decoded(data, f"text in UTF-8: {ALLOWED}").splitlines()
    columns: tuple[str, ...] = ()
    header = ""  # the last line before the rows
    wanted: list[tuple[str, int]] = []
    values, skipped = array("d"), 0
    for number, line in enumerate(lines, start=1):
        words = _words(line)
        if not words:
            continue
        if line.lstrip().startswith(_MARKS) or (not columns and not any(map(_is_number, words))):
            header, skipped = line, skipped + 1
            continue
        if not columns:
            columns = _columns(number, words, header)
            wanted = [(name, columns.index(name)) for name in REQUIRED]
        if len(words) != len(columns):
            raise InvalidValue(f"line {number}", line.strip(), f"{len(columns)} columns: {' '.join(columns)}")
        for name, place in wanted:
            if not _is_number(words[place]):
                raise InvalidValue(f"line {number}", words[place], f"a finite number ({name})")
            values.append(float(words[place]))
    if not values:
        raise InvalidValue("", "no rows", ALLOWED)
    recording = _sorted(columns, np.array(values).reshape(-1, len(REQUIRED)), skipped)
    step, first, last = recording.usual_step, float(recording.frame.min()), float(recording.frame.max())
    if step > 0.0 and last - first > MAX_STEPS * step:
        allowed = f"at most {MAX_STEPS} usual steps ({step:g}) from the first frame to the last"
        raise InvalidValue("", f"frames from {first:.15g} to {last:.15g}", allowed)
    return recording


def _words(line: str) -> list[str]:
    separator = next((mark for mark in (",", ";") if mark in line), None)
    return [word.strip(" \t\"'") for word in line.split(separator)]


def _is_number(word: str) -> bool:
    """Whether it is a finite number, not too large."""
    try:
        return abs(float(word)) < _LARGEST
    except ValueError:
        return False


def _columns(number: int, words: Sequence[str], header: str) -> tuple[str, ...]:
    """What the columns of the first row are: as a header of as many words names them, or by their number."""
    bare = header.strip().lstrip("".join(_MARKS))
    names = tuple(re.sub(r"[\[(/].*", "", word.lower()).strip() for word in _words(bare))  # "X[m]" is x
    is_header = len(names) == len(words) and (header.strip() == bare or not set(REQUIRED).isdisjoint(names))
    columns = names if is_header else FORMATS.get(len(words), ())
    if any(columns.count(name) != 1 for name in REQUIRED):
        found = " ".join(names) if is_header else f"{len(words)} columns: {' '.join(words)}"
        raise InvalidValue(f"line {number}", found, ALLOWED)
    return columns


def _sorted(columns: tuple[str, ...], rows: Array, skipped: int) -> Recording:
    """Rows of frame, id, x, y, (R, 4), by person and frame, each pair once."""
    frame = rows[:, 0].round(_DIGITS)
    ids, person = np.unique(rows[:, 1], return_inverse=True)
    first_seen = np.full(len(ids), np.inf)
    np.minimum.at(first_seen, person, frame)
    order_of_people = np.lexsort((ids, first_seen))
    person = np.argsort(order_of_people)[person]
    order = np.lexsort((frame, person))  # stable: of repeated rows the first stays first
    person, frame, position = person[order], frame[order], rows[order, 2:]
    repeated = (np.diff(person, prepend=-1) == 0) & (np.diff(frame, prepend=-np.inf) == 0.0)
    person, frame, position = person[~repeated], frame[~repeated], position[~repeated]
    for values in (person, frame, position):
        values.flags.writeable = False
    labels = tuple(f"{ids[i]:.15g}" for i in order_of_people)
    return Recording(columns, labels, person, frame, position, skipped, int(repeated.sum()))


# ------------------------------------------------------------------------------------------------- tracks


_LONGER = 1.5  # times a recording's usual step: a step in which a row is missing
_SHORTEST = 1e-3  # [s] between two rows
MAX_MISSING = 1_000_000  # rows at the usual step that the gaps within tracks lack: a survey fills them in


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


def tracks_of(recording: Recording, crowd: Crowd) -> Tracks:
    """The tracks of a recording in the scene of `crowd`; what lies outside its crop is left out.

    Raises InvalidValue where the recording would last longer than any run, or tracks lack too many rows.
    """
    duration = float(np.ptp(recording.frame)) / crowd.frame_rate
    if duration > MAX_TIME:
        allowed = f"a rate at which the recording lasts at most {MAX_TIME:g} s, not {duration:g} s"
        raise InvalidValue("frame_rate", crowd.frame_rate, allowed)
    time = (recording.frame - recording.frame.min()) / crowd.frame_rate
    position = crowd.placed(recording.position)
    inside = crowd.holds(position)
    usual = recording.usual_step / crowd.frame_rate
    tracks: list[Track] = []
    gaps = bridged = jumps = single = 0
    for label, rows in recording.rows():
        at = np.column_stack([time[rows], position[rows]])
        duration = np.diff(at[:, 0])
        too_long = duration > crowd.max_gap
        way = np.hypot(*np.diff(at[:, 1:], axis=0).T)
        too_fast = ~too_long & ((way > MAX_WALKING_SPEED * duration) | (duration < _SHORTEST))
        gaps += int(too_long.sum())
        jumps += int(too_fast.sum())
        bridged += int((~too_long & ~too_fast & (duration > _LONGER * usual)).sum())
        is_in = inside[rows]
        cut = too_long | too_fast | (is_in[1:] != is_in[:-1])
        for piece in np.split(np.arange(len(at)), np.flatnonzero(cut) + 1):
            if not is_in[piece[0]]:
                continue
            if len(piece) > 1:
                tracks.append(Track(label, at[piece]))
            else:
                single += 1
    missing = sum((track.rows[-1, 0] - track.rows[0, 0]) / usual - len(track.rows) for track in tracks)
    if missing > MAX_MISSING:
        allowed = f"a time that bridges gaps of at most {MAX_MISSING} missing rows in all, not {missing:.3g}"
        raise InvalidValue("max_gap", crowd.max_gap, allowed)
    return Tracks(tuple(tracks), gaps, bridged, jumps, single)


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


# ------------------------------------------------------------------------------------------------- people


STANDING = 0.2  # [m/s] slower steps do not count for the speed of who reacts
MAX_ROWS = 200_000  # of all tracks: a run file may have 10 MB
MAX_JUMPS = 0.1  # of the rows: more, and frame rate or scale are not those of the file
_MARGIN = 5  # rows of a track before and after the window that its spline keeps: each bends it 0.27 times as much
_PLACES = 6  # of seconds and metres in a resolved scene
_LEAST_STAY = 0.1  # [s]
_NEAR = 0.5  # [m] who ends no further from their start reacts by standing there until they leave


def put_crowd(document: dict[str, Any], folder: Path | None) -> None:
    """Puts people in place of the table [crowd] of a run file, behind those that are there.

    The recording's path counts from `folder`, or else from the working folder; without a folder none is allowed. Raises
    InvalidValue.
    """
    if "crowd" not in document:
        return
    with below("crowd"):
        crowd = settled(Crowd, document.pop("crowd"))
        made = people_of(crowd, files.found("file", crowd.file, folder, "nothing"))
    people = document.get("people", [])
    document["people"] = [*people, *made] if isinstance(people, list) else people


def people_of(crowd: Crowd, path: Path | str) -> list[dict[str, Any]]:
    """The recording's people, in the order in which they come in, as tables of `people`. Raises InvalidValue."""
    try:
        recording = read_recording(path)
    except InvalidValue as error:
        inner = InvalidValue(error.key, error.found, error.allowed)
        allowed = f"a recording that can be read ({inner})" if error.key else error.allowed
        raise InvalidValue("file", crowd.file, allowed) from None
    cut = tracks_of(recording, crowd)
    if cut.num_jumps > MAX_JUMPS * len(recording.frame):
        allowed = f"a frame rate, and a scale, at which hardly anybody is faster than {MAX_WALKING_SPEED:g} m/s"
        raise InvalidValue("frame_rate", f"{cut.num_jumps} jumps in {len(recording.frame)} rows", allowed)
    end = max((float(track.rows[-1, 0]) for track in cut.tracks), default=0.0)
    first, last = crowd.window or (0.0, end)
    tracks = in_window(cut.tracks, first, last)
    num_rows = sum(len(track.rows) for track in tracks)
    if not tracks or len(tracks) > MAX_BODIES or num_rows > MAX_ROWS:
        found = f"{len(tracks)} people with {num_rows} rows from {first:g} to {last:g} s"
        allowed = f"a window, and a crop, with at most {MAX_BODIES} people and {MAX_ROWS} rows"
        if not tracks:
            allowed = f"a window, and a crop, in which somebody walks; the last track ends at {end:g} s"
        raise InvalidValue("window", found, allowed)
    make = _replayed if crowd.people == "replay" else _reacting
    common = {"radius": crowd.radius, "sees_robot": crowd.sees_robot, "temperament": crowd.temperament}
    given = {key: value for key, value in common.items() if value is not None}
    return [{**make(track, first, last), **given} for track in tracks]


def in_window(tracks: Sequence[Track], first: float, last: float) -> list[Track]:
    """The tracks of people who are there for a moment of a window [s], by the time at which they come in."""
    there = [track for track in tracks if min(track.rows[-1, 0], last) - max(track.rows[0, 0], first) > _LEAST_STAY]
    return sorted(there, key=lambda track: float(track.rows[0, 0]))


def _replayed(track: Track, first: float, last: float) -> dict[str, Any]:
    """The rows of the window, with _MARGIN rows on both sides; times count from its beginning."""
    begin = max(int(np.searchsorted(track.rows[:, 0], first)) - _MARGIN, 0)
    end = int(np.searchsorted(track.rows[:, 0], last, side="right")) + _MARGIN
    rows = (track.rows[begin:end] - [first, 0.0, 0.0]).round(_PLACES)
    start, enters, leaves = _stay(rows, last - first)
    return {"start": start.tolist(), "behaviour": "replay", **enters, "leaves": leaves, "track": rows.tolist()}


def _reacting(track: Track, first: float, last: float) -> dict[str, Any]:
    """Start, end and speed of the part within the window; who stands stands until they leave."""
    rows = track.rows - [first, 0.0, 0.0]
    start, enters, leaves = _stay(rows, last - first)
    start, end = start.round(_PLACES), rows[-1, 1:].round(_PLACES)
    table = {"start": start.tolist(), "behaviour": "social_force", **enters}
    if np.hypot(*(end - start)) <= _NEAR:
        return {**table, "waypoints": [start.tolist()], "at_end": "stay", "leaves": leaves}
    return {**table, "waypoints": [end.tolist()], "speed": round(_walking_speed(track), _PLACES), "at_end": "leave"}


def _stay(rows: Array, length: float) -> tuple[Array, dict[str, float], float]:
    """Where somebody comes in, (2,) [m]; `enters` [s], at a decision of people's, if it is not 0; when they go [s]."""
    enters = round(float(PERIOD * np.ceil(max(rows[0, 0], 0.0) / PERIOD - 1e-4)), _PLACES)
    leaves = round(float(min(rows[-1, 0], length)), _PLACES)
    return TrackSplines([rows]).positions(enters)[0], {"enters": enters} if enters else {}, leaves


def _walking_speed(track: Track) -> float:
    """Way over time [m/s] of the steps in which the person walked; of all steps where they never did."""
    duration, speeds = np.diff(track.rows[:, 0]), track.speeds
    walked = speeds > STANDING if (speeds > STANDING).any() else np.ones(len(speeds), bool)
    return float((speeds * duration)[walked].sum() / duration[walked].sum())
