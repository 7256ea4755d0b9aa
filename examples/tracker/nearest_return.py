"""A tracker by scans: alpha-beta filters on what the map does not explain, each to its nearest detection.

    mjnav run crossing1 --set estimation.obstacles.tracker=nearest_return.py:NearestReturn

`by_scans = True` says that detections come without identity: `update` is given the robot's belief, too, and names its
tracks itself. mjnav's detector finds the bodies; a tracker may as well go by `reading.scan` alone.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from mjnav.messages import Reading, RobotBelief, Track
from mjnav.rng import stream
from mjnav.robot.estimation.base import person_track
from mjnav.robot.estimation.lidar.detector import Detector
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle

ALPHA, BETA = 0.4, 0.1
SPREAD = np.array([0.08, 0.08, 0.2, 0.2])  # [m, m, m/s, m/s] std of the samples


@dataclass(frozen=True, slots=True, kw_only=True)
class NearestReturnParameters:
    """Keys beside the tracker's name."""

    gate: Annotated[float, Range(0.1, 5.0, "m"), "from a track to its detection, at most"] = 0.6
    patience: Annotated[float, Range(0.0, 60.0, "s"), "that a track lives without a detection"] = 0.5

    def __post_init__(self):
        settle(self)


@dataclass
class _Body:
    name: str
    state: np.ndarray  # (4,) x, y, vx, vy
    radius: float
    born: float
    seen: float


class NearestReturn:
    """Tracks are born of detections that no track is near to."""

    parameters_type = NearestReturnParameters
    by_scans = True

    def __init__(self, scenario: Scenario, seed: int, parameters: NearestReturnParameters):
        self._parameters, self._detector = parameters, Detector.of(scenario)
        num = scenario.estimation.obstacles.particles
        self._offsets = stream(seed, "nearest_return").normal(0.0, SPREAD, (num, 4))
        self._bodies: list[_Body] = []
        self._born = 0

    def update(self, reading: Reading, robot: RobotBelief) -> list[Track]:
        """One track for each body."""
        detections = list(self._detector.detect(reading, robot).detections)
        for body in self._bodies:
            body.state[:2] += reading.interval * body.state[2:]
            nearest = min(detections, key=lambda one: np.hypot(*(one.position - body.state[:2])), default=None)
            if nearest is not None and np.hypot(*(nearest.position - body.state[:2])) < self._parameters.gate:
                residual = nearest.position - body.state[:2]
                body.state[:2] += ALPHA * residual
                body.state[2:] += BETA / max(reading.interval, 1e-3) * residual
                body.seen = reading.time
                detections = [one for one in detections if one is not nearest]
        for one in detections:
            state = np.array([*one.position, 0.0, 0.0])
            self._bodies.append(_Body(f"track{self._born}", state, one.radius, reading.time, reading.time))
            self._born += 1
        self._bodies = [body for body in self._bodies if reading.time - body.seen <= self._parameters.patience]
        return [self._track(body, reading.time) for body in self._bodies]

    def _track(self, body: _Body, time: float) -> Track:
        track = person_track(body.name, time, body.radius, body.state + self._offsets)
        return replace(track, age=time - body.born, unseen=time - body.seen)
