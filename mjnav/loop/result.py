"""Result of a run: its figures and its trajectory, and the figures as an HTML table for notebooks."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any

from mjnav.loop.pacer import Scheduling
from mjnav.loop.profile import Profile
from mjnav.messages import PHASES, Trajectory
from mjnav.metrics.own import Measured
from mjnav.metrics.social import Detour
from mjnav.metrics.summary import FIGURES, summarise
from mjnav.metrics.timing import compute_ms
from mjnav.robot.commands import Computed, LatencyModel, replayed
from mjnav.scene.spec import Scenario

# -------------------------------------------------------------------------------------------- table


# Figures of the table.
_ROWS = (
    *("time_s", "min_clearance_m", "min_human_distance_m", "path_length_m", "mean_deviation_m", "max_deviation_m"),
    *("control_cost", "localization_rmse_m", "tracking_rmse_m", "people_see_robot", "infeasible_ticks", "ticks"),
    "real_time_factor",
)


def result_table(summary: Mapping[str, Any]) -> str:
    """The table of a summary as `Result.summary` gives it; figures that are undefined are left out."""
    rows = (f"<tr><th scope='row'>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in _rows(summary))
    title = f"{summary['scene']}, {summary['controller']}, seed {summary['seed']}: {summary['outcome']}"
    return f"<table><caption>{escape(title)}</caption><tbody>{''.join(rows)}</tbody></table>"


def _rows(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "collisions", ", ".join(f"{n} × {kind}" for kind, n in summary["collisions"].items() if n) or "none"
    for key in _ROWS:
        value = summary[key]
        if value is not None:
            text = f"{value:.3g}" if isinstance(value, float) else str(value)
            yield FIGURES[key].words, f"{text} {FIGURES[key].unit}".rstrip()
    for name, value in summary["metrics"].items():
        if value is not None:
            yield name, f"{value:.4g}"
    if summary["log"]:
        yield "log", str(summary["log"])


# ------------------------------------------------------------------------------------------- result


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
        values = asdict(self)
        return {"schema": SCHEMA, **{key: values.pop(key) for key in ("scene", "controller", "seed")},
                **values.pop("figures"), **values}  # fmt: skip


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
    profile: Profile | None = None
    metrics: Measured = field(default_factory=Measured)

    @property
    def summary(self) -> dict[str, Any]:
        """What `mjnav run --json` prints: `result.summary["outcome"]`."""
        document = self.run.document()
        return document if self.profile is None else {**document, "profile": self.profile.document()}

    def __repr__(self) -> str:
        s = self.run
        clearance = s.figures["min_clearance_m"]
        nearest = "" if clearance is None else f", least clearance {clearance:.2f} m"
        ended = f"{s.figures['outcome']} after {s.figures['time_s']:.1f} s"
        return f"Result({s.scene!r}, {s.controller}, seed {s.seed}: {ended}{nearest}, {s.figures['ticks']} ticks)"

    def _repr_html_(self) -> str:
        """The figures as a table, as notebooks show it."""
        return result_table(self.summary)


def result_of(
    scenario: Scenario,
    trajectory: Trajectory,
    *,
    outcome: str | None,
    state_hash: str,
    latency: LatencyModel,
    metrics: Measured,
    seconds: float | None = None,
    deadline_misses: int = 0,
    log: Path | None = None,
    log_dropped: int = 0,
) -> Result:
    """How a run of `scenario` went, which took `seconds` on the wall; without them what its ticks took counts."""
    if seconds is None:
        seconds = 1e-9 * float(trajectory.timing[:, 1 : 1 + len(PHASES)].sum())
    summary = RunSummary(
        scene=scenario.name,
        controller=scenario.control.method,
        seed=scenario.seed,
        figures=summarise(trajectory, scenario, outcome=outcome),
        compute_ms=compute_ms(trajectory.timing),
        real_time_factor=float(trajectory.time[-1]) / seconds if seconds > 0.0 else None,
        deadline_misses=deadline_misses,
        state_hash=state_hash,
        log=str(log) if log else None,
        metrics=metrics.values,
    )
    return Result(summary, trajectory, _replay(scenario, latency), log_dropped=log_dropped, metrics=metrics)


def _replay(scenario: Scenario, latency: LatencyModel) -> Scenario:
    """The scenario with measured latencies written down."""
    control = scenario.control
    if control.latency is None or control.latency.model != "measured" or not isinstance(latency, Computed):
        return scenario
    return replace(scenario, control=replace(control, latency=replayed(control.latency, control.period, latency.trace)))
