"""Every method over its own weight or probability: at equal clearance, which takes less control and deviates less?

One operating point proves nothing: a method that costs less may only be bolder. So each method's curve of mean cost
over mean clearance is read off, by linear interpolation, at the clearance in the middle of what both curves cover.
Resampling the seeds resamples both curves.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.messages import Array
from mjnav.paper.claims import Cells, Claim, StudyItem, at_seeds, measured, short
from mjnav.paper.draw import COLOURS, TWO_COLUMNS, axis, legend, new_figure, style, with_result
from mjnav.report.figure_text import unit
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import Difference, Estimate, estimate, paired

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
FIGURES = (("control_cost", "less control"), ("mean_deviation_m", "less deviation"))
RESAMPLES = 5_000  # so that the least p-value survives the correction


def claims(cells: Cells) -> Iterator[Claim]:
    """Cost and deviation at equal clearance, for pairs of methods."""
    for figure, what in FIGURES:
        for method, rival in PAIRS:
            tests = []
            for setting in _settings(cells):
                ours, theirs = _curve(cells, setting, method), _curve(cells, setting, rival)
                where, change = _at_equal_clearance(setting, ours, theirs, figure)
                tests.append(measured(where, change, -1, unit(figure)))
            text = f"At equal clearance, {method} takes {what} than {rival}"
            yield Claim(text, "what one operating point cannot show", tests)


def _settings(cells: Cells) -> list[str]:
    """In the study's order."""
    return list(dict.fromkeys(cell.setting for cell in cells))


def _curve(cells: Cells, setting: str, method: str) -> list[CellRows]:
    """The cells of one method in one setting, over its own parameter."""
    return [cell for cell in cells if cell.setting == setting and cell.method.startswith(f"{method} ")]


def _at_equal_clearance(
    setting: str, ours: Sequence[CellRows], theirs: Sequence[CellRows], figure: str
) -> tuple[str, Difference]:
    """Where the curves are read off, and their difference there."""
    where = short(setting)
    both = [set(cell.seeds.tolist()) for cell in (*ours, *theirs)]
    seeds = sorted(set.intersection(*both)) if ours and theirs else []
    if not seeds:
        return where, paired(np.empty(0))
    rng = stream(0, "paper.pareto", setting)
    # How often each resample has each seed; the first has each once.
    drawn = rng.multinomial(len(seeds), np.full(len(seeds), 1.0 / len(seeds)), RESAMPLES)
    counts = np.vstack([np.ones(len(seeds)), drawn]).astype(float)
    a, b = (_points(of_method, seeds, figure, counts) for of_method in (ours, theirs))
    known = [points[0, np.isfinite(points[0]).all(1), 0] for points in (a, b)]
    low, high = max(x.min(initial=np.inf) for x in known), min(x.max(initial=-np.inf) for x in known)
    if not (low < high and all(x.size for x in known)):
        return f"{where}, no clearance in common", paired(np.empty(0))
    at = 0.5 * (low + high)
    change = np.array([_read_off(x, at) - _read_off(y, at) for x, y in zip(a, b, strict=True)])
    resampled = change[1:][np.isfinite(change[1:])]
    least, most = np.quantile(resampled, [0.025, 0.975]).tolist()
    sizes = [int(np.isfinite(at_seeds(cell, seeds, figure)).sum()) for cell in (*ours, *theirs)]
    e = Estimate(float(change[0]), (least, most), min(filter(None, sizes)))
    return f"{where}, at {at:.2f} m", Difference(e, _p_value(resampled))


def _p_value(resampled: Array) -> float:
    """Of the difference being 0: how often its resamples (n,) lie on the rarer side of it, twice.

    An interval of level 1 - p just reaches the boundary.
    """
    opposite = min((resampled <= 0.0).sum(), (resampled >= 0.0).sum())
    return min(1.0, 2.0 * float(1 + opposite) / (1 + resampled.size))


def _points(cells: Sequence[CellRows], seeds: Sequence[int], figure: str, counts: Array) -> Array:
    """Mean clearance and mean figure of every cell under every resample, (R, K, 2)."""
    points = np.empty((len(counts), len(cells), 2))
    for k, cell in enumerate(cells):
        for i, name in enumerate(("min_clearance_m", figure)):
            values = at_seeds(cell, seeds, name)
            known = np.isfinite(values)
            sums, sizes = counts @ np.where(known, values, 0.0), counts @ known
            points[:, k, i] = np.divide(sums, sizes, out=np.full(len(counts), np.nan), where=sizes > 0.0)
    return points


def _read_off(points: Array, clearance: float) -> float:
    """The figure at a clearance, of a curve through points (K, 2)."""
    points = points[np.isfinite(points).all(1)]
    x, y = points[np.argsort(points[:, 0], kind="stable")].T
    return float(np.interp(clearance, x, y)) if len(points) else np.nan


def picture(cells: Cells) -> Figure:
    """A column for each setting; better is to the right and down."""
    settings, figures = _settings(cells), ("control_cost", "mean_deviation_m", "collision")
    with style():
        figure = new_figure(TWO_COLUMNS, 0.7 + 1.7 * len(figures))
        panels = figure.subplots(len(figures), max(len(settings), 1), sharex="col", sharey="row", squeeze=False)
        for column, setting in zip(panels.T, settings, strict=False):
            for axes, name in zip(column, figures, strict=True):
                for method, color in zip(METHODS, COLOURS, strict=False):
                    _draw_curve(axes, _curve(cells, setting, method), method, name, color)
                axes.grid()
            of_setting = [cell for cell in cells if cell.setting == setting]
            column[0].set_title(f"{short(setting)}\n{with_result(of_setting)}")
        for row, name in zip(panels, figures, strict=True):
            row[0].set_ylabel(axis(name)[0])
        for axes in panels[-1]:
            axes.set_xlabel("mean of least clearance [m]")
        legend(figure, panels.flat, ncols=4)
    return figure


def _draw_curve(axes: Axes, cells: Sequence[CellRows], method: str, name: str, color: str) -> None:
    points = [(estimate(cell, "min_clearance_m").value, estimate(cell, name)) for cell in cells]
    points.sort(key=lambda point: point[0])
    scale = axis(name)[1]
    x, y = [x for x, _ in points], [scale * e.value for _, e in points]
    axes.plot(x, y, color=color, marker="o", markersize=2, label=method)
    for at, e in points:
        if e.interval is not None:
            axes.vlines(at, scale * e.interval[0], scale * e.interval[1], color=color, linewidth=0.6, alpha=0.6)


PARETO = StudyItem(
    "Every method over its own parameter",
    ("paper-pareto",),
    claims,
    picture,
    "rkhs and kld weigh their risk against the goal, saa and the Gaussian methods forbid what exceeds a bound. So a "
    "difference between them at equal clearance is one of soft against hard constraints as much as of matching: it "
    "does not say what matching itself saves.",
)
