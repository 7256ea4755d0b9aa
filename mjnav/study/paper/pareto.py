"""Every method over its own weight or probability: at equal clearance, who needs less control and leaves the way less?

One operating point proves nothing: a method that costs less may only be bolder. So each method's curve of mean cost
over mean clearance is read off, by linear interpolation, at the clearance in the middle of what both curves cover.
Resampling the seeds resamples both curves.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from mjnav.messages import Array
from mjnav.rng import stream
from mjnav.study.compare import CellRows, Estimate
from mjnav.study.paper.contrast import Cells, Contrast, short, summary
from mjnav.study.paper.finding import Finding

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
RESAMPLES = 1_000


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Cost and deviation at equal clearance, for pairs of methods."""
    found = []
    for figure, claim, unit in (("control_cost", "less control", "m²/s³"), ("mean_deviation_m", "less deviation", "m")):
        for method, rival in PAIRS:
            contrasts = []
            for setting in settings(cells):
                contrasts += _at_equal_clearance(cells, setting, method, rival, figure)
            verdict, evidence = summary(contrasts, -1, unit)
            found.append(Finding(f"At equal clearance, {method} takes {claim} than {rival}", SOURCE, verdict, evidence))
    return tuple(found)


def settings(cells: Cells) -> list[str]:
    """The settings, in the study's order."""
    return list(dict.fromkeys(cell.setting for cell in cells))


def curve(cells: Cells, setting: str, method: str) -> list[CellRows]:
    """The cells of one method in one setting, over its own parameter."""
    return [cell for cell in cells if cell.setting == setting and cell.method.startswith(f"{method} ")]


def _at_equal_clearance(cells: Cells, setting: str, method: str, rival: str, figure: str) -> Iterator[Contrast]:
    ours, theirs = curve(cells, setting, method), curve(cells, setting, rival)
    if not ours or not theirs:
        return
    seeds = sorted(set.intersection(*(set(cell.seeds.tolist()) for cell in (*ours, *theirs))))
    rng = stream(0, "paper.pareto", setting)
    # How often each resample has each seed; the first has each once.
    drawn = rng.multinomial(len(seeds), np.full(len(seeds), 1.0 / len(seeds)), RESAMPLES)
    counts = np.vstack([np.ones(len(seeds)), drawn]).astype(float)
    a, b = (_points(curve_cells, seeds, figure, counts) for curve_cells in (ours, theirs))
    low = max(np.nanmin(points[0, :, 0]) for points in (a, b))
    high = min(np.nanmax(points[0, :, 0]) for points in (a, b))
    where = short(setting)
    if not low < high:
        yield Contrast(f"{where}, no clearance in common", Estimate(np.nan, None, 0))
        return
    at = 0.5 * (low + high)
    change = np.array([_read_off(x, at) - _read_off(y, at) for x, y in zip(a, b, strict=True)])
    least, most = np.nanquantile(change[1:], [0.025, 0.975]).tolist()
    yield Contrast(f"{where}, at {at:.2f} m", Estimate(float(change[0]), (least, most), len(seeds)))


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
