"""The methods of a sweep compared: figures with intervals, and differences from a reference method.

Rates have Wilson intervals. Means are over the seeds that succeeded, or over all where `metrics.definitions` says so,
with bootstrap intervals. Differences are means over the seeds of both methods that count, with paired bootstrap
intervals. Their p-values come from sign-flip tests (rates: McNemar's) with Holm's correction over the methods compared
with one reference. Win ratios are those of `estimates`.

`pooled` joins a study's scenes, or its scenes and settings, to one cell: a layout is a draw, and pairs with the other
methods' episodes in the same layout.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan

import numpy as np

from mjnav.errors import unknown_name
from mjnav.messages import Array
from mjnav.metrics.intervals import holm
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.chosen_figures import DEFAULT_FIGURES, RATES, WIN_BY, check_figures, check_win_by
from mjnav.study.compare.estimates import (
    Difference,
    Estimate,
    Rivals,
    WinRatio,
    all_rivals,
    differences,
    estimates,
    win_ratios,
)


def pooled(cells: Sequence[CellRows], *, settings: bool = False) -> list[CellRows]:
    """One cell for each setting and method, with the rows of all scenes; with `settings` one for each method.

    Its seeds number (seed, setting, scene), so that a difference pairs the episodes of one scene, setting and seed.
    Scenes and settings count by the number of their episodes: alike, in a study that is complete. What several settings
    have of one layout is one unit of evidence; in a scene of one layout, what they have of one seed.
    """
    scenes = list(dict.fromkeys(cell.scene for cell in cells))
    labels = list(dict.fromkeys(cell.setting for cell in cells))
    groups: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        groups.setdefault(("" if settings else cell.setting, cell.method), []).append(cell)
    if not settings or len(labels) == 1:
        return [_joined(group, scenes, labels) for group in groups.values()]
    drawn = {scene for scene in scenes if len({one for c in cells if c.scene == scene for one in c.layouts}) > 1}
    return [
        replace(_joined(group, scenes, labels, drawn), setting=f"{len(labels)} settings") for group in groups.values()
    ]


def _joined(
    cells: Sequence[CellRows], scenes: Sequence[str], labels: Sequence[str], drawn: Collection[str] | None = None
) -> CellRows:
    """The rows of all cells; with the scenes that draw several layouts, also their units of evidence."""
    columns = {key: np.concatenate([cell.columns[key] for cell in cells]) for key in cells[0].columns}
    places = [scenes.index(cell.scene) + len(scenes) * labels.index(cell.setting) for cell in cells]
    stride = len(scenes) * len(labels)
    columns["seed"] = np.concatenate([cell.seeds * stride + place for cell, place in zip(cells, places, strict=True)])
    order = np.argsort(columns["seed"])
    units = None
    if drawn is not None:
        keys = [key for cell in cells for key in _keys(cell, drawn)]
        numbers: dict[str, int] = {}
        units = np.array([numbers.setdefault(keys[place], len(numbers)) for place in order])
    return CellRows(
        scene=scenes[0] if len(scenes) == 1 else f"{len(scenes)} scenes",
        setting=cells[0].setting,
        method=cells[0].method,
        columns={key: column[order] for key, column in columns.items()},
        people=tuple(sorted({value for cell in cells for value in cell.people})),
        layouts=tuple(dict.fromkeys(f"{cell.scene} {layout}" for cell in cells for layout in cell.layouts or ("",))),
        units=units,
    )


def _keys(cell: CellRows, drawn: Collection[str]) -> Iterator[str]:
    """What the rows of a unit of evidence share: the layout; in a scene of one, or where it is not known, the seed."""
    layouts = cell.layout_by_row if cell.scene in drawn else [None] * len(cell.seeds)
    for seed, layout in zip(cell.seeds, layouts, strict=True):
        yield f"{cell.scene} {seed}" if layout is None else f"{cell.scene}, {layout}"


@dataclass(frozen=True, slots=True)
class MethodRow:
    """A method's line of a table."""

    method: str
    num: int  # episodes
    num_failed: int  # of them, those without a result
    num_layouts: int  # of those with a result: one of a scene that draws nothing
    num_units: int  # of evidence: episodes, or where several are of one layout, layouts
    figures: Mapping[str, Estimate]  # RATES and those asked for
    differences: Mapping[str, Difference]  # the same; empty for the reference itself
    infeasible_share: float  # of all ticks
    decision_ms: float  # median over episodes of their median
    decision_p99_ms: float  # and of their 99th percentile
    wins: WinRatio | None = None  # against the reference; None of the reference itself and without one


@dataclass(frozen=True, slots=True)
class Comparison:
    """The methods in one scene and setting."""

    scene: str
    setting: str
    reference: str
    rows: tuple[MethodRow, ...]
    people: tuple[str, ...] = ()  # how many people see the robot: the values of `PEOPLE`, each once
    num_layouts: int = 1  # that its episodes have, all methods together: one of a scene that draws nothing
    win_by: str = WIN_BY  # the cost that decides between two successes
    rivals: tuple[Rivals, ...] = ()  # every two methods, where they were asked for


def compare(
    cells: Sequence[CellRows],
    *,
    reference: str | None = None,
    figures: Sequence[str] = DEFAULT_FIGURES,
    win_by: str = WIN_BY,
    rivals: bool = False,
) -> Iterator[Comparison]:
    """One table for every scene and setting, in the order of `cells`; with `rivals` also every two methods' win ratio.

    `reference` is a method's label, by default the first. Raises InvalidValue for an unknown method or figure.
    """
    check_figures(figures)
    check_win_by(win_by)
    known = {cell.method for cell in cells}
    if reference is not None and reference not in known:
        raise unknown_name("reference", reference, known)
    tables: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        tables.setdefault((cell.scene, cell.setting), []).append(cell)
    for (scene, setting), of_table in tables.items():
        base = next((cell for cell in of_table if cell.method == reference), None)
        if base is None and reference is None:
            base = of_table[0]
        found = _comparison(scene, setting, of_table, base, (*RATES, *figures), win_by)
        yield replace(found, rivals=all_rivals(of_table, win_by)) if rivals else found


def _comparison(
    scene: str,
    setting: str,
    cells: Sequence[CellRows],
    base: CellRows | None,
    figures: Sequence[str],
    win_by: str,
) -> Comparison:
    others = [cell for cell in cells if base is not None and cell is not base]
    by_method: dict[str, dict[str, Difference]] = {}
    wins: dict[str, WinRatio] = {}
    if base is not None:
        of_others = differences(others, base, figures)
        by_method = {cell.method: own for cell, own in zip(others, of_others, strict=True)}
        ratios = win_ratios(others, base, win_by)
        wins = {cell.method: ratio for cell, ratio in zip(others, ratios, strict=True)}
    for figure in figures:
        known = {method: p for method, d in by_method.items() if (p := d[figure].p) is not None}
        for method, p in zip(known, holm(list(known.values())), strict=True):
            by_method[method][figure] = replace(by_method[method][figure], p=p)
    rows = [
        MethodRow(
            method=cell.method,
            num=len(cell.seeds),
            num_failed=int(cell.failed.sum()),
            num_layouts=max(len(cell.layouts), 1),
            num_units=len(cell.seeds if cell.units is None else np.unique(cell.units)),
            figures=own,
            differences=by_method.get(cell.method, {}),
            infeasible_share=_ratio(cell.columns["infeasible_ticks"], cell.columns["ticks"]),
            decision_ms=_median(cell.columns["compute_ms_control_p50"]),
            decision_p99_ms=_median(cell.columns["compute_ms_control_p99"]),
            wins=wins.get(cell.method),
        )
        for cell, own in zip(cells, estimates(cells, figures), strict=True)
    ]
    people = tuple(sorted({value for cell in cells for value in cell.people}))
    num_layouts = max(len({value for cell in cells for value in cell.layouts}), 1)
    return Comparison(scene, setting, base.method if base is not None else "", tuple(rows), people, num_layouts, win_by)


def _ratio(part: Array, whole: Array) -> float:
    total = np.nansum(whole)
    return float(np.nansum(part) / total) if total else nan


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan
