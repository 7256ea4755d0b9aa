"""The robot's twist from the wheels' odometry and the gyro, and what is left to know where one of them fails.

Two unbiased readings of one turn rate with variances s_o^2 and s_g^2 make the best linear estimate

    omega = a (odometry - mean_o) + (1 - a) (gyro - mean_g),   a = s_g^2 / (s_o^2 + s_g^2)

whose error is the same sum of the two errors. A particle draws both errors from their channels' own laws, so that the
sum keeps their shape.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np

from mjnav.constant import Constant
from mjnav.estimation.likelihood import widened
from mjnav.messages import Array, Reading, RobotLimits
from mjnav.noise import Distribution

TWIST_CHANNELS = ("odometry.v", "odometry.omega", "gyro")
CONFLICT = 6.0  # standard deviations of their difference at which wheels and gyro contradict each other
UNKNOWN_SHARE = 0.3  # of the robot's limits: standard deviation of a component that nothing measured


@dataclass(frozen=True, slots=True)
class Twist:
    """The mean twist over one interval: its estimate, and what that is made of."""

    time: float  # [s] at which the interval ends
    interval: float  # [s]
    v: float  # [m/s]
    omega: float  # [rad/s]
    std: tuple[float, float]  # of v [m/s] and omega [rad/s]
    wheels: float  # share a of the wheels in omega
    knows_v: bool  # whether anything measured v in this interval, and omega
    knows_omega: bool
    rivals: tuple[float, float] | None = None  # omega by the wheels and by the gyro, where they contradict each other

    @property
    def covariance(self) -> Array:
        """Of (v, omega), (2, 2), diagonal."""
        return np.diag(np.square(self.std))


@dataclass(frozen=True, slots=True)
class TwistSensors(Constant):
    """What wheels and gyro are assumed to be worth."""

    v: Distribution
    omega: Distribution
    gyro: Distribution
    unknown: tuple[float, float]  # std of v [m/s] and omega [rad/s] where nothing measured them

    @classmethod
    def of(cls, noise: Mapping[str, Distribution], limits: RobotLimits) -> "TwistSensors":
        """By the assumed noise, widened where it has nearly none."""
        v, omega, gyro = (widened(channel, noise[channel]) for channel in TWIST_CHANNELS)
        return cls(v, omega, gyro, (UNKNOWN_SHARE * limits.max_speed, UNKNOWN_SHARE * limits.max_turn_rate))

    def fused(self, reading: Reading, before: Twist | None = None) -> Twist:
        """The twist over the interval of a reading; a component that nothing measured is the one of `before`.

        Not measured is what the reading says was dropped, and what is not finite.
        """
        v, omega = np.asarray(reading.odometry, float).tolist()
        has_wheels = "odometry" not in reading.dropped
        has_v, has_omega = has_wheels and np.isfinite(v), has_wheels and np.isfinite(omega)
        has_gyro = "gyro" not in reading.dropped and np.isfinite(reading.gyro)
        by_wheels, by_gyro = omega - self.omega.mean, float(reading.gyro) - self.gyro.mean
        variance = self.omega.std**2 + self.gyro.std**2
        share = self.gyro.std**2 / variance if has_omega and has_gyro else float(has_omega)
        rivals = None
        if has_omega and has_gyro:
            fused, std = share * by_wheels + (1.0 - share) * by_gyro, self.omega.std * self.gyro.std / sqrt(variance)
            if abs(by_wheels - by_gyro) > CONFLICT * sqrt(variance):
                rivals, std = (by_wheels, by_gyro), 0.5 * abs(by_wheels - by_gyro)
        elif has_omega or has_gyro:
            fused, std = (by_wheels, self.omega.std) if has_omega else (by_gyro, self.gyro.std)
        else:
            fused, std = (0.0 if before is None else before.omega), self.unknown[1]
        if has_v:
            speed, speed_std = v - self.v.mean, self.v.std
        else:
            speed, speed_std = (0.0 if before is None else before.v), self.unknown[0]
        return Twist(
            reading.time,
            reading.interval,
            speed,
            fused,
            (speed_std, std),
            share,
            bool(has_v),
            bool(has_omega or has_gyro),
            rivals,
        )

    def sample(
        self, twist: Twist, num: int, rngs: Mapping[str, np.random.Generator], blind: tuple[int, int] = (0, 0)
    ) -> tuple[Array, Array]:
        """Draws of v and omega, (num,) each, from generators by channel; each draws as often whatever was measured.

        Where wheels and gyro contradict each other, every other draw goes by the one. `blind` says for how many
        intervals v and omega were not measured before this one: an error that stays grows with the time and not with
        its root, so the draws of interval k spread by sqrt(2 k + 1) as much.
        """
        v, omega, gyro = (
            channel.sample(rngs[name], num) - channel.mean
            for name, channel in zip(TWIST_CHANNELS, (self.v, self.omega, self.gyro), strict=True)
        )
        if twist.rivals is not None:
            found = np.where(np.arange(num) % 2 == 0, twist.rivals[0] - omega, twist.rivals[1] - gyro)
        elif twist.knows_omega:
            found = twist.omega - twist.wheels * omega - (1.0 - twist.wheels) * gyro
        else:
            found = twist.omega + self.unknown[1] * sqrt(2.0 * blind[1] + 1.0) / self.gyro.std * gyro
        if not twist.knows_v:
            v *= self.unknown[0] * sqrt(2.0 * blind[0] + 1.0) / self.v.std
        return twist.v - v, found
