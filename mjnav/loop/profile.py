"""Where a run's microseconds go: the spans that the loop's own stopwatch times, over all ticks.

What happens inside a span is a matter for a profiler of programs: `python -m cProfile -m mjnav.cli.main run SCENE`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mjnav.loop.pacer import BETWEEN, SPANS
from mjnav.messages import PHASES, Array


@dataclass(frozen=True, slots=True)
class Duration:
    """What one span or phase took of every tick [us], and its share of all ticks' time."""

    p50: float
    p99: float
    mean: float
    share: float


@dataclass(frozen=True, slots=True)
class PhaseTime(Duration):
    """A phase; `parts` are its spans where it has more than one."""

    parts: Mapping[str, Duration] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Profile:
    """Every phase of every tick; without ticks there are no figures."""

    ticks: int
    tick: Duration | None
    phases: Mapping[str, PhaseTime]

    @classmethod
    def of(cls, ticks: Sequence[Mapping[str, int]]) -> "Profile":
        """From the spans [ns] of every tick, as `Stopwatch.spans` has them."""
        if not ticks:
            return cls(0, None, {})
        spans = {name: np.array([tick.get(name, 0) for tick in ticks], float) for name in (*SPANS, BETWEEN)}
        whole = np.sum(list(spans.values()), axis=0)
        phases = {}
        for phase in (*PHASES, BETWEEN):
            own = {name: taken for name, taken in spans.items() if SPANS.get(name, BETWEEN) == phase}
            parts = {name: Duration(*_figures(taken, whole)) for name, taken in own.items()} if len(own) > 1 else {}
            phases[phase] = PhaseTime(*_figures(np.sum(list(own.values()), axis=0), whole), parts)
        return cls(len(ticks), Duration(*_figures(whole, whole)), phases)

    def document(self) -> dict[str, Any]:
        """{"ticks", "tick_us", "phases": {phase: {"p50", "p99", "mean", "share", "parts"}}}; times in us."""
        found = asdict(self)
        tick = found.pop("tick")
        if tick is not None:
            del tick["share"]
        return {"ticks": self.ticks, "tick_us": tick, "phases": found["phases"]}

    def table(self) -> str:
        """The figures as a table for people."""
        lines = [f"{'us a tick':20s}{'p50':>9s}{'p99':>9s}{'mean':>9s}{'share':>8s}"]
        for name, phase in self.phases.items():
            lines += [_row(name, phase), *(_row(f"  {part}", taken) for part, taken in phase.parts.items())]
        return "\n".join(lines if self.tick is None else [*lines, _row("tick", self.tick)])


def _figures(taken: Array, whole: Array) -> tuple[float, float, float, float]:
    p50, p99 = (1e-3 * np.quantile(taken, (0.5, 0.99))).tolist()
    return p50, p99, 1e-3 * float(taken.mean()), float(taken.sum() / whole.sum()) if whole.any() else 0.0


def _row(name: str, taken: Duration) -> str:
    return f"{name:20s}{taken.p50:9.1f}{taken.p99:9.1f}{taken.mean:9.1f}{100.0 * taken.share:7.1f}%"
