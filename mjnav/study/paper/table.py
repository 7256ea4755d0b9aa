"""The table: d = 1 is said to pass between its legs, d = 3 to go around."""

import numpy as np

from mjnav.messages import Array
from mjnav.metrics.intervals import wilson
from mjnav.study.compare import CellRows
from mjnav.study.paper.contrast import LEAST_PAIRS, Cells, by_place, overall
from mjnav.study.paper.finding import Finding, Verdict

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
        verdicts, lines = [], []
        for where, cell in by_place(cells, method).items():
            between = between_legs(cell)
            took = between if way == "between the legs" else 1.0 - between
            interval = wilson(int(took.sum()), took.size)
            lost = len(cell.seeds) - took.size
            if interval is None:
                verdicts.append(Verdict.OPEN)
                lines.append(f"{where}: none of {lost} runs reached the goal without contact")
                continue
            decided = took.size >= LEAST_PAIRS and not interval[0] <= 0.5 <= interval[1]
            verdicts.append(Verdict.OPEN if not decided else Verdict.HOLDS if interval[0] > 0.5 else Verdict.FAILS)
            low, high = (100.0 * end for end in interval)
            lines.append(
                f"{where}: {100.0 * took.mean():.1f} % [{low:.1f}, {high:.1f}] of {took.size} runs, "
                f"{lost} more did not reach the goal unharmed"
            )
        name = {"d=1": "Degree 1", "d=3": "Degree 3", "d=1 matched": "Degree 1, as heavy as degree 3,"}[method]
        found.append(Finding(f"{name} goes {way} in most runs", SOURCE, overall(verdicts), "\n".join(lines)))
    return tuple(found)
