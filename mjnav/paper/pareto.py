"""Every method over its own weight or probability: at equal clearance, which takes less control and deviates less?

One operating point proves nothing: a method that costs less may only be bolder. So each method's curve of mean cost
over mean clearance is read off, by linear interpolation, at the clearance in the middle of what both curves cover.
Resampling the seeds resamples both curves.
"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.messages import Array
from mjnav.paper.bars import AXES, with_result
from mjnav.paper.contrast import Contrast, bootstrap_p, claim, short, undefined
from mjnav.paper.episodes import DIRECT, study
from mjnav.paper.item import Cells, Claim, StudyItem
from mjnav.paper.style import TWO_COLUMNS, color, legend, new_figure, style
from mjnav.rng import stream
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import Difference, Estimate, estimate
from mjnav.study.study_file import MethodEntry, SettingEntry

CURVES = (  # as in paper-tuning, which has one more scene and other seeds
    MethodEntry("rkhs", "rkhs d=1", {"degree": 1}, {"weight": [0.3, 1.0, 3.0, 10.0, 30.0]}),
    MethodEntry("rkhs", "rkhs d=2", {"degree": 2}, {"weight": [0.1, 0.3, 1.0, 3.0, 10.0]}),
    MethodEntry("rkhs", "rkhs d=3", {"degree": 3}, {"weight": [0.1, 0.3, 1.0, 3.0, 10.0]}),
    MethodEntry("gaussian-linearised", grid={"delta": [0.3, 0.1, 0.05, 0.02, 0.01]}),
    MethodEntry("gaussian-moments", grid={"eta": [0.5, 0.7, 0.8, 0.9, 0.95]}),
    MethodEntry("kld", grid={"weight": [0.3, 1.0, 3.0, 10.0, 30.0]}),
    MethodEntry("saa", grid={"eta": [0.7, 0.8, 0.9, 0.95, 0.99]}),
)
SETTINGS = (
    SettingEntry("kinematic, direct", {"physics.engine": "kinematic", **DIRECT}),
    SettingEntry("mujoco, filtered", {"physics.engine": "mujoco"}),
)
NOISES: Mapping[str, object] = MappingProxyType({"noise.profile": ["pearson", "bimodal"]})
PAIRS = (
    ("rkhs d=1", "gaussian-linearised"),
    ("rkhs d=3", "gaussian-linearised"),
    ("rkhs d=1", "gaussian-moments"),
    ("rkhs d=3", "gaussian-moments"),
    ("rkhs d=1", "saa"),
    ("rkhs d=1", "kld"),
    ("rkhs d=3", "rkhs d=1"),
)
FIGURES = (("control_cost", "less control", "m²/s³"), ("mean_deviation_m", "less deviation", "m"))
RESAMPLES = 5_000  # so that the least p-value survives the correction


def claims(cells: Cells) -> Iterator[Claim]:
    """Cost and deviation at equal clearance, for pairs of methods."""
    for figure, what, unit in FIGURES:
        for method, rival in PAIRS:
            found = [_at_equal_clearance(cells, setting, method, rival, figure) for setting in _settings(cells)]
            text = f"At equal clearance, {method} takes {what} than {rival}"
            yield claim(text, "what one operating point cannot show", found, -1, unit)


def _settings(cells: Cells) -> list[str]:
    """In the study's order."""
    return list(dict.fromkeys(cell.setting for cell in cells))


def _curve(cells: Cells, setting: str, method: str) -> list[CellRows]:
    """The cells of one method in one setting, over its own parameter."""
    return [cell for cell in cells if cell.setting == setting and cell.method.startswith(f"{method} ")]


def _at_equal_clearance(cells: Cells, setting: str, method: str, rival: str, figure: str) -> Contrast:
    ours, theirs, where = _curve(cells, setting, method), _curve(cells, setting, rival), short(setting)
    if not ours or not theirs:
        return undefined(where)
    seeds = sorted(set.intersection(*(set(cell.seeds.tolist()) for cell in (*ours, *theirs))))
    if not seeds:
        return undefined(where)
    rng = stream(0, "paper.pareto", setting)
    # How often each resample has each seed; the first has each once.
    drawn = rng.multinomial(len(seeds), np.full(len(seeds), 1.0 / len(seeds)), RESAMPLES)
    counts = np.vstack([np.ones(len(seeds)), drawn]).astype(float)
    a, b = (_points(of_method, seeds, figure, counts) for of_method in (ours, theirs))
    known = [points[0, np.isfinite(points[0]).all(1), 0] for points in (a, b)]
    low, high = max(x.min(initial=np.inf) for x in known), min(x.max(initial=-np.inf) for x in known)
    if not (low < high and all(x.size for x in known)):
        return undefined(f"{where}, no clearance in common")
    at = 0.5 * (low + high)
    change = np.array([_read_off(x, at) - _read_off(y, at) for x, y in zip(a, b, strict=True)])
    resampled = change[1:][np.isfinite(change[1:])]
    least, most = np.quantile(resampled, [0.025, 0.975]).tolist()
    counted = [int(np.isfinite(cell.values(figure)[np.isin(cell.seeds, seeds)]).sum()) for cell in (*ours, *theirs)]
    found = Estimate(float(change[0]), (least, most), min(filter(None, counted)))
    return Contrast(f"{where}, at {at:.2f} m", Difference(found, bootstrap_p(resampled)))


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


def picture(cells: Cells) -> Figure:
    """A column for each setting; better is to the right and down."""
    settings, figures = _settings(cells), ("control_cost", "mean_deviation_m", "collision")
    with style():
        figure = new_figure(TWO_COLUMNS, 0.7 + 1.7 * len(figures))
        panels = figure.subplots(len(figures), max(len(settings), 1), sharex="col", sharey="row", squeeze=False)
        for column, setting in zip(panels.T, settings, strict=False):
            for axes, name in zip(column, figures, strict=True):
                for method in CURVES:
                    _draw_curve(axes, _curve(cells, setting, method.identifier), method.identifier, name)
            of_setting = [cell for cell in cells if cell.setting == setting]
            column[0].set_title(f"{short(setting)}, {with_result(of_setting)}")
        for row, name in zip(panels, figures, strict=True):
            row[0].set_ylabel(AXES[name])
        for axes in panels[-1]:
            axes.set_xlabel("mean of least clearance [m]")
        legend(figure, panels.flat, ncols=4)
    return figure


def _draw_curve(axes: Axes, cells: Cells, method: str, name: str) -> None:
    if not cells:
        return
    clearance = np.array([estimate(cell, "min_clearance_m").value for cell in cells])
    order = np.argsort(clearance)
    found = [estimate(cells[i], name) for i in order]
    axes.plot(clearance[order], [e.value for e in found], color=color(method), marker="o", markersize=2.0, label=method)
    for x, e in zip(clearance[order], found, strict=True):
        if e.interval is not None:
            axes.vlines(x, *e.interval, color=color(method), linewidth=0.6, alpha=0.6)
    axes.grid()


ITEM = StudyItem(
    title="Every method over its own parameter",
    studies=(study("pareto", ["crossing3"], CURVES, settings=SETTINGS, grid=NOISES),),
    claims=claims,
    picture=picture,
    limits=(
        "rkhs and kld weigh their risk against the goal, saa and the Gaussian methods forbid what exceeds a bound. So "
        "a difference between them at equal clearance is one of soft against hard constraints as much as of matching: "
        "it does not say what matching itself saves."
    ),
)
