"""Whether each person keeps a track, and keeps one and the same.

At each tick people and tracks are paired as CLEAR MOT does: a person keeps the track that it had last while that is
within the gate of 1 m; the others are paired by the least total distance within the gate. A person is tracked at the
ticks at which it has a pair. Its identity is switched where the number of its track is another than the one before.
Source: Bernardin & Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics" (2008).

A person who leaves and comes again, or is out of the lidar's range for some time, is another one: that its track has
another number then is no switch. Where the sensor says who is who, tracks carry people's names, and none is switched.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.assignment import GATE, nearest_pairs
from mjnav.messages import Array, Trajectory
from mjnav.metrics.stretches import stretches
from mjnav.metrics.tracked import TrackedBlock, tracked_blocks
from mjnav.scenarios.spec import Scenario

NONE, ABSENT = -1, -2  # in place of a track's number: without a track; not to be tracked


@dataclass(frozen=True, slots=True)
class Identity:
    """Over a run; a figure is None where nobody was to be tracked."""

    switches: int  # a person's track has another number than before
    fragmentations: int  # a person who was tracked is tracked again after a time without a track
    false_tracks: float  # tracks that are nobody's, mean over ticks
    tracked_share: float | None  # of the ticks at which a person is to be tracked
    first_track_delay: float | None  # [s] from when a person is to be tracked, mean over all of them


def identity(trajectory: Trajectory, scenario: Scenario) -> Identity | None:
    """Of all ticks with a belief; None without any, and in scenes without people.

    A person who never had a track counts in the delay with the time in which it was to be tracked.
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
