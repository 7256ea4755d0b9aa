"""The table (figure 6a, b): d = 1 is said to pass between its legs, d = 3 to go around.

Heading noise of 0.2 rad, any control within the limits, a small weight: there the kernel's shape decides the way.
"""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.messages import Array
from mjnav.metrics.intervals import mcnemar, wilson
from mjnav.paper.bars import gap, with_result
from mjnav.paper.contrast import by_place
from mjnav.paper.episodes import ROBOT_DIRECT, study
from mjnav.paper.item import LEAST_PAIRS, Cells, Claim, Measured, StudyItem
from mjnav.paper.style import BLUE, INK, ORANGE, PALE, TWO_COLUMNS, new_figure, style
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.study_file import MethodEntry, SettingEntry

SETTINGS = (
    SettingEntry("direct", ROBOT_DIRECT),
    # The published cost: a preview of one period, no term for the heading.
    SettingEntry("direct and as published", {**ROBOT_DIRECT, "control.preview": 0.1, "control.heading_weight": 0.0}),
    SettingEntry("filtered"),
)
# "d=1 matched" weighs the mean's term as d = 3 does.
METHODS: Mapping[str, Mapping[str, object]] = MappingProxyType(
    {"d=1": {"degree": 1}, "d=2": {"degree": 2}, "d=3": {"degree": 3}, "d=1 matched": {"degree": 1, "weight": 0.12}}
)
BETWEEN, AROUND = "between the legs", "around"
WAYS = (  # method, what the claim calls it, the way that it is said to take
    ("d=1", "Degree 1", BETWEEN),
    ("d=1 matched", "Degree 1, as heavy as degree 3,", BETWEEN),
    ("d=3", "Degree 3", AROUND),
)
SHADES = ((BETWEEN, BLUE), (AROUND, ORANGE), ("collision or timeout", PALE))
HALF_WIDTH = 0.75  # [m] from the way to a leg: a run that leaves the way by more goes around


def between_legs(cell: CellRows) -> Array:
    """Of the runs that reached the goal without contact, which went between the legs; (n,) of 0 and 1."""
    deviation = cell.values("max_deviation_m")
    return (deviation[np.isfinite(deviation)] < HALF_WIDTH).astype(float)


def claims(cells: Cells) -> Iterator[Claim]:
    """Whether most runs took the way that the paper shows."""
    for method, name, way in WAYS:
        tests = [_test(where, cell, way) for where, cell in by_place(cells, method).items()]
        yield Claim(f"{name} goes {way} in most runs", "figure 6a, b, section V-B", tests)


def _test(where: str, cell: CellRows, way: str) -> Measured:
    """The exact binomial test of one half."""
    between = between_legs(cell)
    took = between if way == BETWEEN else 1.0 - between
    interval = wilson(int(took.sum()), took.size)
    failed = int(cell.failed.sum())
    lost = f"{len(cell.seeds) - took.size - failed} more did not reach the goal unharmed"
    lost += f", {failed} episodes failed" if failed else ""
    if interval is None:
        return Measured(False, None, f"{where}: no run reached the goal without contact, {lost}")
    low, high = (100.0 * end for end in interval)
    line = f"{where}: {100.0 * took.mean():.1f} % [{low:.1f}, {high:.1f}] of {took.size} runs, {lost}"
    p = mcnemar(int(took.sum()), int(took.size - took.sum())) if took.size >= LEAST_PAIRS else None
    return Measured(bool(took.mean() > 0.5), p, line)


def picture(cells: Cells) -> Figure:
    """A panel for each setting, a bar for each degree; whiskers are Wilson intervals of the way between the legs."""
    found = {method: by_place(cells, method) for method in METHODS}
    places = list(dict.fromkeys(place for of in found.values() for place in of))
    with style():
        figure = new_figure(TWO_COLUMNS, 2.3)
        panels = figure.subplots(1, max(len(places), 1), sharey=True, squeeze=False)[0]
        for axes, place in zip(panels, places, strict=False):
            for x, of in enumerate(found.values()):
                _bar(axes, x, of.get(place))
            axes.set_xticks(range(len(METHODS)), [name.replace(" ", "\n") for name in METHODS])
            here = [of[place] for of in found.values() if place in of]
            words = place.replace(" and ", "\nand ").split(", ")[1:]
            axes.set_title("\n".join([*words, with_result(here)]))
        panels[0].set_ylabel("share of runs")
        handles = [Patch(facecolor=shade, label=label) for label, shade in SHADES]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _bar(axes: Axes, x: int, cell: CellRows | None) -> None:
    num = 0 if cell is None else int((~cell.failed).sum())
    if cell is None or not num:
        gap(axes, x, "not run" if cell is None else "undefined")
        return
    between = between_legs(cell)
    shares = np.array([between.sum(), between.size - between.sum(), num - between.size]) / num
    for share, start, (_, shade) in zip(shares, np.cumsum(shares) - shares, SHADES, strict=True):
        axes.bar(x, share, bottom=start, width=0.75, color=shade)
    interval = wilson(int(between.sum()), num)
    if interval is not None:
        axes.vlines(x, *interval, color=INK, linewidth=0.7)


ITEM = StudyItem(
    title="The table: between its legs or around it",
    studies=(
        study(
            "table",
            ["table"],
            [MethodEntry("rkhs", name, parameters) for name, parameters in METHODS.items()],
            settings=SETTINGS,
            grid={"physics.engine": ["kinematic", "mujoco"]},
            common={"control.window": "bounds", "control.clip": 3.0, "control.weight": 0.04},
        ),
    ),
    claims=claims,
    picture=picture,
)
