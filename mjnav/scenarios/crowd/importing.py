"""Import of a recorded crowd into a run file: its people, a robot that crosses them, and statistics of the recording.

The robot's start and goal lie so that it crosses the area in which the recorded people walk. The recording's tracks
become tables of `people`. The statistics (survey) say whether the recording was read rightly, and which part of it
makes a scene. The last part reads and measures a recording, and writes the run file for a part of it.
"""

import os
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import atan2, ceil, hypot
from pathlib import Path
from typing import Any

import numpy as np

from mjnav.config import below, read, settled
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.printable import printable
from mjnav.scenarios import toml as files
from mjnav.scenarios.crowd.reader import Recording, read_recording
from mjnav.scenarios.crowd.spec import Crowd
from mjnav.scenarios.crowd.tracks import (
    Box,
    Placement,
    RateGuess,
    Track,
    Tracks,
    TrackSplines,
    guess_frame_rate,
    tracks_of,
)
from mjnav.scenarios.people import MAX_WALKING_SPEED, PERIOD
from mjnav.scenarios.ranges import MAX_BODIES
from mjnav.scenarios.toml import toml_text

# ----------------------------------------------------------------------- the robot's start and goal


EDGE = 0.5  # [m] from the edges of the area in which people walk
CLEAR = 2.0  # [m] between centres at the start: nearer people cannot be avoided by a robot that stands
CLEAR_TIME = 2.0  # [s] for which the start is clear, and before the end for which the goal is
_PLACES = (0.5, 0.3, 0.7, 0.1, 0.9)  # along an edge, as shares of its length


@dataclass(frozen=True, slots=True)
class RobotWay:
    """A start, a goal and how far people keep from them."""

    start: tuple[float, float, float]  # x, y [m], heading [rad]
    goal: tuple[float, float]
    clearance: float  # [m] from the start's centre to the nearest person's in the first CLEAR_TIME


def robot_way(tracks: Sequence[Track], first: float, last: float) -> RobotWay:
    """A straight way across the area of the people of a window [s] whose start is clear.

    The one with the largest product of its length and of how clear its ends are, up to CLEAR. The goal is looked at
    towards the end.
    """
    rows = np.concatenate([_there(track, first, last) for track in tracks])
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
    return RobotWay((x, y, round(heading, 4)), (to_x, to_y), _distance(soon, start))


def _ways(low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """From each place on an edge straight to the opposite one, in both directions."""
    for axis in (0, 1):
        for share in _PLACES:
            start, goal = low.copy(), high.copy()
            start[1 - axis] = goal[1 - axis] = low[1 - axis] + share * (high - low)[1 - axis]
            yield start, goal
            yield goal, start


def _there(track: Track, first: float, last: float) -> Array:
    """Where a person is in a window, at its ends and at the rows within: (k, 2)."""
    time = track.rows[:, 0]
    times = np.concatenate([time[(time > first) & (time < last)], np.clip([first, last], time[0], time[-1])])
    return np.stack([np.interp(times, time, track.rows[:, i]) for i in (1, 2)], axis=1)


def _positions(tracks: Sequence[Track], first: float, last: float) -> Array:
    """Where people are between two times, every 0.1 s: (n, 2); who comes and goes counts all the time."""
    there = [track.rows for track in tracks if track.rows[0, 0] < last and track.rows[-1, 0] > first]
    if not there:
        return np.empty((0, 2))
    splines = TrackSplines(there)
    return np.concatenate([splines.positions(float(time)) for time in np.arange(first, last + 0.05, 0.1)])


def _distance(positions: Array, point: Array) -> float:
    return float(np.hypot(*(positions - point).T).min()) if len(positions) else float("inf")


# ------------------------------------------------------------------------------------------- people


MARGIN = (
    5  # rows of a track before and after the window that its spline keeps: each next one bends it 0.27 times as much
)
DIGITS = 6  # of seconds and metres in a resolved scene
LEAST_STAY = 0.1  # [s]
MAX_ROWS = 200_000  # of all tracks: a run file may have 10 MB
MAX_JUMPS = 0.1  # of the rows: more, and the file is not read as it was meant
STANDING = 0.2  # [m/s] slower steps do not count for the speed of who reacts
NEAR = 0.5  # [m] who ends no further from their start reacts by standing there until they leave


def put_crowd(document: dict[str, Any], folder: Path | None) -> None:
    """Puts people in place of the table [crowd] of a run file, behind those that are there.

    The recording's path counts from `folder`, or else from the working folder; without a folder none is allowed. Raises
    InvalidValue.
    """
    if "crowd" not in document:
        return
    with below("crowd"):
        crowd = settled(Crowd, document.pop("crowd"))
        if folder is None:
            raise InvalidValue("file", crowd.file, "nothing; only a run file may name another file")
        made = people_of(crowd, files.found(crowd.file, folder))
    people = document.get("people", [])
    document["people"] = [*people, *made] if isinstance(people, list) else people


def placement_of(crowd: Crowd) -> Placement:
    """How the table lays its recording into the scene."""
    return Placement(crowd.scale, crowd.mirror, crowd.rotation, crowd.offset, crowd.crop)


def people_of(crowd: Crowd, path: Path | str) -> list[dict[str, Any]]:
    """The recording's people, in the order in which they come in, as tables of `people`. Raises InvalidValue."""
    try:
        recording = read_recording(path, crowd.columns or None)
    except InvalidValue as error:
        raise _told_of_the_file(crowd.file, error) from None
    cut = tracks_of(recording, crowd.frame_rate, placement_of(crowd), crowd.max_gap)
    end = max((track.rows[-1, 0] for track in cut.tracks), default=0.0)
    first, last = crowd.window or (0.0, float(end))
    tracks = in_window(cut.tracks, first, last)
    if not cut.tracks or cut.num_jumps > MAX_JUMPS * len(recording.frame):
        found = f"{len(cut.tracks)} tracks, {cut.num_jumps} jumps, {cut.num_gaps} gaps"
        allowed = (
            f"what gives people two rows or more within crop, and hardly any faster than {MAX_WALKING_SPEED:g} m/s"
        )
        if crowd.crop and not cut.num_jumps and not cut.num_gaps:
            raise InvalidValue("crop", crowd.crop, "two corners with people between them, in the scene's coordinates")
        raise InvalidValue("scale" if cut.num_jumps > cut.num_gaps else "frame_rate", found, allowed)
    if not tracks:
        allowed = f"a window in which somebody walks; the recording ends at {end:g} s"
        raise InvalidValue("window", f"0 people from {first:g} to {last:g} s", allowed)
    num_rows = sum(len(track.rows) for track in tracks)
    if len(tracks) > MAX_BODIES or num_rows > MAX_ROWS:
        allowed = f"a window, or a crop, with at most {MAX_BODIES} people and {MAX_ROWS} rows"
        raise InvalidValue("window", f"{len(tracks)} people with {num_rows} rows", allowed)
    make = _replayed if crowd.people == "replay" else _reacting
    common = {"radius": crowd.radius, "sees_robot": crowd.sees_robot, "temperament": crowd.temperament}
    given = {key: value for key, value in common.items() if value is not None}
    return [{**table, **given} for table in make(tracks, first, last)]


def _told_of_the_file(name: str, error: InvalidValue) -> InvalidValue:
    """What is wrong with a recording, or with one of its lines, as an error of the key `file`."""
    if not error.key:
        return InvalidValue("file", name, error.allowed)
    inner = InvalidValue(error.key, error.found, error.allowed)
    return InvalidValue("file", name, f"a recording that can be read ({inner})")


def in_window(tracks: Sequence[Track], first: float, last: float) -> list[Track]:
    """The tracks of people who are there for a moment of a window [s], by the time at which they come in."""
    there = [one for one in tracks if min(one.rows[-1, 0], last) - max(one.rows[0, 0], first) > LEAST_STAY]
    return sorted(there, key=lambda track: float(track.rows[0, 0]))


def _replayed(tracks: Sequence[Track], first: float, last: float) -> Iterator[dict[str, Any]]:
    for track in tracks:
        rows = _kept(track.rows, first, last).round(DIGITS)
        enters, leaves = _stay(rows, last - first)
        start = TrackSplines([rows]).positions(enters)[0]
        yield {
            "start": start.tolist(),
            "behaviour": "replay",
            **({"enters": enters} if enters else {}),
            "leaves": leaves,
            "track": rows.tolist(),
        }


def _stay(rows: Array, length: float) -> tuple[float, float]:
    """When somebody comes, at a decision of people's, and goes [s]; `rows` count from the window's beginning."""
    enters = PERIOD * np.ceil(max(rows[0, 0], 0.0) / PERIOD - 1e-4)
    return round(float(enters), DIGITS), round(float(min(rows[-1, 0], length)), DIGITS)


def _kept(rows: Array, first: float, last: float) -> Array:
    """The rows of a track in a window [s], counted from its beginning, with MARGIN rows on both sides."""
    low = max(int(np.searchsorted(rows[:, 0], first)) - MARGIN, 0)
    high = int(np.searchsorted(rows[:, 0], last, side="right")) + MARGIN
    kept = rows[low:high].copy()
    kept[:, 0] -= first
    return kept


def _reacting(tracks: Sequence[Track], first: float, last: float) -> Iterator[dict[str, Any]]:
    """Start, end and speed of the part within the window; who stands stands until they leave."""
    for track in tracks:
        rows = track.rows.copy()
        rows[:, 0] -= first
        enters, leaves = _stay(rows, last - first)
        start, end = TrackSplines([rows]).positions(enters)[0].round(DIGITS), rows[-1, 1:].round(DIGITS)
        table = {
            "start": start.tolist(),
            "behaviour": "social_force",
            **({"enters": enters} if enters else {}),
            "waypoints": [end.tolist()],
        }
        if np.hypot(*(end - start)) <= NEAR:
            yield {**table, "waypoints": [start.tolist()], "at_end": "stay", "leaves": leaves}
        else:
            yield {**table, "speed": round(_walking_speed(track), DIGITS), "at_end": "leave"}


def _walking_speed(track: Track) -> float:
    """Way over time [m/s] of the steps in which the person walked; of all steps where they never did."""
    duration, speeds = np.diff(track.rows[:, 0]), track.speeds
    walked = speeds > STANDING if (speeds > STANDING).any() else np.ones(len(speeds), bool)
    return float((speeds * duration)[walked].sum() / duration[walked].sum())


# ------------------------------------------------------------------------------------------- survey


Moments = Sequence[tuple[float, Array]]

RADII = (0.2, 0.25, 0.3)  # [m] of discs whose overlaps are counted

_LEAST_WINDOW = 1.0  # [s] of the last one


@dataclass(frozen=True, slots=True)
class Speeds:
    """Of all steps of all people [m/s]; None where nobody walks."""

    median_walking: float | None  # of the steps in which a person walks
    quantile_95: float
    highest: float
    standing: float  # share of steps slower than STANDING


@dataclass(frozen=True, slots=True)
class Overlaps:
    """Pairs of people at the moments of the recording's usual step; an overlap are two discs of a radius."""

    pairs: int
    closest: float | None  # [m] between centres
    overlapping: tuple[int, ...]  # pairs, for each of RADII


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
    """The tracks in figures."""

    people: int
    duration: float  # [s] from the first row to the last
    area: Box
    speeds: Speeds
    mean_time_there: float  # [s]
    most_at_once: int
    overlaps: Overlaps
    windows: tuple[Window, ...]


def survey(tracks: Sequence[Track], step: float, length: float) -> Survey:
    """The figures of at least one track; `step` [s] between rows, `length` [s] of the windows."""
    rows = np.concatenate([track.rows for track in tracks])
    (x0, y0), (x1, y1) = rows[:, 1:].min(axis=0).tolist(), rows[:, 1:].max(axis=0).tolist()
    moments = _moments(tracks, step)
    there = [track.rows[-1, 0] - track.rows[0, 0] for track in tracks]
    area = ((x0, y0), (x1, y1))
    return Survey(
        len(tracks),
        float(np.ptp(rows[:, 0])),
        area,
        _speeds(tracks),
        float(np.mean(there)),
        max((len(positions) for _, positions in moments), default=0),
        _overlaps([positions for _, positions in moments]),
        tuple(_windows(tracks, moments, step, length)),
    )


def _windows(tracks: Sequence[Track], moments: Moments, step: float, length: float) -> Iterator[Window]:
    times, sizes = [time for time, _ in moments], [len(positions) for _, positions in moments]
    enters, leaves = (sorted(float(track.rows[row, 0]) for track in tracks) for row in (0, -1))
    for i in range(max(1, ceil((leaves[-1] - _LEAST_WINDOW) / length))):
        start, end = i * length, min((i + 1) * length, leaves[-1])
        first = bisect_left(times, start)
        at_start = first < len(times) and times[first] < start + step
        most = max(sizes[bisect_right(times, start) : bisect_left(times, end)], default=0)
        people = bisect_left(enters, end) - bisect_right(leaves, start)
        yield Window(start, end, people, most, _closest(moments[first][1]) if at_start else None)


def _moments(tracks: Sequence[Track], step: float) -> Moments:
    """Time and positions (n, 2) of all who are there, every `step` [s]; straight on between rows."""
    found: list[Array] = []
    for track in tracks:
        time = track.rows[:, 0]
        steps = np.arange(np.ceil(time[0] / step - 1e-6), np.floor(time[-1] / step + 1e-6) + 1)
        found.append(np.column_stack([steps, *(np.interp(steps * step, time, track.rows[:, i]) for i in (1, 2))]))
    rows = np.concatenate(found)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    moments, first = np.unique(rows[:, 0], return_index=True)
    return list(zip((moments * step).tolist(), np.split(rows[:, 1:], first)[1:], strict=True))


def _speeds(tracks: Sequence[Track]) -> Speeds:
    speeds = np.concatenate([track.speeds for track in tracks])
    walking = speeds[speeds > STANDING]
    return Speeds(
        float(np.median(walking)) if len(walking) else None,
        float(np.quantile(speeds, 0.95)),
        float(speeds.max()),
        float((speeds <= STANDING).mean()),
    )


def _overlaps(moments: Sequence[Array]) -> Overlaps:
    from scipy.spatial import KDTree

    pairs = sum(len(positions) * (len(positions) - 1) // 2 for positions in moments)
    reach = 2.0 * np.array(RADII) * (1.0 - 1e-9)
    overlapping = np.zeros(len(RADII), int)
    closest: list[float] = []
    for positions in moments:
        distance = _closest(positions)
        if distance is None:
            continue
        closest.append(distance)
        if distance <= reach[-1]:
            tree = KDTree(positions)
            overlapping += (tree.count_neighbors(tree, reach) - len(positions)) // 2  # each pair twice, and themselves
    return Overlaps(pairs, min(closest, default=None), tuple(overlapping.tolist()))


def _closest(positions: Array) -> float | None:
    """The smallest distance between two of the positions (n, 2)."""
    from scipy.spatial import KDTree

    return float(KDTree(positions).query(positions, k=2)[0][:, 1].min()) if len(positions) > 1 else None


# ------------------------------------------------------------------------------------------- import


GIVEN = "given"
MAX_WINDOWS = 50_000  # more than a run's longest time has of the usual length


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """A recording as a table [crowd] reads it."""

    crowd: Crowd
    recording: Recording
    rate: RateGuess
    step: float  # [frames] the usual one
    tracks: Tracks
    survey: Survey


def import_crowd(path: str | os.PathLike[str], table: Mapping[str, Any], length: float) -> Imported:
    """The recording in a file as the keys of [crowd] in `table` read it; the frame rate is guessed where it is missing.

    The survey has windows of `length` [s]. Raises InvalidValue, of a key of `table` or with the file.
    """
    given = read(Crowd, {"frame_rate": 1.0, **table, "file": os.fspath(path)})  # checks what is there
    recording = read_recording(os.fspath(path), given.columns or None)
    if "frame_rate" in table:
        rate = RateGuess(given.frame_rate, GIVEN, True)
    else:
        guess = guess_frame_rate(recording, given.scale)
        if guess is None:
            raise _nobody(path, recording, "in two rows or more")
        rate = guess
    crowd = read(Crowd, {**table, "file": os.fspath(path), "frame_rate": rate.frame_rate})
    tracks = tracks_of(recording, crowd.frame_rate, placement_of(crowd), crowd.max_gap)
    if not tracks.tracks:
        cuts = f"{tracks.num_jumps} jumps and {tracks.num_gaps} gaps cut them"
        how = f"{cuts} at a frame rate of {rate.frame_rate:g} Hz and a scale of {crowd.scale:g}"
        raise _nobody(path, recording, f"in two rows or more within the crop; {how}")
    duration = max(float(track.rows[-1, 0]) for track in tracks.tracks)
    if duration > MAX_WINDOWS * length:
        allowed = f"at least {duration / MAX_WINDOWS:.3g} s: at most {MAX_WINDOWS} windows of the {duration:.3g} s"
        raise InvalidValue("duration", length, allowed)
    step = recording.usual_step
    return Imported(crowd, recording, rate, step, tracks, survey(tracks.tracks, step / rate.frame_rate, length))


def _nobody(path: str | os.PathLike[str], recording: Recording, what: str) -> InvalidValue:
    found = f"{len(recording.frame)} rows of {len(recording.labels)} people, {recording.num_repeated} repeated"
    return InvalidValue("", found, f"people {what}", file=os.fspath(path))


def choose_window(tracks: Sequence[Track], length: float, people: int | None) -> tuple[float, float]:
    """The first part of `length` [s], in whole seconds, in which the number of people is nearest to `people`.

    Without a number, the one with most people. A shorter recording is taken whole.
    """
    enters = np.array([track.rows[0, 0] for track in tracks])
    leaves = np.array([track.rows[-1, 0] for track in tracks])
    end = float(leaves.max())
    if end <= length:
        return 0.0, end
    starts = np.arange(0.0, np.floor(end - length) + 1.0)
    entered = np.searchsorted(np.sort(enters), starts + length)
    counts = entered - np.searchsorted(np.sort(leaves), starts, side="right")
    start = float(starts[np.argmax(counts) if people is None else np.argmin(np.abs(counts - people))])
    return start, start + length


def scene_tables(found: Imported, window: tuple[float, float], name: str, folder: Path) -> dict[str, Any]:
    """The tables of a run file in `folder`: the people of a window [s], and a robot that crosses their area."""
    people = in_window(found.tracks.tracks, *window)
    if not people:
        end = max(track.rows[-1, 0] for track in found.tracks.tracks)
        raise InvalidValue("window", window, f"a window in which somebody walks; the recording ends at {end:g} s")
    way = robot_way(people, *window)
    file = found.crowd.file
    if not os.path.isabs(file):
        file = os.path.relpath(file, folder)
    return {
        "schema": 1,
        "name": name,
        "description": f"{printable(Path(file).name)}, {window[0]:g} to {window[1]:g} s: {len(people)} people.",
        "time_limit": round(window[1] - window[0], 3),
        "robot": {"start": list(way.start), "goal": list(way.goal)},
        "crowd": {"file": file, "frame_rate": found.crowd.frame_rate, "window": list(window)},
    }


def scene_text(tables: Mapping[str, Any], found: Imported) -> str:
    """The run file, which says first where it comes from."""
    rate = f"{found.rate.frame_rate:g} frames a second: {found.rate.basis}"
    return f"# Made by `mjnav import crowd`. {rate}.\n{toml_text(dict(tables))}"
