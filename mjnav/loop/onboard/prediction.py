"""Carries the robot's belief through all commands still to take effect, to the moment at which a decision does.

Between the reading that a belief stands for and that moment, the robot does what is already under way: commands in
force and pending, each reached at the acceleration limits. Every robot sample goes its own way, with its own draws of
the actuation noise, which hold for a window each as they do in the world. People are carried by `mjnav.prediction`.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.loop.onboard.commands import ROUNDING, Stretch
from mjnav.messages import Array, RobotLimits
from mjnav.motion.diff_drive import ramp_mean
from mjnav.motion.rows import integrate_rows
from mjnav.noise import NOISE_WINDOW, Distribution
from mjnav.rng import stream


class RobotPrediction:
    """Carries samples; its draws come from streams of its own."""

    def __init__(self, noise: Mapping[str, Distribution], limits: RobotLimits, seed: int):
        channels = ("actuation.v", "actuation.omega")
        self._limits = limits
        self._noise = tuple((noise[channel], stream(seed, "prediction", channel)) for channel in channels)

    def robot(self, pose: Array, start: float, end: float, stretches: Sequence[Stretch]) -> tuple[Array, Array]:
        """Poses (N, 3) at `end` from poses (N, 3) at `start`, and the actuation noise in force at `end`, (N, 2)."""
        first = _window(start)
        windows = _window(end) - first + 1
        v, omega = (d.sample(rng, (windows, len(pose))) for d, rng in self._noise)
        for stretch in stretches:
            begin, before = stretch.start, stretch.set_point
            while stretch.end - begin > ROUNDING:
                window = _window(begin)
                until = min(stretch.end, (window + 1) * NOISE_WINDOW)
                mean, before = ramp_mean(before, stretch.command, self._limits, until - begin)
                i = window - first
                pose = integrate_rows(pose, mean[0] + v[i], mean[1] + omega[i], until - begin)
                begin = until
        return pose, np.column_stack([v[-1], omega[-1]])


def _window(time: float) -> int:
    """Index of the noise window that holds at `time` [s]."""
    return int(np.floor((time + ROUNDING) / NOISE_WINDOW))
