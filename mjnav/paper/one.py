"""One obstacle: RKHS against the linearised Gaussian and the moment surrogate, and whether a nominal control exists."""

from collections.abc import Iterator

import numpy as np

from mjnav.messages import Array
from mjnav.metrics.intervals import wilson
from mjnav.paper.contrast import Cells, Contrast, by_place, claim, contrasts
from mjnav.paper.finding import LEAST_PAIRS, Claim, Finding, Measured, judge
from mjnav.study.compare.compare import CellRows, common, paired

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
    """The measures, and what the moment surrogate's eta does to its feasibility."""
    return judge([*_measures(cells), _feasibility(cells), _nominal(cells)])


def _measures(cells: Cells) -> Iterator[Claim]:
    for rival in ("gaussian-linearised", moments(TUNED_ETA)):
        for figure, what, unit in MEASURES:
            for method in RKHS:
                text = f"{method} takes {what} than {rival}"
                yield claim(text, SOURCE, contrasts(cells, method, rival, figure), -1, unit)


def _feasibility(cells: Cells) -> Claim:
    by_eta = {eta: by_place(cells, moments(eta)) for eta in ETAS}
    low, high = by_eta[ETAS[0]], by_eta[ETAS[-1]]
    tests = []
    for where in dict.fromkeys(where for places in by_eta.values() for where in places):
        text = ", ".join(
            f"{eta:g}: {_percent(tick_share(places[where], 'ticks_without_own'))}"
            for eta, places in by_eta.items()
            if where in places
        )
        change = np.empty(0)
        if where in low and where in high:
            here, there = common(high[where], low[where])
            change = _shares(high[where])[here] - _shares(low[where])[there]
        contrast = Contrast(f"{where}: share of ticks by eta {text}; from the least to the most", paired(change))
        tests.append(contrast.measured(+1))
    text = "The moment surrogate finds nothing that meets its constraint the more often, the higher the eta it asks for"
    return Claim(text, SOURCE, tests)


def tick_share(cell: CellRows, column: str) -> float:
    """The share of all ticks of a cell that `column` counts; NaN without ticks."""
    ticks = np.nansum(cell.columns["ticks"])
    return float(np.nansum(cell.columns[column]) / ticks) if ticks else np.nan


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if np.isfinite(share) else "no result"


def _shares(cell: CellRows) -> Array:
    return cell.columns["ticks_without_own"] / cell.columns["ticks"]


def _nominal(cells: Cells) -> Claim:
    """Assumption 1: some control meets the constraints at the mean. One counterexample refutes it, without a doubt."""
    tests = []
    for where, cell in by_place(cells, "rkhs d=1").items():
        always = cell.columns["ticks_without_nominal"][~cell.failed] == 0
        interval = wilson(int(always.sum()), always.size)
        if interval is None:
            tests.append(Measured(False, None, f"{where}: no episode has a result"))
            continue
        low, high = (100.0 * end for end in interval)
        line = (
            f"{where}: at every tick in {100.0 * always.mean():.1f} % [{low:.1f}, {high:.1f}] of {always.size} runs; "
            f"missing at {100.0 * tick_share(cell, 'ticks_without_nominal'):.2f} % of ticks"
        )
        tests.append(Measured(bool(always.all()), 0.0 if always.size >= LEAST_PAIRS else None, line))
    return Claim("A nominal control always exists", "assumption 1", tests)
