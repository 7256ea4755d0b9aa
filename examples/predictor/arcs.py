"""A predictor: everybody walks on along a circle, at the turn rate of the last second or so.

    mjnav run crossing1 --set prediction.model=arcs.py:Arcs

The turn rate w of a person is averaged over the readings, and each sample (x, v) goes on as

    x(t) = x + t sinc(w t / 2) R(w t / 2) v,     sinc(a) = sin(a) / a,  R(a) a turn by a,

which is a straight line for w = 0 (constant turn rate and velocity, as in Schubert, Richter & Wanielik 2008).
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.robot.prediction import Crowd, Futures
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle


@dataclass(frozen=True, slots=True, kw_only=True)
class ArcsParameters:
    """Keys beside the model's name."""

    memory: Annotated[float, Range(0.05, 10.0, "s"), "over which a turn rate is averaged"] = 1.0
    max_turn_rate: Annotated[float, Range(0.0, 5.0, "rad/s"), "of a person"] = 0.6

    def __post_init__(self):
        settle(self)


class Arcs:
    """What it remembers of a person: when and in which direction they walked, and the turn rate so far."""

    parameters_type = ArcsParameters

    def __init__(self, scenario: Scenario, seed: int, parameters: ArcsParameters):
        self._parameters = parameters
        assert scenario.prediction is not None  # it names this class
        self._step, self._num = scenario.prediction.step, scenario.prediction.num_steps
        self._seen: dict[str, tuple[float, float, float]] = {}  # by name: time [s], heading [rad], turn rate [rad/s]

    def predict(self, crowd: Crowd) -> Futures:
        """Samples of the people in crowd.tracks: P people, M samples, H + 1 moments from the decision's effect on."""
        # A person who has no track any more is forgotten, and begins anew on coming back.
        self._seen = {track.name: self._watched(track) for track in crowd.tracks}
        rates = np.array([rate for _, _, rate in self._seen.values()]).reshape(-1, 1, 1)
        time = crowd.elapsed + self._step * np.arange(self._num + 1)  # (P, 1, H + 1)
        half = 0.5 * rates * time
        ahead = time * np.sinc(half / np.pi)
        along, across = ahead * np.cos(half), ahead * np.sin(half)
        x, y, vx, vy = np.moveaxis(crowd.samples[:, :, None], -1, 0)  # (P, M, 1) each
        paths = np.stack([x + along * vx - across * vy, y + across * vx + along * vy], axis=-1)
        return Futures.along(paths, self._step)

    def _watched(self, track) -> tuple[float, float, float]:
        heading = float(np.arctan2(track.mean[3], track.mean[2]))
        time, before, rate = self._seen.get(track.name, (track.time, heading, 0.0))
        if track.time <= time:  # no reading since the tick before
            return track.time, heading, rate
        interval = track.time - time
        turned = (heading - before + np.pi) % (2.0 * np.pi) - np.pi
        most = self._parameters.max_turn_rate
        now = float(np.clip(turned / interval, -most, most))
        return track.time, heading, rate + (1.0 - np.exp(-interval / self._parameters.memory)) * (now - rate)
