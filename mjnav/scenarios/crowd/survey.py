"""What a recording holds: figures that say whether it was read rightly, and which part of it makes a scene."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.crowd.people import STANDING
from mjnav.scenarios.crowd.tracks import Box, Track

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
