"""One obstacle: RKHS against the linearised Gaussian and the moment surrogate, and whether a nominal control exists."""

from collections.abc import Iterator

import numpy as np

from mjnav.metrics.intervals import wilson
from mjnav.study.paper.contrast import LEAST_PAIRS, Cells, by_place, contrasts, overall, shown, summary, values
from mjnav.study.paper.finding import Finding, Verdict

STUDIES = ("paper-one",)
SOURCE = "the comparison with one obstacle"
MEASURES = (  # of which less is better
    ("control_cost", "less control cost", "m²/s³"),
    ("mean_deviation_m", "less deviation from the way", "m"),
    ("path_ratio", "a shorter way", ""),
    ("time_to_avoid_s", "less time to avoid", "s"),
)
RKHS = ("rkhs d=1", "rkhs d=2", "rkhs d=3")
ETAS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
TUNED_ETA = 0.7  # by paper-tuning


def moments(eta: float) -> str:
    """The label of the moment surrogate at this probability."""
    return f"gaussian-moments eta={eta}"


def findings(cells: Cells) -> tuple[Finding, ...]:
    """The three measures, and what the moment surrogate's eta does to its feasibility."""
    return (*_measures(cells), *_feasibility(cells), _nominal(cells))


def _measures(cells: Cells) -> Iterator[Finding]:
    for rival in ("gaussian-linearised", moments(TUNED_ETA)):
        for figure, claim, unit in MEASURES:
            for method in RKHS:
                verdict, evidence = summary(contrasts(cells, method, rival, figure), -1, unit)
                yield Finding(f"{method} takes {claim} than {rival}", SOURCE, verdict, evidence)


def _feasibility(cells: Cells) -> Iterator[Finding]:
    low, high = by_place(cells, moments(ETAS[0])), by_place(cells, moments(ETAS[-1]))
    verdicts, lines = [], []
    for where in low:
        shares = [by_place(cells, moments(eta))[where] for eta in ETAS]
        text = ", ".join(
            f"{eta:g}: {100.0 * cell.columns['ticks_without_own'].sum() / cell.columns['ticks'].sum():.1f} %"
            for eta, cell in zip(ETAS, shares, strict=True)
        )
        change = _share(high[where]) - _share(low[where])
        change = change[np.isfinite(change)]
        error = 1.96 * change.std(ddof=1) / np.sqrt(change.size) if change.size > 1 else np.inf
        decided = change.size >= LEAST_PAIRS and abs(change.mean()) > error
        verdicts.append(Verdict.OPEN if not decided else Verdict.HOLDS if change.mean() > 0 else Verdict.FAILS)
        lines.append(f"{where}: {text}")
    claim = (
        "The moment surrogate finds nothing that meets its constraint the more often, the higher the eta it asks for"
    )
    yield Finding(claim, SOURCE, overall(verdicts), "Share of ticks by eta\n" + "\n".join(lines))


def _share(cell) -> np.ndarray:
    return cell.columns["ticks_without_own"] / cell.columns["ticks"]


def _nominal(cells: Cells) -> Finding:
    """Assumption 1: some control meets the constraints at the mean."""
    verdicts, lines = [], []
    for where, cell in by_place(cells, "rkhs d=1").items():
        always = cell.columns["ticks_without_nominal"] == 0
        interval = wilson(int(always.sum()), always.size)
        assert interval is not None
        share = cell.columns["ticks_without_nominal"].sum() / cell.columns["ticks"].sum()
        enough = always.size >= LEAST_PAIRS
        verdicts.append(Verdict.OPEN if not enough else Verdict.HOLDS if always.all() else Verdict.FAILS)
        low, high = (100.0 * end for end in interval)
        lines.append(
            f"{where}: at every tick in {100.0 * always.mean():.1f} % [{low:.1f}, {high:.1f}] of {always.size} runs; "
            f"missing at {100.0 * share:.2f} % of ticks"
        )
    return Finding("A nominal control always exists", "assumption 1", overall(verdicts), "\n".join(lines))


def collisions(cells: Cells, method: str) -> str:
    """How often a method collided, in every setting."""
    return "; ".join(f"{where}: {shown(rate)}" for where, rate in values(cells, method, "collision").items())
