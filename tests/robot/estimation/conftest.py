"""A unicycle and walking people without physics, and sensors that add noise to them."""

from collections.abc import Callable

import numpy as np
import pytest

from mjnav.messages import Reading
from mjnav.motion.unicycle import integrate
from mjnav.noise import Distribution, profile
from mjnav.rng import stream

INTERVAL = 0.1  # [s]


@pytest.fixture(scope="session")
def pearson() -> dict[str, Distribution]:
    return dict(profile("pearson"))


@pytest.fixture(scope="session")
def gaussian() -> dict[str, Distribution]:
    return dict(profile("gaussian"))


class Mirrored:
    """The noise with its sign turned: what a filter believes that takes x - z for z - x."""

    def __init__(self, noise):
        self.noise, self.mean, self.std = noise, -noise.mean, noise.std

    def sample(self, rng, size):
        return -self.noise.sample(rng, size)

    def logpdf(self, x):
        return self.noise.logpdf(-np.asarray(x))


@pytest.fixture(scope="session")
def mirrored() -> type[Mirrored]:
    return Mirrored


@pytest.fixture(scope="session")
def drive() -> Callable[..., tuple[list[Reading], np.ndarray]]:
    """drive(noise, seed, ticks, v, omega, people=(P, 4)) -> readings and true poses (T, 3).

    People keep their velocities.
    """

    def run(noise, seed, ticks=300, v=0.8, omega=0.3, start=(0.0, 0.0, 0.0), people=()):
        def sample(channel, body="robot"):
            return noise[channel].sample(rngs[channel, body], 1)[0]

        people = np.reshape(np.asarray(people, float), (-1, 4))
        bodies = [f"person{p}" for p in range(len(people))]
        names = [(c, "robot") for c in noise] + [(f"detection.{a}", b) for b in bodies for a in "xy"]
        rngs = {name: stream(seed, *name) for name in names}
        pose, readings, truth = np.asarray(start, float), [], []
        for k in range(ticks):
            if k:
                pose = integrate(pose, v, omega, INTERVAL)
            position = people[:, :2] + k * INTERVAL * people[:, 2:]
            readings.append(
                Reading(
                    time=k * INTERVAL,
                    interval=INTERVAL if k else 0.0,
                    odometry=np.array([v + sample("odometry.v"), omega + sample("odometry.omega")]) * bool(k),
                    gyro=omega,
                    pose=pose + [sample(f"pose.{c}") for c in ("x", "y", "theta")],
                    detections=position
                    + np.reshape([[sample(f"detection.{a}", b) for a in "xy"] for b in bodies], (-1, 2)),
                    scan=np.zeros(0),
                )
            )
            truth.append(pose)
        return readings, np.array(truth)

    return run
