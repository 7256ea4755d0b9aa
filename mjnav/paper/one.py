"""One obstacle (figure 7): RKHS against the linearised Gaussian and the moment surrogate, each as it was tuned.

The moment surrogate is also run over the probability eta that it asks for: the paper calls it infeasible for high ones.
Assumption 1 is judged by the same episodes: whether a nominal control exists.
"""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, wilson
from mjnav.paper.bars import entitle
from mjnav.paper.contrast import Contrast, by_place, claim, contrasts
from mjnav.paper.episodes import TUNED, study
from mjnav.paper.item import LEAST_PAIRS, Cells, Claim, Measured, StudyItem
from mjnav.paper.style import ORANGE, TWO_COLUMNS, color, legend, new_figure, style
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import common, estimate, paired
from mjnav.study.study_file import MethodEntry

MEASURES = (  # less of each is better
    ("control_cost", "less control cost", "m²/s³"),
    ("mean_deviation_m", "less deviation from the way", "m"),
    ("path_ratio", "a shorter way", ""),
    ("time_to_avoid_s", "less time to avoid", "s"),
)
RKHS = ("rkhs d=1", "rkhs d=2", "rkhs d=3")
LINEARISED = "gaussian-linearised"
ETAS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
TUNED_ETA = 0.7  # by paper-tuning
STUDY = study(
    "one",
    ["crossing1"],
    [
        *(TUNED[name] for name in (*RKHS, LINEARISED, "kld")),
        MethodEntry("gaussian-moments", grid={"eta": list(ETAS)}),
    ],
)
INFEASIBLE = "infeasible_ticks"
AXES: Mapping[str, str] = MappingProxyType(
    {
        "control_cost": "control cost\n[m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "time_to_avoid_s": "time to avoid [s]",
        INFEASIBLE: "infeasible\nticks [%]",
    }
)


def moments(eta: float) -> str:
    """The label of the moment surrogate at this probability."""
    return f"gaussian-moments eta={eta}"


def claims(cells: Cells) -> Iterator[Claim]:
    """The measures, what the moment surrogate's eta does to its feasibility, and assumption 1."""
    for rival in (LINEARISED, moments(TUNED_ETA)):
        for figure, what, unit in MEASURES:
            for method in RKHS:
                text = f"{method} takes {what} than {rival}"
                yield claim(text, "figure 7, section V-C", contrasts(cells, method, rival, figure), -1, unit)
    yield _feasibility(cells)
    nominal = [_nominal(where, cell) for where, cell in by_place(cells, "rkhs d=1").items()]
    yield Claim("A nominal control always exists", "assumption 1", nominal)


def _feasibility(cells: Cells) -> Claim:
    by_eta = {eta: by_place(cells, moments(eta)) for eta in ETAS}
    tests = []
    for where in dict.fromkeys(where for places in by_eta.values() for where in places):
        here = {eta: places[where] for eta, places in by_eta.items() if where in places}
        text = ", ".join(f"{eta:g}: {_percent(tick_share(cell, 'ticks_without_own'))}" for eta, cell in here.items())
        change = np.empty(0)
        if ETAS[0] in here and ETAS[-1] in here:
            at_high, at_low = common(here[ETAS[-1]], here[ETAS[0]])
            change = _shares(here[ETAS[-1]])[at_high] - _shares(here[ETAS[0]])[at_low]
        contrast = Contrast(f"{where}: share of ticks by eta {text}; from the least to the most", paired(change))
        tests.append(contrast.measured(+1))
    text = "The moment surrogate finds nothing that meets its constraint the more often, the higher the eta it asks for"
    return Claim(text, "figure 7, section V-C", tests)


def tick_share(cell: CellRows, column: str) -> float:
    """The share of all ticks of a cell that `column` counts; NaN without ticks."""
    ticks = np.nansum(cell.columns["ticks"])
    return float(np.nansum(cell.columns[column]) / ticks) if ticks else np.nan


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if np.isfinite(share) else "no result"


def _shares(cell: CellRows) -> Array:
    return cell.columns["ticks_without_own"] / cell.columns["ticks"]


def _nominal(where: str, cell: CellRows) -> Measured:
    """That some control met the constraints at the mean at every tick. One counterexample refutes it, with p = 0."""
    always = cell.columns["ticks_without_nominal"][~cell.failed] == 0
    interval = wilson(int(always.sum()), always.size)
    if interval is None:
        return Measured(False, None, f"{where}: no episode has a result")
    low, high = (100.0 * end for end in interval)
    line = (
        f"{where}: at every tick in {100.0 * always.mean():.1f} % [{low:.1f}, {high:.1f}] of {always.size} runs; "
        f"missing at {100.0 * tick_share(cell, 'ticks_without_nominal'):.2f} % of ticks"
    )
    return Measured(bool(always.all()), 0.0 if always.size >= LEAST_PAIRS else None, line)


def picture(cells: Cells) -> Figure:
    """A column for each setting: the moment surrogate as a curve over eta, the others as lines across."""
    found = {method: by_place(cells, method) for method in (*RKHS, LINEARISED, *map(moments, ETAS))}
    places = list(dict.fromkeys(place for of in found.values() for place in of))
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(places)), 0.6 + 1.2 * len(AXES))
        panels = figure.subplots(len(AXES), max(len(places), 1), sharex=True, sharey="row", squeeze=False)
        for column, place in zip(panels.T, places, strict=False):
            here = {method: of[place] for method, of in found.items() if place in of}
            for axes, name in zip(column, AXES, strict=True):
                _panel(axes, here, name)
            entitle(column[0], place.partition(", ")[2], list(here.values()))
        for row, label in zip(panels, AXES.values(), strict=True):
            row[0].set_ylabel(label)
        for axes in panels[-1]:
            axes.set_xlabel("η")
        legend(figure, panels.flat, ncols=5)
    return figure


def _panel(axes: Axes, cells: Mapping[str, CellRows], name: str) -> None:
    curve = [_estimate(cells.get(moments(eta)), name) for eta in ETAS]
    axes.plot(ETAS, [e[0] for e in curve], color=ORANGE, marker="o", markersize=2.0, label="gaussian-moments over η")
    low, high = np.array([interval or (np.nan, np.nan) for _, interval in curve]).T
    axes.fill_between(ETAS, low, high, color=ORANGE, alpha=0.25, linewidth=0.0)
    for method in (*RKHS, LINEARISED):
        value, interval = _estimate(cells.get(method), name)
        if not np.isfinite(value):
            continue
        axes.axhline(value, color=color(method), label=method, linestyle="--" if method == LINEARISED else "-")
        if interval:
            axes.axhspan(*interval, color=color(method), alpha=0.15, linewidth=0.0)
    axes.grid(axis="y")


def _estimate(cell: CellRows | None, name: str) -> tuple[float, Interval]:
    if cell is None:
        return np.nan, None
    if name == INFEASIBLE:
        return 100.0 * tick_share(cell, name), None
    found = estimate(cell, name)
    return found.value, found.interval


LIMITS = (
    "The robot of these scenes may stop, and a method that waits for a person deviates little. So a claim on deviation "
    "that does not hold here says nothing of a robot that cannot stop: for such a one (the code of the paper's group "
    "drives at 0.4 m/s or more) the paper's claim was found to hold. The methods also differ in that rkhs weighs its "
    "risk and its rivals forbid."
)
ITEM = StudyItem(
    title="One obstacle: control cost, deviation, time to avoid",
    studies=(STUDY,),
    claims=claims,
    picture=picture,
    limits=LIMITS,
)
