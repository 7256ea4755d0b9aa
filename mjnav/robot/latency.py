"""Commands as the robot knows them: past and pending ones, when they take effect, and where they move the robot.

A decision takes effect after whole periods, or when it has been computed. A controller decides for the moment at which
its decision is expected to take effect, and the plant switches when it does: at a step of the physics, anywhere within
a period or after it.

The robot's belief is carried through all commands still to take effect, to the moment at which a decision does. Between
the reading that a belief stands for and that moment, the robot does what is already under way: commands in force and
pending, each reached at the acceleration limits. Every robot sample goes its own way, with its own draws of the
actuation noise, which hold for a window each as they do in the world. People are carried by `mjnav.robot.prediction`.

Decisions that a caller gives to `Simulation.step`, or that a controller returns, are checked here.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array, CandidateCosts, Decision, PlanShown, RobotLimits, Status, number
from mjnav.motion.unicycle import integrate_rows, ramp_mean
from mjnav.noise import NOISE_WINDOW, Distribution
from mjnav.rng import stream
from mjnav.scene import spec

# ------------------------------------------------------------------------------- commands over time


ROUNDING = 1e-9  # [s] below which two moments are the same


@dataclass(frozen=True, slots=True)
class Stretch:
    """A command in force from `start` to `end` [s], with the set-point at which it found the robot."""

    start: float
    end: float
    set_point: Array  # (2,)
    command: Array  # (2,)


class CommandHistory:
    """Commands in order of time: each is in force until the next one's start, a zero command before the first."""

    def __init__(self, limits: RobotLimits):
        self._limits = limits
        self._starts = [0.0]
        self._commands = [np.zeros(2)]
        self._set_points = [np.zeros(2)]  # at the start of each command

    def append(self, start: float, command: Array) -> None:
        """One more command (2,), in force from `start` [s] on; no command overtakes the one before it."""
        duration, set_point = max(start - self._starts[-1], 0.0), self._set_points[-1]
        if duration > ROUNDING:
            _, set_point = ramp_mean(set_point, self._commands[-1], self._limits, duration)
        self._starts.append(max(start, self._starts[-1]))
        self._commands.append(command)
        self._set_points.append(set_point)

    def forget(self, before: float) -> None:
        """Drops the commands that are no longer in force at a moment [s]; earlier ones will not be asked for."""
        over = bisect_right(self._starts, before + ROUNDING) - 1
        if over > 0:
            del self._starts[:over], self._commands[:over], self._set_points[:over]

    def in_force(self, time: float) -> Array:
        """The command in force at a moment [s], (2,)."""
        return self._commands[bisect_right(self._starts, time + ROUNDING) - 1]

    def switches(self, start: float, end: float) -> list[tuple[float, Array]]:
        """The commands that take force between two moments [s], each with its offset from the first."""
        first = bisect_right(self._starts, start + ROUNDING)
        last = bisect_right(self._starts, end - ROUNDING)
        return [(self._starts[j] - start, self._commands[j]) for j in range(first, last)]

    def stretches(self, start: float, end: float) -> list[Stretch]:
        """The commands in force between two moments [s], in order."""
        found = []
        for j in range(bisect_right(self._starts, start + ROUNDING) - 1, len(self._starts)):
            if self._starts[j] >= end:
                break
            begin = max(start, self._starts[j])
            until = min(end, self._starts[j + 1]) if j + 1 < len(self._starts) else end
            if until - begin <= ROUNDING:
                continue
            before = self._set_points[j]
            if begin > self._starts[j] + ROUNDING:
                _, before = ramp_mean(before, self._commands[j], self._limits, begin - self._starts[j])
            found.append(Stretch(begin, until, before, self._commands[j]))
        return found


# ------------------------------------------------------------------------------------------ latency


class WholePeriods:
    """Decision k takes effect at (k + delay) T."""

    def __init__(self, period: float, delay: int):
        self._period, self._delay = period, delay

    def expected(self, tick: int) -> float:
        """When the prediction counts on the decision of a tick to take effect [s]."""
        return (tick + self._delay) * self._period

    def actual(self, tick: int, spent: float) -> float:
        """When it does [s]: then, whatever was `spent` on it."""
        return self.expected(tick)


class Computed:
    """Decision k takes effect at k T + tau_k, rounded up to a step.

    tau_k is the time spent on computing, or else one of `times`: drawn from them, or in their order without `rng`.
    """

    def __init__(
        self,
        period: float,
        timestep: float,
        planned: float,
        times: tuple[float, ...] = (),
        rng: np.random.Generator | None = None,
    ):
        self._period, self._timestep, self._planned, self._times, self._rng = period, timestep, planned, times, rng
        self.trace: list[float] = []  # tau_k [s]

    def expected(self, tick: int) -> float:
        """When the prediction counts on the decision of a tick to take effect [s]."""
        return tick * self._period + self._planned

    def actual(self, tick: int, spent: float) -> float:
        """When it does [s], where computing it took `spent` [s] of wall time. Called once a tick, in order."""
        self.trace.append(self._taken(tick, spent))
        steps = ceil(self.trace[-1] / self._timestep - 1e-6)
        return tick * self._period + steps * self._timestep

    def _taken(self, tick: int, spent: float) -> float:
        if not self._times:
            return spent
        return self._times[tick % len(self._times) if self._rng is None else self._rng.integers(len(self._times))]


Latency = WholePeriods | Computed


def make_latency(scenario: spec.Scenario, seed: int) -> Latency:
    """The scenario's model."""
    control, timestep = scenario.control, scenario.physics.timestep
    latency = control.latency
    if latency is None:
        return WholePeriods(control.period, control.delay)
    planned = latency.expected(control.period)
    if latency.model == "measured":
        return Computed(control.period, timestep, planned)
    rng = None if latency.order == "recorded" else stream(seed, "latency")
    return Computed(control.period, timestep, planned, latency.trace, rng)


def replayed(latency: spec.Latency, period: float, trace: list[float]) -> spec.Latency:
    """The latency that repeats a measured run: its own times in their order."""
    return spec.Latency("sampled", tuple(trace), "recorded", latency.expected(period))


# -------------------------------------------------------------------------- prediction of the robot


class RobotPrediction:
    """Carries samples; its draws come from streams of its own."""

    def __init__(self, noise: Mapping[str, Distribution], limits: RobotLimits, seed: int):
        channels = ("actuation.v", "actuation.omega")
        self._limits = limits
        self._noise = [(noise[channel], stream(seed, "prediction", channel)) for channel in channels]

    def robot(self, pose: Array, start: float, end: float, stretches: Sequence[Stretch]) -> tuple[Array, Array]:
        """Poses (N, 3) at `end` from poses (N, 3) at `start`, and the actuation noise in force at `end`, (N, 2)."""
        first = _window(start)
        windows = _window(end) - first + 1
        v, omega = [channel.sample(rng, (windows, len(pose))) for channel, rng in self._noise]
        for stretch in stretches:
            begin, before = stretch.start, stretch.set_point
            while stretch.end - begin > ROUNDING:
                window = _window(begin)
                until = min(stretch.end, (window + 1) * NOISE_WINDOW)
                mean, before = ramp_mean(before, stretch.command, self._limits, until - begin)
                i = window - first
                pose = integrate_rows(pose, mean[0] + v[i], mean[1] + omega[i], until - begin)
                begin = until
        return pose, np.array([v[-1], omega[-1]]).T.copy()


def _window(time: float) -> int:
    """Index of the noise window that holds at `time` [s]."""
    return floor((time + ROUNDING) / NOISE_WINDOW)


# ------------------------------------------------------------------------------- decisions as given


def given_decision(v: float | Decision, omega: float | None) -> Decision:
    """A decision as it is, or one for the command v [m/s], omega [rad/s].

    Raises InvalidValue for a number that is not finite, is missing or is too much.
    """
    if not isinstance(v, Decision):
        return Decision(number("v", v, "m/s"), number("omega", omega, "rad/s"), Status.OK)
    if omega is not None:
        raise InvalidValue("omega", omega, "nothing beside a decision")
    return v


def check_decision(decision: Decision) -> None:
    """Raises InvalidValue where the command is not finite or another part is of another type."""
    number("v", decision.v, "m/s")
    number("omega", decision.omega, "rad/s")
    if not isinstance(decision.status, Status):
        raise InvalidValue("status", decision.status, f"a Status: {', '.join(Status.__members__)}")
    for key, kind in (("costs", CandidateCosts), ("plan", PlanShown)):
        if not isinstance(getattr(decision, key), kind | None):
            raise InvalidValue(key, getattr(decision, key), f"{kind.__name__} or None")
