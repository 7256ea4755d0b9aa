"""When a decision takes effect: after whole periods, or when it has been computed.

A controller decides for the moment at which its decision is expected to take effect, and the plant switches when it
does: at a step of the physics, anywhere within a period or after it.
"""

from math import ceil
from typing import Protocol

import numpy as np

from mjnav.rng import stream
from mjnav.scenarios.spec import Latency, Scenario


class LatencyModel(Protocol):
    """Moments of effect of the decision of each tick, in simulated time [s]."""

    def expected(self, tick: int) -> float:
        """What the prediction counts on."""
        ...

    def actual(self, tick: int, spent: float) -> float:
        """What happens, where computing took `spent` [s] of wall time. Called once a tick, in order."""
        ...


class WholePeriods:
    """Decision k takes effect at (k + delay) T."""

    def __init__(self, period: float, delay: int):
        self._period, self._delay = period, delay

    def expected(self, tick: int) -> float:
        """See `LatencyModel`."""
        return (tick + self._delay) * self._period

    def actual(self, tick: int, spent: float) -> float:
        """See `LatencyModel`; `spent` does not count."""
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
        """See `LatencyModel`."""
        return tick * self._period + self._planned

    def actual(self, tick: int, spent: float) -> float:
        """See `LatencyModel`."""
        self.trace.append(self._taken(tick, spent))
        steps = ceil(self.trace[-1] / self._timestep - 1e-6)
        return tick * self._period + steps * self._timestep

    def _taken(self, tick: int, spent: float) -> float:
        if not self._times:
            return spent
        return self._times[tick % len(self._times) if self._rng is None else self._rng.integers(len(self._times))]


def make_latency(scenario: Scenario, seed: int) -> WholePeriods | Computed:
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


def replayed(latency: Latency, period: float, trace: list[float]) -> Latency:
    """The latency that repeats a measured run: its own times in their order."""
    return Latency("sampled", tuple(trace), "recorded", latency.expected(period))
