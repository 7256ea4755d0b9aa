"""Every method over its own weight or probability: at equal clearance, who needs less control and leaves the way less?

One operating point proves nothing: a method that costs less may only be bolder. So each method's curve of mean cost
over mean clearance is read off, by linear interpolation, at the clearance in the middle of what both curves cover.
Resampling the seeds resamples both curves.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from mjnav.messages import Array
from mjnav.paper.contrast import Cells, Contrast, claim, short
from mjnav.paper.finding import Finding, judge
from mjnav.rng import stream
from mjnav.study.compare.compare import CellRows, Difference, Estimate, paired

STUDIES = ("paper-pareto",)
SOURCE = "what one operating point cannot show"
METHODS = ("rkhs d=1", "rkhs d=2", "rkhs d=3", "gaussian-linearised", "gaussian-moments", "kld", "saa")
PAIRS = (
    ("rkhs d=1", "gaussian-linearised"),
    ("rkhs d=3", "gaussian-linearised"),
    ("rkhs d=1", "gaussian-moments"),
    ("rkhs d=3", "gaussian-moments"),
    ("rkhs d=1", "saa"),
    ("rkhs d=1", "kld"),
    ("rkhs d=3", "rkhs d=1"),
)
RESAMPLES = 5_000  # so that the least p-value survives the correction


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Cost and deviation at equal clearance, for pairs of methods."""
    found = []
    for figure, what, unit in (("control_cost", "less control", "m²/s³"), ("mean_deviation_m", "less deviation", "m")):
        for method, rival in PAIRS:
            contrasts = []
            for setting in settings(cells):
                contrasts += _at_equal_clearance(cells, setting, method, rival, figure)
            text = f"At equal clearance, {method} takes {what} than {rival}"
            found.append(claim(text, SOURCE, contrasts, -1, unit))
    return judge(found)


def settings(cells: Cells) -> list[str]:
    """The settings, in the study's order."""
    return list(dict.fromkeys(cell.setting for cell in cells))


def curve(cells: Cells, setting: str, method: str) -> list[CellRows]:
    """The cells of one method in one setting, over its own parameter."""
    return [cell for cell in cells if cell.setting == setting and cell.method.startswith(f"{method} ")]


def _at_equal_clearance(cells: Cells, setting: str, method: str, rival: str, figure: str) -> Iterator[Contrast]:
    ours, theirs, where = curve(cells, setting, method), curve(cells, setting, rival), short(setting)
    seeds = (
        sorted(set.intersection(*(set(cell.seeds.tolist()) for cell in (*ours, *theirs)))) if ours and theirs else []
    )
    if not seeds:
        yield Contrast(where, paired(np.empty(0)))
        return
    rng = stream(0, "paper.pareto", setting)
    # How often each resample has each seed; the first has each once.
    drawn = rng.multinomial(len(seeds), np.full(len(seeds), 1.0 / len(seeds)), RESAMPLES)
    counts = np.vstack([np.ones(len(seeds)), drawn]).astype(float)
    a, b = (_points(curve_cells, seeds, figure, counts) for curve_cells in (ours, theirs))
    known = [points[0, np.isfinite(points[0]).all(1), 0] for points in (a, b)]
    low, high = max(x.min(initial=np.inf) for x in known), min(x.max(initial=-np.inf) for x in known)
    if not (low < high and all(x.size for x in known)):
        yield Contrast(f"{where}, no clearance in common", paired(np.empty(0)))
        return
    at = 0.5 * (low + high)
    change = np.array([_read_off(x, at) - _read_off(y, at) for x, y in zip(a, b, strict=True)])
    resampled = change[1:][np.isfinite(change[1:])]
    least, most = np.quantile(resampled, [0.025, 0.975]).tolist()
    # How often resamples lie on the rarer side of 0: an interval of level 1 - p just reaches it.
    opposite = min((resampled <= 0.0).sum(), (resampled >= 0.0).sum())
    p = min(1.0, 2.0 * float(1 + opposite) / (1 + resampled.size))
    counted = [int(np.isfinite(cell.values(figure)[np.isin(cell.seeds, seeds)]).sum()) for cell in (*ours, *theirs)]
    estimate = Estimate(float(change[0]), (least, most), min(filter(None, counted)))
    yield Contrast(f"{where}, at {at:.2f} m", Difference(estimate, p))


def _points(cells: Sequence[CellRows], seeds: list[int], figure: str, counts: Array) -> Array:
    """Mean clearance and mean figure of every cell under every resample, (R, K, 2)."""
    points = np.empty((len(counts), len(cells), 2))
    for k, cell in enumerate(cells):
        at = np.isin(cell.seeds, seeds)
        for i, name in enumerate(("min_clearance_m", figure)):
            values = cell.values(name)[at]
            known = np.isfinite(values)
            sums, sizes = counts @ np.where(known, values, 0.0), counts @ known
            points[:, k, i] = np.divide(sums, sizes, out=np.full(len(counts), np.nan), where=sizes > 0.0)
    return points


def _read_off(points: Array, clearance: float) -> float:
    """The figure at a clearance, of a curve through points (K, 2)."""
    points = points[np.isfinite(points).all(1)]
    x, y = points[np.argsort(points[:, 0], kind="stable")].T
    return float(np.interp(clearance, x, y)) if len(points) else np.nan
