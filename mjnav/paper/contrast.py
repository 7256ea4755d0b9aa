"""One method against another in every setting of a study: the evidence for or against a claim."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array
from mjnav.metrics.intervals import SharedBootstrap, paired_bootstrap
from mjnav.paper.item import LEAST_PAIRS, Cells, Claim, Measured
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import Difference, Estimate, difference, estimate, paired

LEAST_RUNS = 5  # of a measurement; fewer make no interval


@dataclass(frozen=True, slots=True)
class Contrast:
    """A difference in one scene and setting."""

    where: str
    difference: Difference

    def measured(self, sign: int, unit: str = "") -> Measured:
        """The claim that the difference has this sign; fewer than LEAST_PAIRS pairs decide nothing."""
        e, p = self.difference.estimate, self.difference.p
        line = f"{self.where}: {shown(e, unit, signed=True)}"
        return Measured(sign * e.value > 0.0, p if e.num >= LEAST_PAIRS else None, line)


def undefined(where: str) -> Contrast:
    """A place without any pair."""
    return Contrast(where, paired(np.empty(0)))


def contrasts(cells: Cells, method: str, reference: str, figure: str) -> list[Contrast]:
    """`figure` of method - reference on common seeds, in every scene and setting that has either."""
    ours, theirs = by_place(cells, method), by_place(cells, reference)
    return [
        Contrast(where, difference(ours[where], theirs[where], figure))
        if where in ours and where in theirs
        else undefined(where)
        for where in dict.fromkeys((*theirs, *ours))
    ]


def claim(text: str, source: str, found: Sequence[Contrast], sign: int, unit: str = "") -> Claim:
    """That all these differences have this sign."""
    return Claim(text, source, [contrast.measured(sign, unit) for contrast in found])


def by_place(cells: Cells, method: str) -> dict[str, CellRows]:
    """The cells of a method by scene and setting."""
    return {place(cell.scene, cell.setting): cell for cell in cells if cell.method == method}


def values(cells: Cells, method: str, figure: str) -> dict[str, Estimate]:
    """The method's own figure in every scene and setting."""
    return {where: estimate(cell, figure) for where, cell in by_place(cells, method).items()}


def place(scene: str, setting: str) -> str:
    """A scene and setting in a few words."""
    return f"{scene}, {short(setting)}"


def short(setting: str) -> str:
    """A setting without the names of the keys: direct, kinematic pearson."""
    return " ".join(word.rpartition("=")[2] for word in setting.split(" "))


def shown(e: Estimate, unit: str = "", *, signed: bool = False, digits: int = 3) -> str:
    """A figure with its interval and number of seeds."""
    sign = "+" if signed else ""
    if not np.isfinite(e.value):
        return f"undefined (n = {e.num})"
    text = f"{e.value:{sign}.{digits}g}{unit and ' ' + unit}"
    if e.interval is not None:
        text += f" [{e.interval[0]:{sign}.{digits}g}, {e.interval[1]:{sign}.{digits}g}]"
    return f"{text} (n = {e.num})"


def bootstrap_p(resampled: Array, boundary: float = 0.0) -> float:
    """Of the figure being the boundary: how often its resamples (n,) lie on the rarer side of it, twice.

    An interval of level 1 - p just reaches the boundary.
    """
    opposite = min((resampled <= boundary).sum(), (resampled >= boundary).sum())
    return min(1.0, 2.0 * float(1 + opposite) / (1 + resampled.size))


def mean_by_run(run: ArrayLike, values: ArrayLike, seed: int, use: str, *, boundary: float = 0.0) -> Difference:
    """The mean over runs of each run's mean of `values` (n,), of runs `run` (n,), with its 95 % interval.

    Decisions of one run resemble one another, so whole runs are resampled. The p-value, of sign flips, is that of the
    mean being the boundary; below LEAST_RUNS runs there is none. The seed and the use determine the draws.
    """
    run, values = np.asarray(run), np.asarray(values, float)
    means = np.array([values[run == one].mean() for one in np.unique(run)])
    interval, p = None, None
    if len(means) >= LEAST_RUNS:
        interval = paired_bootstrap(means, np.zeros_like(means), stream(seed, f"paper.{use}.bootstrap"))
        (p,) = SharedBootstrap(len(means), stream(seed, f"paper.{use}.flips")).p_values((means - boundary)[None])
    return Difference(Estimate(float(means.mean()), interval, len(means)), p)
