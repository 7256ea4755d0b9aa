"""The table: d = 1 is said to pass between its legs, d = 3 to go around."""

import numpy as np

from mjnav.messages import Array
from mjnav.metrics.intervals import mcnemar, wilson
from mjnav.paper.contrast import Cells, by_place
from mjnav.paper.finding import LEAST_PAIRS, Claim, Finding, Measured, judge
from mjnav.study.compare.compare import CellRows

STUDIES = ("paper-table",)
SOURCE = "the table figure"
HALF_WIDTH = 0.75  # [m] from the way to a leg: who leaves the way by more went around


def between_legs(cell: CellRows) -> Array:
    """Of the runs that reached the goal without contact, which went between the legs; (n,) of 0 and 1."""
    deviation = cell.values("max_deviation_m")
    return (deviation[np.isfinite(deviation)] < HALF_WIDTH).astype(float)


def findings(cells: Cells) -> tuple[Finding, ...]:
    """The share of runs that took the way that the paper shows, above one half or not."""
    found = []
    for method, way in (("d=1", "between the legs"), ("d=1 matched", "between the legs"), ("d=3", "around")):
        tests = []
        for where, cell in by_place(cells, method).items():
            between = between_legs(cell)
            took = between if way == "between the legs" else 1.0 - between
            interval = wilson(int(took.sum()), took.size)
            failed = int(cell.failed.sum())
            lost = f"{len(cell.seeds) - took.size - failed} more did not reach the goal unharmed" + (
                f", {failed} episodes failed" if failed else ""
            )
            if interval is None:
                tests.append(Measured(False, None, f"{where}: no run reached the goal without contact, {lost}"))
                continue
            low, high = (100.0 * end for end in interval)
            line = f"{where}: {100.0 * took.mean():.1f} % [{low:.1f}, {high:.1f}] of {took.size} runs, {lost}"
            # The exact binomial test of one half.
            p = mcnemar(int(took.sum()), int(took.size - took.sum())) if took.size >= LEAST_PAIRS else None
            tests.append(Measured(bool(took.mean() > 0.5), p, line))
        name = {"d=1": "Degree 1", "d=3": "Degree 3", "d=1 matched": "Degree 1, as heavy as degree 3,"}[method]
        found.append(Claim(f"{name} goes {way} in most runs", SOURCE, tests))
    return judge(found)
