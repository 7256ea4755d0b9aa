"""Moments of a recording of people: everybody at each of its frames, as exactly as it says.

The protocol of Pellegrini et al. 2009 and of those who followed: a person counts who was seen at 8 frames in a row, and
is predicted over the next 12, all 0.4 s apart; every such window counts. The velocity is that of the last step.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.estimation.base import person_track
from mjnav.messages import Array
from mjnav.scenarios.crowd.reader import Recording
from mjnav.scenarios.crowd.tracks import Placement, tracks_of, usual_step
from mjnav.study.prediction.forecast import Moment

SEEN = 8  # frames, the latest among them
RADIUS = 0.3  # [m] of a person


@dataclass(frozen=True, slots=True)
class Frames:
    """Where everybody was, at whole steps of a recording."""

    step: float  # [s]
    places: Mapping[str, Mapping[int, Array]]  # by person and number of the step: (2,) [m]

    @classmethod
    def of(cls, recording: Recording, frame_rate: float) -> "Frames":
        """The rows whose time is a whole number of the recording's usual steps. Raises InvalidValue without any."""
        step = usual_step(recording) / frame_rate
        if step == 0.0:
            raise InvalidValue("", f"{len(recording.labels)} people", "a recording with people in two rows or more")
        places: dict[str, dict[int, Array]] = {}
        for track in tracks_of(recording, frame_rate, Placement(), 1.5 * step).tracks:
            number = track.rows[:, 0] / step
            whole = np.abs(number - number.round()) < 1e-3
            found = places.setdefault(track.label, {})
            found.update(zip(number[whole].round().astype(int).tolist(), track.rows[whole, 1:], strict=True))
        return cls(step, places)

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
