"""Moments of a run: what was believed of the people, or what was true of them, tick by tick."""

from collections.abc import Iterator

import numpy as np

from mjnav.estimation.base import person_names, person_track
from mjnav.messages import Array, Trajectory, symmetric
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario
from mjnav.study.prediction.forecast import Moment


def moments(
    trajectory: Trajectory, scenario: Scenario, *, exact: bool, num: int, every: float, seed: int
) -> Iterator[Moment]:
    """One moment a tick; predictions count every `every` [s].

    Samples are drawn from the Gaussian that has the track's mean and covariance, which is what a trajectory keeps of a
    belief; with `exact` all of them are the truth.
    """
    names = person_names(trajectory.people_position.shape[1])
    streams = [stream(seed, "prediction.scores", name) for name in names]
    times, count = np.zeros(len(names)), 0
    for k in range(len(trajectory.tracks)):
        time = float(trajectory.time[k])
        counts = time >= count * every - 1e-9
        count += counts
        tracks, samples = [], []
        for p, name in enumerate(names):
            mean, root = _belief(trajectory, k, p, exact=exact)
            if not np.isfinite(mean).all():
                continue
            if k == 0 or exact or (trajectory.tracks[k, p] != trajectory.tracks[k - 1, p]).any():
                times[p] = time
            drawn = mean + streams[p].standard_normal((num, 4)) @ root.T
            tracks.append(person_track(name, float(times[p]), scenario.people[p].radius, drawn))
            samples.append(drawn)
        yield Moment(
            time,
            tuple(tracks),
            np.array(samples).reshape(-1, num, 4),
            tuple(track.name for track in tracks) if counts else (),
        )


def whereabouts(trajectory: Trajectory, name: str, times: Array) -> Array:
    """Where a person was at times (n,) [s], linear between ticks: (n, 2) [m]; NaN where they were not there."""
    path = trajectory.people_position[:, person_names(trajectory.people_position.shape[1]).index(name)]
    known = trajectory.time
    return np.stack([np.interp(times, known, axis, left=np.nan, right=np.nan) for axis in path.T], axis=1)


def _belief(trajectory: Trajectory, k: int, p: int, *, exact: bool) -> tuple[Array, Array]:
    """Mean (4,) and a root (4, 4) of the covariance of what is known of a person at a tick."""
    if exact:
        state = np.concatenate([trajectory.people_position[k, p], trajectory.people_velocity[k, p]])
        return state, np.zeros((4, 4))
    mean = trajectory.tracks[k, p]
    if not np.isfinite(mean).all():
        return mean, np.zeros((4, 4))
    values, axes = np.linalg.eigh(symmetric(trajectory.track_triangle[k, p], 4))
    return mean, axes * np.sqrt(np.maximum(values, 0.0))
