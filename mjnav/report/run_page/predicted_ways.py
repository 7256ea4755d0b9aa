"""How people are predicted to go on, as a page draws it: a few points of each way that /scene holds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mjnav.messages import Array
from mjnav.recording.encode.futures import MOST_PEOPLE, MOST_SAMPLES, SUFFIX
from mjnav.report.run_page.candidate_ranks import NONE
from mjnav.report.run_page.packed import Packer

POINTS = 5  # kept of a way, evenly over its time; the first is where the sample is now
FINEST = 0.01  # [m] step of a move from point to point

Ways = Mapping[str, Array]  # track -> (MOST_SAMPLES, POINTS, 2) [m]


def predicted_ways(update: Any) -> Ways:
    """The predicted ways in a foxglove.SceneUpdate; NaN where a track has fewer than MOST_SAMPLES."""
    entities = [entity for entity in update.entities if entity.id.endswith(SUFFIX)]
    return {entity.id.removesuffix(SUFFIX): _samples(entity.lines) for entity in entities[:MOST_PEOPLE]}


def _samples(lines: Sequence[Any]) -> Array:
    samples = np.full((MOST_SAMPLES, POINTS, 2), np.nan)
    for sample, line in zip(samples, lines, strict=False):
        if (number := len(line.points)) > 0:
            places = np.linspace(0, number - 1, POINTS).round().astype(int).tolist()
            sample[:] = [(line.points[place].x, line.points[place].y) for place in places]
    return samples


def pack_ways(packer: Packer, ways: Mapping[int, Ways], tracks: Sequence[str], positions: Array) -> None:
    """Adds the ways by frame, as moves from point to point, the first from the track's position; nothing without ways.

    `positions` are those of all tracks, (T, tracks, 2) [m].
    """
    if not ways:
        return
    moves = np.full((len(positions), MOST_PEOPLE, MOST_SAMPLES, POINTS, 2), np.nan)
    owners = np.full((len(positions), MOST_PEOPLE), NONE, np.uint8)
    for frame, found in ways.items():
        for place, (name, samples) in enumerate(found.items()):
            if name in tracks[:NONE]:
                owners[frame, place] = track = tracks.index(name)
                start = np.broadcast_to(positions[frame, track], (MOST_SAMPLES, 1, 2))
                moves[frame, place] = np.diff(np.concatenate([start, samples], axis=1), axis=1)
    sizes = np.abs(moves[np.isfinite(moves)])
    packer.numbers("way_of", owners)
    packer.offsets("ways", moves, max(FINEST, float(np.quantile(sizes, 0.999)) / 127.0 if sizes.size else 0.0))
