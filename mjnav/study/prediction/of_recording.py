"""Moments of a recording of people: as exactly as it says, or as a tracker believes from noisy detections.

The protocol of Pellegrini et al. 2009 and of those who followed: a person counts who was seen at 8 frames in a row, and
is predicted over the next 12, all 0.4 s apart; every such window counts. With exact positions the velocity is that of
the last step. A tracker detects everybody between the frames too, on a cubic spline through the recorded positions.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.estimation import make_tracker
from mjnav.estimation.base import person_track
from mjnav.filters.resampling import shuffled
from mjnav.messages import Array, Reading, Track
from mjnav.rng import stream
from mjnav.scenarios.crowd.reader import Recording
from mjnav.scenarios.crowd.spline import TrackSplines
from mjnav.scenarios.crowd.tracks import Placement, tracks_of
from mjnav.scenarios.crowd.tracks import Track as RecordedTrack
from mjnav.scenarios.people import ConstantVelocity, Person
from mjnav.scenarios.spec import Scenario
from mjnav.study.prediction.forecast import Moment

SEEN = 8  # frames, the latest among them
RADIUS = 0.3  # [m] of a person


@dataclass(frozen=True, slots=True)
class Frames:
    """Where everybody was, at whole steps of a recording."""

    step: float  # [s]
    places: Mapping[str, Mapping[int, Array]]  # by person and number of the step: (2,) [m]
    tracks: tuple[RecordedTrack, ...]

    @classmethod
    def of(cls, recording: Recording, frame_rate: float) -> "Frames":
        """The rows whose time is a whole number of the recording's usual steps. Raises InvalidValue without any."""
        step = recording.usual_step / frame_rate
        if step == 0.0:
            raise InvalidValue("", f"{len(recording.labels)} people", "a recording with people in two rows or more")
        places: dict[str, dict[int, Array]] = {}
        tracks = tracks_of(recording, frame_rate, Placement(), 1.5 * step).tracks
        for track in tracks:
            number = track.rows[:, 0] / step
            whole = np.abs(number - number.round()) < 1e-3
            found = places.setdefault(track.label, {})
            found.update(zip(number[whole].round().astype(int).tolist(), track.rows[whole, 1:], strict=True))
        return cls(step, places, tracks)

    def whereabouts(self, person: str, times: Array) -> Array:
        """Where a person was at times (n,) [s]: (n, 2) [m], linear between steps; NaN where they were not there."""
        found, nowhere = self.places[person], np.full(2, np.nan)
        before = np.floor(times / self.step + 1e-6).astype(int)
        share = (times / self.step - before).clip(min=0.0)[:, None]
        first = np.array([found.get(k, nowhere) for k in before.tolist()])
        then = np.array([found.get(k + 1, nowhere) for k in before.tolist()])
        return np.where(share < 1e-6, first, first + share * (then - first))

    def moments(self, num: int) -> Iterator[Moment]:
        """One moment a frame, with everybody who was there a step before too; `num` samples, all alike."""
        last = max(max(found) for found in self.places.values())
        seen = dict.fromkeys(self.places, 0)
        for k in range(last + 1):
            tracks, samples, scored = [], [], []
            for person, found in self.places.items():
                seen[person] = seen[person] + 1 if k in found else 0
                if seen[person] < 2:
                    continue
                state = np.concatenate([found[k], (found[k] - found[k - 1]) / self.step])
                tracks.append(person_track(person, k * self.step, RADIUS, state[None]))
                samples.append(np.tile(state, (num, 1)))
                if seen[person] >= SEEN:
                    scored.append(person)
            yield Moment(k * self.step, tuple(tracks), np.array(samples).reshape(-1, num, 4), tuple(scored))

    def believed(self, num: int, scenario: Scenario, seed: int) -> Iterator[Moment]:
        """One moment a reading of the scenario's sensors; predictions count at the frames.

        Everybody has a tracker of their own, which the scenario chooses, from where they come in to where they leave.
        """
        pieces = [_TrackedPiece(track, scenario, i, seed) for i, track in enumerate(self.tracks)]
        last = max(piece.end for piece in pieces)
        for k in range(round(last * scenario.sensors.rate) + 1):
            time = k / scenario.sensors.rate
            frame = time / self.step
            at_frame = abs(frame - round(frame)) < 1e-6
            found = [
                piece.update(time, num) for piece in pieces if piece.start <= time + 1e-9 and time <= piece.end + 1e-9
            ]
            scored = [track.name for track, seen, _ in found if at_frame and seen >= (SEEN - 1) * self.step - 1e-9]
            samples = np.array([drawn for _, _, drawn in found]).reshape(-1, num, 4)
            yield Moment(time, tuple(track for track, _, _ in found), samples, tuple(scored))


class _TrackedPiece:
    """A recorded track, as a tracker sees it through noisy detections."""

    def __init__(self, track: RecordedTrack, scenario: Scenario, index: int, seed: int):
        self._label = track.label
        self._spline = TrackSplines([track.rows])
        self.start, self.end = float(track.rows[0, 0]), float(track.rows[-1, 0])
        person = Person(start=(0.0, 0.0), behaviour=ConstantVelocity((0.0, 0.0)), radius=RADIUS)
        own = int(stream(seed, "prediction.recording", str(index)).integers(2**32))
        self._tracker = make_tracker(replace(scenario, people=(person,)), own)
        noise = scenario.noise.distributions()
        self._noise = [(noise[f"detection.{axis}"], stream(own, f"detection.{axis}")) for axis in "xy"]
        self._draws = stream(own, "prediction.draws")
        self._before: float | None = None

    def update(self, time: float, num: int) -> tuple[Track, float, Array]:
        """The track after a detection at `time`, for how long the person has been there [s], and samples (num, 4)."""
        error = np.array([noise.sample(rng, 1)[0] for noise, rng in self._noise])
        interval = 0.0 if self._before is None else time - self._before
        self._before = time
        detections = self._spline.positions(time) + error
        reading = Reading(time, interval, np.zeros(2), 0.0, np.zeros(3), detections, np.zeros(0))
        (track,) = self._tracker.update(reading)
        drawn = shuffled(track.particles, track.weights, num, self._draws)
        return replace(track, name=self._label), time - self.start, drawn
