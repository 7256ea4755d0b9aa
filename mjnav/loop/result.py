"""Result of a run: its figures and its trajectory, and the figures as an HTML table for notebooks."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from html import escape
from typing import Any

from mjnav.loop.pacer import Scheduling
from mjnav.messages import Trajectory
from mjnav.metrics.own import Measured
from mjnav.metrics.social import Detour
from mjnav.robot.latency import Computed, Latency, replayed
from mjnav.scene.spec import Scenario

SCHEMA = 1  # of the summary
NO_DETOUR = Detour()  # of a run for which nobody asked


@dataclass(frozen=True, slots=True)
class RunSummary:
    """A run's figures, with what they belong to and what they cost."""

    scene: str
    controller: str
    seed: int
    figures: Mapping[str, Any]  # by name, as `metrics.summary.summarise` gives them
    compute_ms: Mapping[str, Mapping[str, float | None]]  # phase -> p50, p99, max
    real_time_factor: float | None
    deadline_misses: int
    state_hash: str
    log: str | None
    metrics: Mapping[str, float | None]  # figures of the user's own metrics
    detour: Detour = NO_DETOUR  # what the robot cost the people, if it was asked for

    def document(self) -> dict[str, Any]:
        """What `mjnav run --json` prints and the log's metadata hold: one mapping, the figures among the rest."""
        values = {one.name: _copied(getattr(self, one.name)) for one in fields(self)}
        return {"schema": SCHEMA, **{key: values.pop(key) for key in ("scene", "controller", "seed")},
                **values.pop("figures"), **values}  # fmt: skip


def _copied(value: Any) -> Any:
    if isinstance(value, Detour):
        return asdict(value)
    return {key: _copied(one) for key, one in value.items()} if isinstance(value, Mapping) else value


@dataclass(frozen=True, slots=True)
class Result:
    """How a run went: `run` has its figures, `trajectory` is the arrays that they were computed from.

    `replay` is the scenario that ends in the same state hash: the run's own, except where latency was measured.
    `real_time` says what a paced run got from the operating system, `log_dropped` how many parts of ticks its log
    could not take in time, and `profile` where each tick's time went, if that was asked for; `metrics` are
    the figures of the user's own metrics with their units, and what was wrong with them.
    """

    run: RunSummary
    trajectory: Trajectory
    replay: Scenario
    real_time: Scheduling | None = None
    log_dropped: int = 0
    profile: Mapping[str, Any] | None = None  # of `pacer.profile_of`
    metrics: Measured = field(default_factory=Measured)

    @property
    def summary(self) -> dict[str, Any]:
        """What `mjnav run --json` prints: `result.summary["outcome"]`."""
        document = self.run.document()
        return document if self.profile is None else {**document, "profile": self.profile}

    def __repr__(self) -> str:
        s = self.run
        clearance = s.figures["min_clearance_m"]
        nearest = "" if clearance is None else f", least clearance {clearance:.2f} m"
        ended = f"{s.figures['outcome']} after {s.figures['time_s']:.1f} s"
        return f"Result({s.scene!r}, {s.controller}, seed {s.seed}: {ended}{nearest}, {s.figures['ticks']} ticks)"

    def _repr_html_(self) -> str:
        """The figures that are defined as a table, as notebooks show it."""
        figures = {key: value for key, value in self.summary.items() if isinstance(value, str | int | float)}
        texts = {key: f"{value:.4g}" if isinstance(value, float) else str(value) for key, value in figures.items()}
        rows = (f"<tr><th scope='row'>{key}</th><td>{escape(text)}</td></tr>" for key, text in texts.items())
        return f"<table><caption>{escape(repr(self))}</caption><tbody>{''.join(rows)}</tbody></table>"


def with_latencies(scenario: Scenario, latency: Latency) -> Scenario:
    """The scenario with the latencies of a run written down where they were measured: it repeats the run."""
    control = scenario.control
    if control.latency is None or control.latency.model != "measured" or not isinstance(latency, Computed):
        return scenario
    return replace(scenario, control=replace(control, latency=replayed(control.latency, control.period, latency.trace)))
