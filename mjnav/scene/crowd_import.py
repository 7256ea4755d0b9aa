"""Import of a recorded crowd: figures of the recording, and a run file for a part of it.

The figures say whether the recording was read rightly, and which part of it makes a scene. The run file names the
recording in its table [crowd], and its robot crosses the area in which the recorded people walk.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, ceil, hypot
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.printable import printable
from mjnav.scene import crowd as crowds
from mjnav.settings import read

# ------------------------------------------------------------------------------------------ survey


Moments = Mapping[int, Array]  # number of the step -> positions (n, 2) [m] of all who are there
_LEAST_WINDOW = 1.0  # [s] of the last one


@dataclass(frozen=True, slots=True)
class Speeds:
    """Of all steps of all people [m/s]; None where nobody walks."""

    median_walking: float | None  # of the steps in which a person walks
    quantile_95: float
    highest: float
    standing: float  # share of steps slower than STANDING


@dataclass(frozen=True, slots=True)
class Window:
    """A part of a recording."""

    start: float  # [s]
    end: float
    people: int  # in all
    most_at_once: int
    closest_at_start: float | None  # [m] between two centres


@dataclass(frozen=True, slots=True)
class Survey:
    """The tracks in figures, of people who are there at one moment every usual step of the recording."""

    people: int
    duration: float  # [s] from the first row to the last
    area: tuple[tuple[float, float], tuple[float, float]]  # two corners [m]
    speeds: Speeds
    mean_time_there: float  # [s]
    most_at_once: int
    closest: float | None  # [m] between centres
    windows: tuple[Window, ...]


def survey(tracks: Sequence[crowds.Track], step: float, length: float) -> Survey:
    """The figures of at least one track; `step` [s] between rows, `length` [s] of the windows."""
    rows = np.concatenate([track.rows for track in tracks])
    there = np.array([track.rows[-1, 0] - track.rows[0, 0] for track in tracks])
    moments = _moments(tracks, step)
    distances = [_closest(positions) for positions in moments.values()]
    low, high = rows[:, 1:].min(axis=0).tolist(), rows[:, 1:].max(axis=0).tolist()
    return Survey(
        people=len(tracks),
        duration=float(np.ptp(rows[:, 0])),
        area=((low[0], low[1]), (high[0], high[1])),
        speeds=_speeds(tracks),
        mean_time_there=float(there.mean()),
        most_at_once=max(map(len, moments.values()), default=0),
        closest=min((distance for distance in distances if distance is not None), default=None),
        windows=tuple(_windows(tracks, moments, step, length)),
    )


def _moments(tracks: Sequence[crowds.Track], step: float) -> Moments:
    """Positions at every whole number of steps [s]; straight on between rows."""
    found: list[Array] = []
    for track in tracks:
        time = track.rows[:, 0]
        steps = np.arange(np.ceil(time[0] / step - 1e-6), np.floor(time[-1] / step + 1e-6) + 1)
        found.append(np.column_stack([steps, *(np.interp(steps * step, time, track.rows[:, i]) for i in (1, 2))]))
    rows = np.concatenate(found)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    steps, first = np.unique(rows[:, 0], return_index=True)
    return dict(zip(steps.astype(int).tolist(), np.split(rows[:, 1:], first)[1:], strict=True))


def _windows(tracks: Sequence[crowds.Track], moments: Moments, step: float, length: float) -> Iterator[Window]:
    enters, leaves = (np.sort([track.rows[row, 0] for track in tracks]) for row in (0, -1))
    steps = np.array(list(moments), float)
    sizes = np.array([len(positions) for positions in moments.values()], int)
    for i in range(max(1, ceil((leaves[-1] - _LEAST_WINDOW) / length))):
        start, end = i * length, min((i + 1) * length, float(leaves[-1]))
        within = sizes[np.searchsorted(steps * step, start - 1e-6) : np.searchsorted(steps * step, end)]
        people = int(np.searchsorted(enters, end) - np.searchsorted(leaves, start, side="right"))
        at_start = moments.get(ceil(start / step - 1e-6))
        closest = None if at_start is None else _closest(at_start)
        yield Window(start, end, people, min(people, int(within.max(initial=0))), closest)


def _speeds(tracks: Sequence[crowds.Track]) -> Speeds:
    speeds = np.concatenate([track.speeds for track in tracks])
    walking = speeds[speeds > crowds.STANDING]
    median = float(np.median(walking)) if len(walking) else None
    return Speeds(
        median, float(np.quantile(speeds, 0.95)), float(speeds.max()), float((speeds <= crowds.STANDING).mean())
    )


def _closest(positions: Array) -> float | None:
    """The smallest distance between two of the positions (n, 2)."""
    from scipy.spatial import KDTree

    return float(KDTree(positions).query(positions, k=2)[0][:, 1].min()) if len(positions) > 1 else None


# ------------------------------------------------------------------------------------------ import


MAX_WINDOWS = 50_000  # more than a run's longest time has of the usual length


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A recording as a table [crowd] reads it."""

    crowd: crowds.Crowd
    table: Mapping[str, Any]  # the keys of [crowd] that were given
    recording: crowds.Recording
    tracks: crowds.Tracks
    survey: Survey


def import_crowd(path: str | os.PathLike[str], table: Mapping[str, Any], length: float) -> Imported:
    """The recording in a file as the keys of [crowd] in `table` read it; the survey has windows of `length` [s].

    Raises InvalidValue, of a key of `table` or with the file.
    """
    file = os.fspath(path)
    crowd = read(crowds.Crowd, {**table, "file": file})
    recording = crowds.read_recording(file)
    tracks = crowds.tracks_of(recording, crowd)
    if not tracks.tracks:
        found = f"{len(recording.frame)} rows of {len(recording.labels)} people, {recording.num_repeated} repeated"
        cuts = f"{tracks.num_jumps} jumps and {tracks.num_gaps} gaps cut them"
        how = f"{cuts} at a frame rate of {crowd.frame_rate:g} Hz and a scale of {crowd.scale:g}"
        raise InvalidValue("", found, f"people in two rows or more within the crop; {how}", file=file)
    duration = max(float(track.rows[-1, 0]) for track in tracks.tracks)
    if duration > MAX_WINDOWS * length:
        allowed = f"at least {duration / MAX_WINDOWS:.3g} s: at most {MAX_WINDOWS} windows of the {duration:.3g} s"
        raise InvalidValue("duration", length, allowed)
    return Imported(
        crowd, table, recording, tracks, survey(tracks.tracks, recording.usual_step / crowd.frame_rate, length)
    )


def choose_window(tracks: Sequence[crowds.Track], length: float, people: int | None) -> tuple[float, float]:
    """The first part of `length` [s], in whole seconds, in which the number of people is nearest to `people`.

    Without a number, the one with most people. A shorter recording is taken whole.
    """
    enters, leaves = (np.sort([track.rows[row, 0] for track in tracks]) for row in (0, -1))
    end = float(leaves[-1])
    if end <= length:
        return 0.0, end
    starts = np.arange(0.0, np.floor(end - length) + 1.0)
    counts = np.searchsorted(enters, starts + length) - np.searchsorted(leaves, starts, side="right")
    start = float(starts[np.argmax(counts) if people is None else np.argmin(np.abs(counts - people))])
    return start, start + length


def scene_tables(found: Imported, window: tuple[float, float], output: Path) -> dict[str, Any]:
    """The tables of the run file `output`: the people of a window [s], and a robot that crosses their area."""
    people = crowds.in_window(found.tracks.tracks, *window)
    if not people:
        end = max(track.rows[-1, 0] for track in found.tracks.tracks)
        raise InvalidValue("window", window, f"a window in which somebody walks; the recording ends at {end:g} s")
    start, goal = robot_way(people, *window)
    file = found.crowd.file
    if not os.path.isabs(file):
        file = os.path.relpath(file, output.absolute().parent)
    return {
        "schema": 1,
        "name": printable(output.stem),
        "description": f"{printable(Path(file).name)}, {window[0]:g} to {window[1]:g} s: {len(people)} people.",
        "time_limit": round(window[1] - window[0], 3),
        "robot": {"start": list(start), "goal": list(goal)},
        "crowd": {**found.table, "file": file, "window": list(window)},
    }


# ---------------------------------------------------------------------- the robot's start and goal


EDGE = 0.5  # [m] from the edges of the area in which people walk
CLEAR = 2.0  # [m] between centres at the start: nearer people cannot be avoided by a robot that stands
CLEAR_TIME = 2.0  # [s] for which the start is clear, and before the end for which the goal is
_SHARES = (0.5, 0.3, 0.7, 0.1, 0.9)  # of an edge's length


def robot_way(
    tracks: Sequence[crowds.Track], first: float, last: float
) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """The start (x, y [m], heading [rad]) and the goal (x, y [m]) of a robot that crosses the area of the people.

    Of the straight ways from a place on an edge of the area to the opposite edge, the one with the largest product of
    its length and of how clear its ends are, up to CLEAR: the start soon after the beginning of the window
    `first` to `last` [s], the goal towards the end.
    """
    rows = np.concatenate([_within(track, first, last) for track in tracks])
    low, high = rows.min(axis=0), rows.max(axis=0)
    inset = np.minimum(EDGE, 0.25 * (high - low))
    soon = _positions(tracks, first, min(first + CLEAR_TIME, last))
    late = _positions(tracks, max(last - CLEAR_TIME, first), last)

    def value(way: tuple[Array, Array]) -> float:
        start, goal = way
        return hypot(*(goal - start)) * min(_distance(soon, start), _distance(late, goal), CLEAR)

    start, goal = max(_ways(low + inset, high - inset), key=value)
    heading = atan2(goal[1] - start[1], goal[0] - start[0])
    x, y, to_x, to_y = (round(float(value), 2) for value in (*start, *goal))
    return (x, y, round(heading, 4)), (to_x, to_y)


def _ways(low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """From each place on an edge straight to the opposite one, in both directions."""
    for axis in (0, 1):
        for share in _SHARES:
            start, goal = low.copy(), high.copy()
            start[1 - axis] = goal[1 - axis] = low[1 - axis] + share * (high - low)[1 - axis]
            yield start, goal
            yield goal, start


def _within(track: crowds.Track, first: float, last: float) -> Array:
    """Where a person is in a window, at its ends and at the rows within: (k, 2)."""
    time = track.rows[:, 0]
    times = np.concatenate([time[(time > first) & (time < last)], np.clip([first, last], time[0], time[-1])])
    return np.stack([np.interp(times, time, track.rows[:, i]) for i in (1, 2)], axis=1)


def _positions(tracks: Sequence[crowds.Track], first: float, last: float) -> Array:
    """Where people are between two times, every 0.1 s: (n, 2); who comes and goes counts all the time."""
    there = [track.rows for track in tracks if track.rows[0, 0] < last and track.rows[-1, 0] > first]
    if not there:
        return np.empty((0, 2))
    splines = crowds.TrackSplines(there)
    return np.concatenate([splines.positions(float(time)) for time in np.arange(first, last + 0.05, 0.1)])


def _distance(positions: Array, point: Array) -> float:
    return float(np.hypot(*(positions - point).T).min()) if len(positions) else float("inf")
