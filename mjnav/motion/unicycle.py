"""The unicycle, x' = v cos(theta), y' = v sin(theta), theta' = omega, and the differential drive that moves so.

`integrate` takes arrays and needs no compiler: reading a log uses it. `integrate_rows` is compiled and takes one row a
sample: particles and robot samples move by it at every tick.

The differential drive has the base's dimensions and the limits of a command.
"""

from dataclasses import dataclass
from math import copysign, cos, pi, sin
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, Vector, kernel, scalar
from mjnav.geometry.angles import wrap, wrapped
from mjnav.messages import TRACK_WIDTH, Array, RobotLimits

# --------------------------------------------------------------------------------------------- arrays


def integrate(pose: ArrayLike, v: ArrayLike, omega: ArrayLike, duration: float) -> Array:
    """The pose after `duration` [s] of constant (v, omega): the exact arc, (..., 3).

    With h = omega T / 2, the chord has length v T sin(h)/h and direction theta + h.
    """
    pose = np.asarray(pose, float)
    if pose.ndim == 1 and np.ndim(v) == np.ndim(omega) == 0:  # the same bits as below in a fifth of the time
        x, y, heading = pose.tolist()
        half = 0.5 * duration * float(omega)  # type: ignore[arg-type]
        turn = pi * (half / pi)
        chord = duration * float(v) * (float(np.sin(turn)) / turn if turn else 1.0)  # type: ignore[arg-type]
        heading += half
        return np.array([x + chord * float(np.cos(heading)), y + chord * float(np.sin(heading)), wrap(heading + half)])
    half = 0.5 * duration * np.asarray(omega, float)
    chord = duration * np.asarray(v, float) * np.sinc(half / np.pi)
    heading = pose[..., 2] + half
    return np.stack(
        [pose[..., 0] + chord * np.cos(heading), pose[..., 1] + chord * np.sin(heading), wrap(heading + half)], axis=-1
    )


# ------------------------------------------------------------------------------------------- compiled


_SMALL = 0.25  # of h, below which the series of sin(h)/h and cos(h) are exact to 2e-17


@scalar
def _sinc(h):
    """sin(h)/h."""
    if abs(h) < _SMALL:
        q = h * h
        return 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0))))
    return sin(h) / h


@scalar
def _cosine(h):
    """cos(h)."""
    if abs(h) < _SMALL:
        q = h * h
        r = 1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0))
        return 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * r))
    return cos(h)


@kernel
def arc_onward(x, y, c, s, half, way):
    """Where an arc of length `way` [m] that turns by twice `half` [rad] ends, from (x, y) in the direction (c, s).

    A direction is the cosine and the sine of a heading. To turn it takes less time than to compute it anew.
    """
    by_s, by_c = half * _sinc(half), _cosine(half)
    c, s = c * by_c - s * by_s, s * by_c + c * by_s
    chord = way * _sinc(half)
    return x + chord * c, y + chord * s, c * by_c - s * by_s, s * by_c + c * by_s


@kernel
def arc(x, y, heading, v, omega, duration):
    """The pose after `duration` [s], negative for the pose before, of constant v [m/s] and omega [rad/s]."""
    half = 0.5 * duration * omega
    chord = duration * v * _sinc(half)
    return x + chord * cos(heading + half), y + chord * sin(heading + half), wrapped(heading + 2.0 * half)


@kernel
def integrate_rows(pose: Matrix, v: Vector, omega: Vector, duration: float):
    """Poses (n, 3) after `duration` [s] of constant v (n,) [m/s] and omega (n,) [rad/s], a new (n, 3).

    With h = omega T / 2, the chord has length v T sin(h)/h and direction theta + h.
    """
    moved = np.empty(pose.shape)
    for i in range(len(pose)):
        half = 0.5 * duration * omega[i]
        chord = duration * v[i] * _sinc(half)
        heading = pose[i, 2] + half
        moved[i, 0] = pose[i, 0] + chord * cos(heading)
        moved[i, 1] = pose[i, 1] + chord * sin(heading)
        moved[i, 2] = wrapped(heading + half)
    return moved


# --------------------------------------------------------------------------------- differential drive


Speed = TypeVar("Speed", float, Array)
WHEEL_RADIUS = 0.05  # [m]


@dataclass(frozen=True, slots=True)
class Drive:
    """Two wheels, or two sides of wheels; by default those of mjnav's own robot."""

    wheel_radius: float = WHEEL_RADIUS  # [m]
    track_width: float = TRACK_WIDTH  # [m] that counts in turns: more than it measures where wheels skid

    def wheel_speeds(self, v: Speed, omega: Speed) -> tuple[Speed, Speed]:
        """Left and right wheel speed [rad/s] for (v [m/s], omega [rad/s]), numbers or arrays."""
        across = 0.5 * self.track_width * omega
        return (v - across) / self.wheel_radius, (v + across) / self.wheel_radius

    def twist(self, left: Speed, right: Speed) -> tuple[Speed, Speed]:
        """(v, omega) for the wheel speeds [rad/s]: the inverse of `wheel_speeds`."""
        return 0.5 * self.wheel_radius * (left + right), self.wheel_radius * (right - left) / self.track_width


def command_bounds(limits: RobotLimits) -> tuple[Array, Array]:
    """Lowest and highest (v, omega) that the base takes as a command; each (2,).

    A base may always stop, even where the planner has a minimum speed.
    """
    low = np.array([min(limits.min_speed, 0.0), -limits.max_turn_rate])
    return low, np.array([max(limits.max_speed, 0.0), limits.max_turn_rate])


def control_bounds(limits: RobotLimits) -> tuple[Array, Array]:
    """Lowest and highest (v, omega) that a planner chooses; each (2,)."""
    low = np.array([limits.min_speed, -limits.max_turn_rate])
    return low, np.array([limits.max_speed, limits.max_turn_rate])


def reachable(twist: ArrayLike, limits: RobotLimits, duration: float) -> tuple[Array, Array]:
    """Lowest and highest (v, omega) that can be reached from `twist` within `duration`; each (2,).

    [max(lower, u - a T), min(upper, u + a T)] of either component, u first brought within its bounds.
    """
    v, omega = np.asarray(twist, float).tolist()
    v_low, v_high = _reachable(v, limits.min_speed, limits.max_speed, limits.max_acceleration * duration)
    turn = limits.max_turn_rate
    omega_low, omega_high = _reachable(omega, -turn, turn, limits.max_turn_acceleration * duration)
    return np.array([v_low, omega_low]), np.array([v_high, omega_high])


def _reachable(u: float, lower: float, upper: float, change: float) -> tuple[float, float]:
    """`reachable` of one component; NaN stays NaN."""
    u = min(max(u, lower), upper)
    return max(u - change, lower), min(u + change, upper)


def ramp_mean(before: ArrayLike, command: ArrayLike, limits: RobotLimits, duration: float) -> tuple[Array, Array]:
    """Mean and final set-point over `duration` while it moves from `before` to `command` at the acceleration limits.

    Each is (2,). With D = command - before and a the limit, the ramp lasts t = min(|D|/a, T), ends at
    before + sign(D) a t and has the mean  end - sign(D) a t^2 / (2 T).
    """
    v, omega = np.asarray(before, float).tolist()  # plain numbers: eight array operations on two would cost five times
    to_v, to_omega = np.asarray(command, float).tolist()
    mean_v, end_v = _ramp(v, to_v, limits.max_acceleration, duration)
    mean_omega, end_omega = _ramp(omega, to_omega, limits.max_turn_acceleration, duration)
    return np.array([mean_v, mean_omega]), np.array([end_v, end_omega])


def _ramp(before: float, command: float, limit: float, duration: float) -> tuple[float, float]:
    """`ramp_mean` of one component."""
    change = command - before
    ramp = min(abs(change) / limit, duration)
    slope = copysign(limit, change)
    end = command if abs(change) <= limit * duration else before + slope * ramp
    return end - slope * (ramp * ramp) / (2.0 * duration), end
