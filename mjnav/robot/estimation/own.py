"""Estimators of a user's own: they get copies of the readings, and what they return is copied and checked.

The samples that the controller gets are drawn from the checked beliefs, so that what is logged is what was acted on.

A user's tracker that detects people in scans names its tracks itself, and has any number of them.
"""

import re
from dataclasses import replace
from importlib import import_module
from numbers import Real
from typing import Any

import numpy as np

from mjnav.errors import InputError, InvalidValue, PluginFault
from mjnav.filters.particles import shuffled
from mjnav.messages import LARGEST, Array, Beliefs, Detection, Reading, RobotBelief, Track
from mjnav.rng import stream
from mjnav.robot.estimation.base import DRAWS, PeopleTracker, PoseEstimator
from mjnav.scene.ranges import MAX_TIME
from mjnav.sealed import checked_copy, sealed_message
from mjnav.settings import Range

# -------------------------------------------------------------------------- localizers and trackers


WEIGHT_SUM_TOLERANCE = 1e-6
TIME, RADIUS = Range(0.0, MAX_TIME, "s"), Range(0.0, 10.0, "m", open_low=True)  # of a belief; of a person


class OwnLocalizer(PoseEstimator):
    """The robot's pose by a user's localizer."""

    def __init__(self, name: str, localizer: Any, seed: int):
        super().__init__(seed)
        self._name, self._own = name, localizer

    def update(self, reading: Reading) -> RobotBelief:
        """The localizer's belief. Raises PluginFault where it is none."""
        with PluginFault.told(self._name, "update()"):
            found = self._own.update(sealed_message(reading))
            if not isinstance(found, RobotBelief):
                raise PluginFault(f"{self._name}: update() returned a {type(found).__name__} in place of a RobotBelief")
            self._belief = RobotBelief(reading.time, **checked(self._name, found, 3))
        return self._belief


class OwnTracker(PeopleTracker):
    """The people by a user's tracker."""

    def __init__(self, name: str, tracker: Any, radii: tuple[float, ...], seed: int):
        super().__init__(radii, seed)
        self._name, self._own = name, tracker

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, in the order of the detections. Raises PluginFault for what is none.

        The tracker returns these alone, or one a person, of which those of people who are not there are dropped.
        """
        with PluginFault.told(self._name, "update()"):
            self._tracks = self._tracks_of(reading, self._own.update(sealed_message(reading)))
        return self._tracks

    def _tracks_of(self, reading: Reading, found: Any) -> tuple[Track, ...]:
        tracks = tuple(found) if isinstance(found, list | tuple) else (found,)
        there = self._detected(reading)
        if len(tracks) == len(self._names):
            tracks = tuple(tracks[p] for p in there)
        if len(tracks) != len(there) or not all(isinstance(track, Track) for track in tracks):
            kinds = ", ".join(type(track).__name__ for track in tracks)
            expected = f"{len(there)} of Track, one for each person who is there"
            raise PluginFault(f"{self._name}: update() returned ({kinds}) in place of {expected}")
        names = [self._names[p] for p in there]
        rows = [checked(f"{self._name}, {name}", track, 4) for name, track in zip(names, tracks, strict=True)]
        self._tracked = there
        return tuple(
            Track(self._names[p], reading.time, **row, radius=self._radii[p])
            for p, row in zip(there, rows, strict=True)
        )


def checked(name: str, belief: RobotBelief | Track, size: int) -> dict[str, Any]:
    """Copies of what a belief about `size` numbers holds, checked. Raises PluginFault.

    `particles` (n, size), `weights` (n,), `mean` (size,), `covariance` (size, size), `ess` and `recovered`.
    """
    num = np.shape(belief.particles)[0] if np.ndim(belief.particles) else 0
    particles = checked_copy(f"{name}: particles", belief.particles, (max(num, 1), size))
    weights = checked_copy(f"{name}: weights", belief.weights, (num,))
    mean = checked_copy(f"{name}: mean", belief.mean, (size,))
    covariance = checked_copy(f"{name}: covariance", belief.covariance, (size, size))
    if (np.abs(particles) > LARGEST).any():
        raise PluginFault(f"{name}: particles holds a number beyond {LARGEST:g}")
    if (weights < 0.0).any() or abs(weights.sum() - 1.0) > WEIGHT_SUM_TOLERANCE:
        found = f"the least is {weights.min()}, the sum {weights.sum()}"
        raise PluginFault(f"{name}: weights must be >= 0 and sum to 1: {found}")
    ess = _number_from(name, "ess", belief, open_low=True)
    if not isinstance(belief.recovered, bool | np.bool_):
        raise PluginFault(f"{name}: recovered must be True or False, not {belief.recovered!r:.60}")
    given = {"particles": particles, "weights": weights, "mean": mean, "covariance": covariance, "ess": ess}
    return {**given, "recovered": bool(belief.recovered)}


def _checked_track(name: str, track: Track) -> dict[str, Any]:
    """The same of a track, with its `radius`, `age` and `unseen`."""
    numbers = {part: _number_from(name, part, track) for part in ("radius", "age", "unseen")}
    if numbers["radius"] not in RADIUS:
        raise PluginFault(f"{name}: radius must be a number {RADIUS}, not {track.radius}")
    return checked(name, track, 4) | numbers


def _number_from(name: str, part: str, belief: Any, *, open_low: bool = False) -> float:
    """A finite number >= 0, or > 0, of a belief. Raises PluginFault."""
    value = getattr(belief, part)
    number = float(value) if isinstance(value, Real) else np.nan
    if not 0.0 <= number < np.inf or (open_low and number == 0.0):
        raise PluginFault(f"{name}: {part} must be a finite number {'>' if open_low else '>='} 0, not {value}")
    return number


def checked_beliefs(beliefs: Beliefs) -> Beliefs:
    """Beliefs that a caller hands over, as copies. Raises InputError for what cannot be used."""
    if not (isinstance(beliefs, Beliefs) and isinstance(beliefs.robot, RobotBelief)):
        raise InvalidValue("beliefs", beliefs, "Beliefs of a RobotBelief")
    for key, kind in (("people", Track), ("detections", Detection)):
        given = getattr(beliefs, key)
        if not isinstance(given, list | tuple) or not all(isinstance(one, kind) for one in given):
            raise InvalidValue(f"beliefs.{key}", given, f"a tuple of {kind.__name__}")
    for track in beliefs.people:
        if not isinstance(track.name, str):
            raise InvalidValue("beliefs.people.name", track.name, "a text")
    try:
        robot = replace(beliefs.robot, time=_time(beliefs.robot), **checked("beliefs.robot", beliefs.robot, 3))
        people = [
            replace(track, time=_time(track), **_checked_track(f"beliefs, {track.name}", track))
            for track in beliefs.people
        ]
        detections = tuple(_checked_detection("beliefs.detections", one) for one in beliefs.detections)
    except (PluginFault, TypeError, ValueError, OverflowError) as fault:  # of nobody's plug-in
        raise InputError(str(fault)) from None
    return replace(beliefs, robot=robot, people=tuple(people), detections=detections)


def _time(belief: Any) -> float:
    time = _number_from("beliefs", "time", belief)
    TIME.check("beliefs.time", time)
    return time


def _checked_detection(name: str, detection: Detection) -> Detection:
    """A copy of a detection, checked. Raises PluginFault."""
    time, radius, num_beams = (_number_from(name, part, detection) for part in ("time", "radius", "num_beams"))
    position = checked_copy(f"{name}: position", detection.position, (2,))
    covariance = checked_copy(f"{name}: covariance", detection.covariance, (2, 2))
    return Detection(time, position, covariance, radius, int(num_beams))


# --------------------------------------------------------------------------------- tracker by scans


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
        return tuple(
            Track(track.name, reading.time, **_checked_track(f"{self._name}, {track.name}", track)) for track in tracks
        )

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order; an error before the first reading."""
        if self._tracks is None:
            raise RuntimeError("draw() needs tracks: call update() with a reading first")
        return tuple([shuffled(t.particles, t.weights, num, self._stream(t.name)) for t in self._tracks])

    def _stream(self, name: str) -> np.random.Generator:
        if name not in self._streams:
            self._streams[name] = stream(self._seed, DRAWS, name)
        return self._streams[name]
