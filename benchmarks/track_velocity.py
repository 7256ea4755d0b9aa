"""How the velocities of tracks tremble and how late they follow: autocorrelation and spectrum of their errors.

    uv run python benchmarks/track_velocity.py [--seeds N] [--source detections|lidar] [--noise PROFILE]

People walk straight on at 1.2 m/s, stop, turn by a right angle or start, at 10 Hz. Under `detections` their places come
with the noise of the profile; under `lidar` with 3 cm, as a scan shows them from 3 m, and no identity. Printed for
every filter, over N seeds (12 by default):

    error        std of a velocity component while somebody walks straight on, of settled tracks
    change       the same of its change from one tick to the next
    ... s        autocorrelation of the error
    < ... Hz     share of the error's power
    stop, turn, start   delay until the mean of all seeds is within a quarter of the new velocity [s]
"""

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mjnav.messages import Array, Detection, Reading, RobotBelief
from mjnav.noise import profile
from mjnav.rng import stream
from mjnav.robot.estimation import TRACKERS, estimator_class
from mjnav.robot.estimation.lidar.tracker import KalmanLidarTracker, LidarTracker

PERIOD, SPEED, CHANGE, TICKS, SETTLED = 0.1, 1.2, 100, 160, 20
LAGS, BANDS = (1, 2, 3, 5, 10), (0.5, 1.5)
SCAN_STD = 0.03  # [m]
ROBOT = RobotBelief(0.0, np.zeros((1, 3)), np.ones(1), np.zeros(3), np.zeros((3, 3)), 1.0)


def paths() -> Array:
    """(T, 4, 2) of who walks straight on, stops, turns and starts, 8 m apart."""
    time, change, found = PERIOD * np.arange(TICKS), PERIOD * CHANGE, np.zeros((TICKS, 4, 2))
    before, after = SPEED * np.minimum(time, change), SPEED * np.maximum(time - change, 0.0)
    found[:, 0, 0], found[:, 1, 0], found[:, 2, 0], found[:, 3, 0] = SPEED * time, before, before, after
    found[:, 2, 1] = after
    found[:, :, 1] += 8.0 * np.arange(4)
    return found


class Scans:
    """What a scan would show of people who are all in view."""

    def __init__(self, seed: int):
        self._rng = stream(seed, "benchmark.scan")

    def detect(self, reading: Reading, robot: RobotBelief) -> "Scans":
        noise = SCAN_STD * self._rng.standard_normal(reading.detections.shape)
        places, covariance = reading.detections + noise, SCAN_STD**2 * np.eye(2)
        self.detections = tuple(Detection(reading.time, place, covariance, 0.3, 20) for place in places)
        return self

    def visible(self, points: Array, radius: float) -> Array:
        return np.ones(len(points))


def velocities(make: Callable[[int], Any], seed: int, noise, source: str) -> Array:
    """Mean velocities of the four, (T, 4, 2)."""
    tracker, truth = make(seed), paths()
    errors = np.zeros(truth.shape)
    if source == "detections":
        draws = [[noise[f"detection.{c}"].sample(stream(seed, f"{c}{p}"), TICKS) for c in "xy"] for p in range(4)]
        errors = np.moveaxis(np.array(draws), 2, 0)
    found = np.full(truth.shape, np.nan)
    for k, places in enumerate(truth + errors):
        reading = Reading(PERIOD * k, PERIOD * bool(k), np.zeros(2), 0.0, np.zeros(3), places, np.ones(1))
        for track in tracker.update(reading, ROBOT):
            found[k, np.argmin(np.hypot(*(truth[k] - track.mean[:2]).T))] = track.mean[2:]  # of the nearest person
    return found


def row(name: str, found: Array) -> str:
    """The figures of one filter, by velocities (S, T, 4, 2)."""
    error = found[:, SETTLED:CHANGE] - np.array([[SPEED, 0.0], [SPEED, 0.0], [SPEED, 0.0], [0.0, 0.0]])
    error = error[:, :, :3].swapaxes(1, 2).swapaxes(2, 3).reshape(-1, CHANGE - SETTLED)  # walkers' components in time
    correlation = [np.mean(error[:, :-lag] * error[:, lag:]) / np.mean(error**2) for lag in LAGS]
    power, hertz = np.mean(np.abs(np.fft.rfft(error, axis=1)) ** 2, axis=0), np.fft.rfftfreq(error.shape[1], PERIOD)
    power[1:-1] *= 2.0
    shares = [power[hertz < band].sum() / power.sum() for band in BANDS]
    new = np.array([[SPEED, 0.0], [0.0, 0.0], [0.0, SPEED], [SPEED, 0.0]])
    off = np.hypot(*np.moveaxis(found.mean(axis=0)[CHANGE:] - new, 2, 0))  # (T, 4)
    delays = [PERIOD * np.argmax(off[:, p] < 0.25 * SPEED) for p in (1, 2, 3)]
    figures = [error.std(), np.diff(error, axis=1).std()]
    return (
        f"{name:45s}" + "".join(f"{f:8.3f}" for f in figures) + "".join(f"{c:8.2f}" for c in (*correlation, *shares))
        + "".join(f"{d:8.1f}" for d in delays)
    )  # fmt: skip


def by_scans(kind: type[LidarTracker], seed: int) -> object:
    return kind(Scans(seed), 200, seed)


def filters(source: str, noise) -> dict[str, Callable[[int], object]]:
    """Makers of trackers by name."""
    if source == "lidar":
        kinds = {"particle": LidarTracker, "kalman": KalmanLidarTracker}
        return {name: partial(by_scans, kind) for name, kind in kinds.items()}
    return {
        name: partial(estimator_class(TRACKERS[f"detections.{name}"]), noise, 200, (0.3,) * 4)
        for name in ("particle", "kalman")
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--source", choices=("detections", "lidar"), default="detections")
    parser.add_argument("--noise", default="pearson")
    arguments = parser.parse_args()
    noise = dict(profile(arguments.noise))
    names = [f"{PERIOD * lag:.1f} s" for lag in LAGS] + [f"<{band:g} Hz" for band in BANDS] + ["stop", "turn", "start"]
    print(f"{'':45s}{'error':>8s}{'change':>8s}" + "".join(f"{name:>8s}" for name in names))
    for name, make in filters(arguments.source, noise).items():
        found = [velocities(make, seed, noise, arguments.source) for seed in range(arguments.seeds)]
        print(row(name, np.array(found)), flush=True)


if __name__ == "__main__":
    main()
