"""Predictions of people against where they went, one person and moment at a time."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, KnownMap, Track
from mjnav.metrics.prediction import PathScores, path_scores
from mjnav.prediction import Crowd, Predictor


@dataclass(frozen=True, slots=True)
class Moment:
    """What is known of the people at one time."""

    time: float  # [s]
    tracks: tuple[Track, ...]
    samples: Array  # (P, M, 4) of each track
    scored: tuple[str, ...]  # names of the people whose prediction counts; the others are there for them to meet


@dataclass(frozen=True, slots=True)
class Forecast:
    """One prediction of one person and how it turned out."""

    person: str
    time: float  # [s] from which on it was predicted
    scores: PathScores


def forecasts(
    moments: Iterable[Moment],
    predictor: Predictor,
    whereabouts: Callable[[str, Array], Array],
    step: float,
    num: int,
    floor: KnownMap | None = None,
) -> Iterator[Forecast]:
    """The predictions of all moments, in their order, at `num` times `step` [s] apart.

    `whereabouts(name, times)` says where a person was at times (n,) [s]: (n, 2) [m], NaN where nobody knows. A
    prediction that nobody knows the end of is left out.
    """
    ahead = step * np.arange(1, num + 1, dtype=float)
    for moment in moments:
        found = predictor.predict(Crowd(moment.tracks, moment.samples, moment.time, floor))
        paths = found.paths(step, num)
        for p, track in enumerate(moment.tracks):
            if track.name in moment.scored:
                observed = whereabouts(track.name, moment.time + ahead)
                if np.isfinite(observed[-1]).all():
                    yield Forecast(track.name, moment.time, path_scores(paths[p, :, 1:], observed))
