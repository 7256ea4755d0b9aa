"""A tracker of a user's own that finds people in scans: it names its tracks itself, and any number of them."""

import re
from importlib import import_module
from typing import Any

import numpy as np

from mjnav.errors import PluginFault
from mjnav.estimation.base import DRAWS
from mjnav.estimation.own import RADIUS, checked
from mjnav.filters.resampling import shuffled
from mjnav.messages import Array, Detection, Reading, RobotBelief, Track
from mjnav.rng import stream
from mjnav.sealed import sealed_message

BY_SCANS = "by_scans"  # attribute of a tracker that goes by scans
NAME = re.compile(r"track\d{1,9}")
MOST_TRACKS = 1000


class OwnScanTracker:
    """Bodies without identity, by a user's tracker: `update(reading, robot)` gives tracks named "track7"."""

    def __init__(self, name: str, tracker: Any, seed: int):
        import_module("scipy.optimize")  # with which a trajectory gives people tracks, not to be loaded at a tick
        self._name, self._own, self._seed = name, tracker, seed
        self._streams: dict[str, np.random.Generator] = {}  # of the draws, by the track's name
        self._tracks: tuple[Track, ...] | None = None

    @property
    def detections(self) -> tuple[Detection, ...]:
        """None: what the tracker found in a scan it keeps to itself."""
        return ()

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """The tracks after one more reading. Raises PluginFault for what is none, and for names that are none."""
        with PluginFault.told(self._name, "update()"):
            self._tracks = self._tracks_of(reading, self._own.update(sealed_message(reading), sealed_message(robot)))
        return self._tracks

    def _tracks_of(self, reading: Reading, found: Any) -> tuple[Track, ...]:
        tracks = tuple(found) if isinstance(found, list | tuple) else (found,)
        kinds = {type(track).__name__ for track in tracks if not isinstance(track, Track)}
        if kinds:
            raise PluginFault(f"{self._name}: update() returned {', '.join(sorted(kinds))} in place of tracks")
        names = [track.name for track in tracks]
        wrong = next((name for name in names if not (isinstance(name, str) and NAME.fullmatch(name))), None)
        if wrong is not None:
            raise PluginFault(f'{self._name}: a track is named {wrong!r} in place of "track" and a number')
        if len(set(names)) < len(names) or len(names) > MOST_TRACKS:
            raise PluginFault(f"{self._name}: {len(names)} tracks, {len(set(names))} names; {MOST_TRACKS} at most")
        return tuple(self._checked(track, reading.time) for track in tracks)

    def _checked(self, track: Track, time: float) -> Track:
        name = f"{self._name}, {track.name}"
        for part in ("radius", "age", "unseen"):
            if not 0.0 <= float(getattr(track, part)) < np.inf:
                raise PluginFault(f"{name}: {part} must be a finite number >= 0, not {getattr(track, part)}")
        if track.radius not in RADIUS:
            raise PluginFault(f"{name}: radius must be a number {RADIUS}, not {track.radius}")
        row, life = checked(name, track, 4), (float(track.age), float(track.unseen))
        return Track(track.name, time, *row, float(track.radius), bool(track.recovered), *life)

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order; an error before the first reading."""
        if self._tracks is None:
            raise RuntimeError("draw() needs tracks: call update() with a reading first")
        return tuple(shuffled(track.particles, track.weights, num, self._stream(track.name)) for track in self._tracks)

    def _stream(self, name: str) -> np.random.Generator:
        if name not in self._streams:
            self._streams[name] = stream(self._seed, DRAWS, name)
        return self._streams[name]
