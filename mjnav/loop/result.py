"""How a run went."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from mjnav.loop.profile import Profile
from mjnav.loop.result_table import result_table
from mjnav.loop.scheduling import Scheduling
from mjnav.messages import Trajectory
from mjnav.metrics.summary import Figures
from mjnav.scenarios.spec import Scenario

SCHEMA = 1  # of the summary


@dataclass(frozen=True, slots=True)
class RunSummary:
    """A run's figures, with what they belong to and what they cost."""

    scene: str
    controller: str
    seed: int
    figures: Figures
    compute_ms: Mapping[str, Mapping[str, float | None]]  # phase -> p50, p99, max
    real_time_factor: float | None
    deadline_misses: int
    state_hash: str
    log: str | None

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
    could not take in time, and `profile` where each tick's time went, if that was asked for.
    """

    run: RunSummary
    trajectory: Trajectory
    replay: Scenario
    real_time: Scheduling | None = None
    log_dropped: int = 0
    profile: Profile | None = None

    @property
    def summary(self) -> dict[str, Any]:
        """What `mjnav run --json` prints: `result.summary["outcome"]`."""
        document = self.run.document()
        return document if self.profile is None else {**document, "profile": self.profile.document()}

    def __repr__(self) -> str:
        s = self.run
        clearance = s.figures.min_clearance_m
        nearest = "" if clearance is None else f", least clearance {clearance:.2f} m"
        return (
            f"Result({s.scene!r}, {s.controller}, seed {s.seed}: {s.figures.outcome} after {s.figures.time_s:.1f} s"
            f"{nearest}, {s.figures.ticks} ticks)"
        )

    def _repr_html_(self) -> str:
        """The figures as a table, as notebooks show it."""
        return result_table(self.summary)
