"""Tracking quality: GOSPA, and the share of time and the identity switches of people's tracks by CLEAR MOT.

Both compare two sets of points at each tick: the people who are to be tracked, and the tracks.

Of the people X = {x_1 .. x_n} and the tracks Y = {y_1 .. y_m} of one tick, with the cut-off c, alpha = 2 and p = 2:

    GOSPA^2 = min over pairs g  sum_(i,j) in g |x_i - y_j|^2  +  c^2/2 (n - |g|)  +  c^2/2 (m - |g|)
                                localisation                    missed             false

over all sets g of pairs in which each point is at most once. A pair costs no more than a person missed and a false
track, c^2 in all, so only points nearer than c are paired. Source: Rahmathullah, Garcia-Fernandez & Svensson,
"Generalized optimal sub-pattern assignment metric" (FUSION 2017), proposition 1.

CLEAR MOT says whether each person keeps a track, and keeps one and the same. At each tick a person keeps the track that
it had last while that is within the gate of 1 m; the others are paired by the least total distance within the gate. A
person is tracked at the ticks at which it has a pair. Its identity is switched where the number of its track is another
than the one before. Source: Bernardin & Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT
Metrics" (2008).

A person who leaves and comes again, or is out of the lidar's range for some time, counts as another one: that its track
has another number then is no switch. Where the sensor gives identities, tracks carry people's names, and none is
switched.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.distances import GATE, nearest_pairs
from mjnav.messages import Array, Trajectory
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, Definition, figures
from mjnav.metrics.progress import ROWS, stretches
from mjnav.scene.spec import Scenario

# -------------------------------------------------------------------------------- people and tracks


_NO_TRACKER = "no people, or no belief"
_GOSPA = "Rahmathullah, Garcia-Fernandez and Svensson (2017)"
_CLEAR_MOT = "Bernardin and Stiefelhagen (2008)"


@dataclass(frozen=True, slots=True)
class TrackedBlock:
    """Successive ticks, from tick `start` on. Points that are not there are NaN; so are all at ticks without a belief.

    A track of named people stands in the column of its person.
    """

    start: int
    people: Array  # (t, P, 2) [m] who are to be tracked
    tracks: Array  # (t, K, 2) [m]
    numbers: Array | None  # (t, K) of the tracks; None where the sensor names the people


def tracked_blocks(trajectory: Trajectory, scenario: Scenario) -> Iterator[TrackedBlock]:
    """All ticks with a belief, a block at a time.

    To be tracked is who is there, whether the robot can see them or not. Where people are tracked by the lidar, people
    and tracks count within its range of the robot's centre.
    """
    reach = scenario.sensors.scanner.max_range if scenario.estimation.obstacles.source == "lidar" else None
    named = not len(trajectory.track_states)
    for start in range(0, len(trajectory.status), ROWS):
        rows = slice(start, min(start + ROWS, len(trajectory.status)))
        robot = trajectory.robot_pose[rows, None, :2].copy()
        robot[np.isnan(trajectory.estimate[rows, 0])] = np.nan  # nothing is within reach of it
        people = trajectory.people_position[rows]
        tracks, numbers = (trajectory.tracks[rows, :, :2], None) if named else _numbered(trajectory, rows)
        yield TrackedBlock(start, _within(people, robot, reach), _within(tracks, robot, reach), numbers)


def _within(points: Array, robot: Array, reach: float | None) -> Array:
    """Points (t, n, 2) with NaN for those that are farther from the robot (t, 1, 2) than its reach."""
    distance = np.linalg.norm(points - robot, axis=-1, keepdims=True)
    return np.where(distance <= (np.inf if reach is None else reach), points, np.nan)


def _numbered(trajectory: Trajectory, rows: slice) -> tuple[Array, Array]:
    """The places (t, K, 2) and numbers (t, K) of the tracks that carry no name; K is the largest number at one tick."""
    states = trajectory.track_states
    first, last = np.searchsorted(states[:, 0], [rows.start, rows.stop])
    states = states[first:last]
    tick = states[:, 0].astype(np.intp) - rows.start
    count = np.bincount(tick, minlength=rows.stop - rows.start)
    column = np.arange(len(tick)) - (np.cumsum(count) - count)[tick]
    shape = len(count), int(count.max(initial=0))
    places, numbers = np.full((*shape, 2), np.nan), np.full(shape, np.nan)
    places[tick, column], numbers[tick, column] = states[:, 2:4], states[:, 1]
    return places, numbers


# -------------------------------------------------------------------------------------------- GOSPA


CUTOFF = GATE  # [m], c: farther away a track is of no use to who has to avoid the person


class Gospa(NamedTuple):
    """Roots of the means of the squares over ticks [m]: total^2 = localization^2 + missed^2 + false^2."""

    total: float
    localization: float
    missed: float
    false: float


@figures(
    "knowledge",
    Definition("gospa_m", words="GOSPA", equation=r"\sqrt{\frac{1}{T}\sum_k \min_g (a_k + b_k + c_k)}"),
    Definition("gospa_localization_m", words="GOSPA, distances",
               equation=r"a_k = \sum_{(i,j)\in g} \lvert\hat p_{kj} - p_{ki}\rvert^2"),
    Definition("gospa_missed_m", words="GOSPA, missed",
               equation=r"b_k = \frac{c^2}{2}\left(n_k - \lvert g\rvert\right)"),
    Definition("gospa_false_m", words="GOSPA, false", equation=r"c_k = \frac{c^2}{2}\left(m_k - \lvert g\rvert\right)"),
    better=LOWER, null=_NO_TRACKER, source=_GOSPA, over_all=True,
)  # fmt: skip
def gospa(trajectory: Trajectory, scenario: Scenario) -> Gospa | None:
    """Of all ticks with a belief; None without any, and in scenes without people.

    * gospa_m: how far the set of tracks is from that of the people to be tracked: GOSPA with alpha = 2, p = 2 and c = 1
      m, root of the mean square over ticks
    * gospa_localization_m: its first part, of the distances; the squares of the three parts add up to that of gospa_m
    * gospa_missed_m: its second part, of people without a track
    * gospa_false_m: its third part, of tracks that are nobody's
    """
    if not scenario.people:
        return None
    total, ticks = np.zeros(3), 0
    for block in tracked_blocks(trajectory, scenario):
        believed = np.isfinite(trajectory.estimate[block.start : block.start + len(block.people), 0])
        total += gospa_squared(block.people[believed], block.tracks[believed]).sum(axis=0)
        ticks += int(believed.sum())
    if not ticks:
        return None
    localization, missed, false = (total / ticks).tolist()
    return Gospa(sqrt(localization + missed + false), sqrt(localization), sqrt(missed), sqrt(false))


def gospa_squared(people: Array, tracks: Array) -> Array:
    """The parts localisation, missed and false of GOSPA^2 at each tick, (t, 3) [m^2].

    Of people (t, n, 2) and tracks (t, m, 2) [m]; those that are NaN are not there.
    """
    from scipy.optimize import linear_sum_assignment

    num_people, num_tracks = (np.isfinite(points[..., 0]).sum(axis=1) for points in (people, tracks))
    squared = ((people[:, :, None] - tracks[:, None]) ** 2).sum(axis=-1)  # (t, n, m)
    limit = CUTOFF**2
    near = squared < limit
    cost = np.where(near, squared, 0.0).sum(axis=(1, 2))
    pairs = near.sum(axis=(1, 2))
    # Where no point has two others near it, all who are near are pairs.
    for k in np.flatnonzero((near.sum(axis=1) > 1).any(axis=1) | (near.sum(axis=2) > 1).any(axis=1)).tolist():
        bounded = np.where(near[k], squared[k], limit)
        chosen = linear_sum_assignment(bounded)
        paired = near[k][chosen]
        cost[k], pairs[k] = bounded[chosen][paired].sum(), paired.sum()
    return np.column_stack([cost, 0.5 * limit * (num_people - pairs), 0.5 * limit * (num_tracks - pairs)])


# ----------------------------------------------------------------------------------------- identity


NONE, ABSENT = -1, -2  # in place of a track's number: without a track; not to be tracked


class Identity(NamedTuple):
    """Over a run; a figure is None where nobody was to be tracked."""

    switches: int  # a person's track has another number than before
    fragmentations: int  # a person who was tracked is tracked again after a time without a track
    false_tracks: float  # tracks that are nobody's, mean over ticks
    tracked_share: float | None  # of the ticks at which a person is to be tracked
    first_track_delay: float | None  # [s] from when a person is to be tracked, mean over all of them


@figures(
    "knowledge",
    Definition("identity_switches", type=INTEGER, better=LOWER, source=_CLEAR_MOT),
    Definition("track_fragmentations", type=INTEGER, better=LOWER, source="Li, Huang and Nevatia (2009)"),
    Definition("false_tracks", better=LOWER, words="false tracks at a time", source=_CLEAR_MOT),
    Definition("tracked_share", better=HIGHER, words="share of time with a track", source=_CLEAR_MOT),
    Definition("first_track_delay_s", better=LOWER, words="delay of the first track"),
    null=_NO_TRACKER, over_all=True,
)  # fmt: skip
def identity(trajectory: Trajectory, scenario: Scenario) -> Identity | None:
    """Of all ticks with a belief; None without any, and in scenes without people.

    A person who never had a track counts in the delay with the time in which it was to be tracked.

    * identity_switches: times that a person's track has another number than the track before; 0 where the sensor says
      who is who
    * track_fragmentations: times that a person is tracked again after a time without a track
    * false_tracks: tracks that are nobody's, mean over ticks
    * tracked_share: share of the time in which people are to be tracked, summed over them, in which they have a track
      within 1 m
    * first_track_delay_s: time from when a person is to be tracked to the first track, mean over people; who never has
      one counts with all of the time
    """
    believed = int(np.isfinite(trajectory.estimate[:, 0]).sum())
    if not scenario.people or not believed:
        return None
    numbers = track_numbers(trajectory, scenario)
    tracks = sum(int(np.isfinite(block.tracks[..., 0]).sum()) for block in tracked_blocks(trajectory, scenario))
    switches = fragmentations = 0
    delays: list[float] = []
    time = trajectory.time
    for first, last, own in _presences(numbers):
        held = own[own != NONE]
        switches += int((held[1:] != held[:-1]).sum())
        spells = stretches(own != NONE)
        fragmentations += max(len(spells) - 1, 0)
        delays.append(float(time[first + spells[0, 0] if len(spells) else last] - time[first]))
    present, found = int((numbers != ABSENT).sum()), int((numbers >= 0).sum())
    return Identity(
        switches=switches,
        fragmentations=fragmentations,
        false_tracks=(tracks - found) / believed,
        tracked_share=found / present if present else None,
        first_track_delay=float(np.mean(delays)) if delays else None,
    )


def _presences(numbers: NDArray[np.int32]) -> Iterator[tuple[int, int, NDArray[np.int32]]]:
    """Each stretch of ticks in which one person is to be tracked: first tick, the one after the last, track numbers."""
    for own in numbers.T:
        for first, last in stretches(own != ABSENT).tolist():
            yield first, last, own[first:last]


def track_numbers(trajectory: Trajectory, scenario: Scenario) -> NDArray[np.int32]:
    """The number of the track that each person has at each tick, (T, P), or NONE, or ABSENT.

    Where tracks carry people's names, it is the number of the person.
    """
    found = np.full((len(trajectory.status), trajectory.people_position.shape[1]), ABSENT, np.int32)
    for block in tracked_blocks(trajectory, scenario):
        rows = slice(block.start, block.start + len(block.people))
        found[rows][np.isfinite(block.people[..., 0])] = NONE
        if block.numbers is None:
            near = np.linalg.norm(block.people - block.tracks, axis=-1) <= GATE
            found[rows][near] = np.nonzero(near)[1]
        else:
            _pair(found, block, block.numbers)
    return found


def _pair(found: NDArray[np.int32], block: TrackedBlock, numbers: Array) -> None:
    """Fills in the track numbers of a block's ticks; those before it are known."""
    near = np.linalg.norm(block.people[:, :, None] - block.tracks[:, None], axis=-1) <= GATE  # (t, P, K)
    # Where no point has two others near it, all who are near are pairs, whatever was before.
    forced = (near.sum(axis=1) <= 1).all(axis=1) & (near.sum(axis=2) <= 1).all(axis=1)
    tick, person, column = np.nonzero(near & forced[:, None, None])
    found[block.start + tick, person] = numbers[tick, column]
    for k in np.flatnonzero(~forced).tolist():
        pairs = _kept(found, block.start + k, near[k], numbers[k])
        free = near[k].copy()
        free[[*pairs]], free[:, [*pairs.values()]] = False, False
        if free.any():
            people, tracks = block.people[k].copy(), block.tracks[k].copy()
            people[[*pairs]], tracks[[*pairs.values()]] = np.nan, np.nan
            pairs |= dict(nearest_pairs(people, tracks, GATE))
        found[block.start + k, [*pairs]] = numbers[k, [*pairs.values()]]


def _kept(found: NDArray[np.int32], row: int, near: NDArray[np.bool_], numbers: Array) -> dict[int, int]:
    """Who keeps the track that it had last: its column by person. Of two who had the same one, who had it later."""
    columns = {number: j for j, number in enumerate(numbers.tolist()) if number >= 0}
    last = found[row - 1].tolist() if row > 0 else [ABSENT] * len(near)
    holders: dict[int, tuple[int, int]] = {}  # column: when it was had last, by whom
    for person, (number, close) in enumerate(zip(last, near.tolist(), strict=True)):
        before = row - 1
        while number == NONE and before > 0:
            before -= 1
            number = int(found[before, person])
        column = columns.get(number)
        if column is not None and close[column]:
            holders[column] = max(holders.get(column, (-1, -1)), (before, person))
    return {person: column for column, (_, person) in holders.items()}
