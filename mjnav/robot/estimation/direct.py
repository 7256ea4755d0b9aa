"""Beliefs without a filter: each reading less fresh draws of its noise.

Filtering makes beliefs nearly Gaussian. These keep the shape of the noise, reflected: where readings err to the right,
the truth lies to their left. They are the samples that Nair et al. (arXiv 2112.13034) give to their controller.
"""

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.filters.particles import weighted_moments
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.robot.estimation import base
from mjnav.robot.estimation.particle import ODOMETRY_CHANNELS, POSE_CHANNELS, moved, pose_samples

VELOCITY_WINDOW = 1.0  # [s] of detections behind a velocity: shorter is noisier, longer lags behind a turn


class DirectLocalizer(base.PoseEstimator):
    """Particles = pose reading - noise draws, equally weighted; without noise all of them are the reading."""

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, seed: int):
        super().__init__(seed)
        self._noise = [noise[channel] for channel in POSE_CHANNELS]
        self._weights = np.full(num_particles, 1.0 / num_particles)
        self._stream = stream(seed, "estimation.direct")
        self._odometry = [base.widened(channel, noise[channel]) for channel in ODOMETRY_CHANNELS]
        self._motion_streams = [stream(seed, f"estimation.motion.{channel}") for channel in ODOMETRY_CHANNELS]

    def update(self, reading: Reading) -> RobotBelief:
        """The belief from this reading alone; without a pose in it the one before, moved by odometry."""
        particles = pose_samples(reading, self._noise, self._weights.size, self._stream)
        if "pose" in reading.dropped and self._belief is not None:
            particles = moved(self._belief.particles, reading, self._odometry, self._motion_streams)
        mean, covariance = weighted_moments(particles, self._weights, base.HEADING)
        self._belief = RobotBelief(
            reading.time, particles, self._weights, mean, covariance, ess=float(self._weights.size)
        )
        return self._belief


class DirectTracker(base.PeopleTracker):
    """Position = detection - noise draws; velocity = the slope of such positions over a window.

    Sample i keeps the draws that were made for each detection of the window, so it is one possible history. Its
    velocity is the least-squares slope with the prior v0_i ~ N(0, WALKING_SPEED^2) as one more equation,

        v_i = (sum_k t_k p_ik + r v0_i) / (sum_k t_k^2 + r),   r = (noise std / WALKING_SPEED)^2,

    t_k from the window's mean time. With one detection it is the prior, with two it is not yet ruled by the noise, and
    after a whole window the prior weighs about 1 %. Where the reading tells velocities, they are taken.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, radii: Sequence[float], seed: int):
        super().__init__(radii, seed)
        self._noise = [noise[channel] for channel in base.DETECTION_CHANNELS]
        self._weights = np.full(num_particles, 1.0 / num_particles)
        std = [
            max(channel.std, base.LEAST_STD[name])
            for channel, name in zip(self._noise, base.DETECTION_CHANNELS, strict=True)
        ]
        self._ridge = np.square(np.asarray(std) / base.WALKING_SPEED)  # (2,) r [s^2]
        self._streams = [stream(seed, "estimation.direct", name) for name in self._names]
        self._prior_velocity = base.WALKING_SPEED * np.stack(
            [stream(seed, "estimation.start", name).standard_normal((num_particles, 2)) for name in self._names]
            or [np.zeros((num_particles, 2))]
        )  # (P, n, 2)
        self._history: deque[tuple[float, Array]] = deque()  # time, positions (P, n, 2)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, from the readings of the window since they came."""
        if not self._names:
            self._tracks = ()
            return ()
        tracked = self._detected(reading)
        if "detections" in reading.dropped and self._tracks is not None:
            return self._coasted(reading)
        position = np.stack(
            [
                detection_samples(detection, self._noise, self._weights.size, rng)
                for detection, rng in zip(reading.detections, self._streams, strict=True)
            ]
        )
        self._history.append((reading.time, position))
        while self._history[0][0] < reading.time - VELOCITY_WINDOW - 1e-9:
            self._history.popleft()
        if reading.people_velocity is None:
            velocity = np.stack([self._velocity(p) for p in range(len(position))])
        else:
            velocity = np.repeat(reading.people_velocity[:, None], self._weights.size, axis=1)
        particles = np.nan_to_num(np.concatenate([position, velocity], axis=-1))
        mean, covariance = zip(*[weighted_moments(states, self._weights, -1) for states in particles], strict=True)
        return self._conclude(reading.time, particles, self._weights, mean, covariance, tracked)

    def _coasted(self, reading: Reading) -> tuple[Track, ...]:
        """The tracks before, each sample on at its velocity."""
        tracks = []
        for track in self._tracks or ():
            position, velocity = np.hsplit(track.particles, 2)
            states = np.hstack([position + (reading.time - track.time) * velocity, velocity])
            tracks.append(base.person_track(track.name, reading.time, track.radius, states))
        self._tracks = tuple(tracks)
        return self._tracks

    def _velocity(self, person: int) -> Array:
        """Slope of a person's positions since they came, (n, 2); NaN for who is not there."""
        times = np.array([time for time, _ in self._history])
        positions = [position[person] for _, position in self._history]
        absent = np.flatnonzero([np.isnan(position[0, 0]) for position in positions])
        since = absent[-1] + 1 if len(absent) else 0
        if since == len(times):
            return np.full_like(positions[-1], np.nan)
        times = times[since:] - times[since:].mean()
        moment = sum(t * position for t, position in zip(times, positions[since:], strict=True))
        return (moment + self._ridge * self._prior_velocity[person]) / (times @ times + self._ridge)


def detection_samples(detection: Array, noise: Sequence[Distribution], num: int, rng: np.random.Generator) -> Array:
    """Detection - noise draws, (num, 2)."""
    return detection - np.stack([channel.sample(rng, num) for channel in noise], axis=-1)
