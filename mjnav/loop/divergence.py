"""When a belief has left the truth: for the log, since the robot itself cannot know."""

from collections.abc import Iterator

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.geometry.assignment import nearest_tracks
from mjnav.messages import Array, Beliefs, Event, Track, WorldState, triangle
from mjnav.metrics.consistency import DIVERGED, DIVERGED_TIME, nees, region

ROBOT = "robot"


class DivergenceWatch:
    """Tells once of each belief that is outside of its 99.9 % region for DIVERGED_TIME.

    There are as many such events as the figures robot_divergences and people_divergences count.
    """

    def __init__(self, period: float):
        """`period` is the time from tick to tick [s]."""
        self._period = period
        self._limit = {num: region(DIVERGED, num) for num in (3, 4)}
        self._since: dict[str, float] = {}  # [s] since when it has been outside, by name
        self._told: set[str] = set()

    def of_tick(self, truth: WorldState, beliefs: Beliefs) -> Iterator[Event]:
        """The events of one tick."""
        outside = dict(self._outside(truth, beliefs))
        self._since = {name: self._since.get(name, truth.time) for name in outside}
        self._told &= outside.keys()
        for name, distance in outside.items():
            if name not in self._told and truth.time - self._since[name] + self._period >= DIVERGED_TIME - 1e-9:
                self._told.add(name)
                share = f"outside of its {100.0 * DIVERGED:g} % region for {DIVERGED_TIME:g} s"
                yield Event("warning", "divergence", f"the belief about {name} is {distance:.2f} m off, {share}")

    def _outside(self, truth: WorldState, beliefs: Beliefs) -> Iterator[tuple[str, float]]:
        """Whose belief is outside, and how far from the truth [m]."""
        error = beliefs.robot.mean - truth.robot_pose
        error[2] = wrap(error[2])
        if _squared(error[None], beliefs.robot.covariance[None])[0] > self._limit[3]:
            yield ROBOT, float(np.hypot(*error[:2]))
        tracks = _by_person(truth, beliefs.people)
        if not tracks:
            return
        people = [*tracks]
        states = np.concatenate([truth.people_position[people], truth.people_velocity[people]], axis=1)
        errors = np.array([track.mean for track in tracks.values()]) - states
        squared = _squared(errors, np.array([track.covariance for track in tracks.values()]))
        for i in np.flatnonzero(squared > self._limit[4]).tolist():
            yield f"person{people[i]}", float(np.hypot(*errors[i, :2]))


def _by_person(truth: WorldState, tracks: tuple[Track, ...]) -> dict[int, Track]:
    """Each person's track, by its name or, of tracks that carry none, by the assignment that figures use."""
    places = {f"person{i}": i for i in range(len(truth.people_position))}
    named = {places[track.name]: track for track in tracks if track.name in places}
    unnamed = [track for track in tracks if track.name not in places]
    return named | nearest_tracks(truth.people_position, unnamed)


def _squared(errors: Array, covariances: Array) -> Array:
    """The NEES of errors (B, n) with covariances (B, n, n), (B,)."""
    try:
        return (errors * np.linalg.solve(covariances, errors[..., None])[..., 0]).sum(axis=1)
    except np.linalg.LinAlgError:
        return nees(errors, triangle(covariances))
