"""The methods of a sweep compared: figures with intervals, and differences from a reference method.

Rates have Wilson intervals. Means are over the seeds that succeeded, or over all where `metrics.definitions` says so,
with bootstrap intervals. Differences are means over the seeds of both methods that count, with paired bootstrap
intervals. Their p-values come from sign-flip tests (rates: McNemar's) with Holm's correction over the methods compared
with one reference.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import unknown_name
from mjnav.messages import Array
from mjnav.metrics.intervals import Interval, SharedBootstrap, holm, mcnemar, wilson
from mjnav.rng import stream
from mjnav.study.compare.chosen_figures import (
    COLLISIONS,
    DEFAULT_FIGURES,
    FAULT,
    LAYOUT,
    PEOPLE,
    RATES,
    check_figures,
    is_rate,
    over_all,
)
from mjnav.study.store.own_figures import COLUMN as OWN_COLUMN
from mjnav.study.store.own_figures import own_columns
from mjnav.study.store.row import COLUMNS, STRING

if TYPE_CHECKING:
    import pyarrow

RESAMPLES = 5_000


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure and its 95 % interval, from `num` seeds; NaN and None where they are undefined."""

    value: float
    interval: Interval
    num: int


@dataclass(frozen=True, slots=True)
class Difference:
    """An estimate of method - reference, and its p-value with Holm's correction over the table's methods."""

    estimate: Estimate
    p: float | None


@dataclass(frozen=True)
class CellRows:
    """The rows of one cell by seed: columns as arrays (n,), null as NaN."""

    scene: str
    setting: str
    method: str
    columns: Mapping[str, Array]
    people: tuple[str, ...] = ()  # the values of `PEOPLE`, each once; none where they are not known or nobody is there
    layouts: tuple[str, ...] = ()  # the values of `LAYOUT`, each once; none of a scene that draws nothing

    @property
    def seeds(self) -> Array:
        """Ascending, (n,)."""
        return self.columns["seed"]

    @cached_property
    def collided(self) -> Array:
        """Whether the robot touched anything, (n,); NaN for a failed episode."""
        return np.where(self.failed, np.nan, sum(self.columns[name] for name in COLLISIONS) > 0)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Which episodes have no result, (n,)."""
        return np.isnan(self.columns["success"])

    def values(self, figure: str) -> Array:
        """A figure by seed, (n,); NaN where the seed does not count."""
        if figure == "collision":
            return self.collided
        if figure == FAULT:
            hits = self.columns["robot_at_fault"]
            return np.where(np.isnan(hits), np.nan, hits > 0)
        values = self.columns[figure]
        if over_all(figure):
            return values
        return np.where(self.columns["success"] == 1, values, np.nan)


def cell_rows(table: "pyarrow.Table", methods: Sequence[str] = ()) -> list[CellRows]:
    """The rows of a table by cell: sorted by scene and setting, then in the order of `methods`, labels without a grid.

    Text columns other than the labels are left out; the column of users' own metrics becomes one for each figure.
    """
    names = [name for name in table.column_names if COLUMNS[name].type != STRING]
    columns = {name: table[name].cast("double").to_numpy(zero_copy_only=False) for name in names}
    columns["seed"] = table["seed"].to_numpy()
    if OWN_COLUMN in table.column_names:
        columns |= own_columns(table[OWN_COLUMN].to_pylist())
    labels = list(zip(*(table[name].to_pylist() for name in ("scene", "setting", "method")), strict=True))
    places: dict[tuple[str, str, str], list[int]] = {}
    for place in np.argsort(columns["seed"], kind="stable").tolist():
        places.setdefault(labels[place], []).append(place)

    def order(cell: tuple[str, str, str]) -> tuple:
        scene, setting, method = cell
        known = [i for i, label in enumerate(methods) if method == label or method.startswith(f"{label} ")]
        return natural(scene), natural(setting), max(known, key=lambda i: len(methods[i]), default=0), natural(method)

    def texts(column: str, places: Sequence[int]) -> tuple[str, ...]:
        values = table[column].take(places).to_pylist() if column in table.column_names else ()
        return tuple(sorted({value for value in values if value is not None}))

    return [
        CellRows(
            *label,
            {name: column[places[label]] for name, column in columns.items()},
            texts(PEOPLE, places[label]),
            texts(LAYOUT, places[label]),
        )
        for label in sorted(places, key=order)
    ]


def natural(text: str) -> list[tuple[float, str]]:
    """A key by which weight=3.0 comes before weight=10.0."""
    parts = re.split(r"(\d+\.?\d*(?:e[+-]?\d+)?)", text)
    return [(float(part), "") if i % 2 else (0.0, part) for i, part in enumerate(parts)]


@dataclass(frozen=True, slots=True)
class MethodRow:
    """A method's line of a table."""

    method: str
    num: int  # episodes
    num_failed: int  # of them, those without a result
    num_layouts: int  # of those with a result: one of a scene that draws nothing
    figures: Mapping[str, Estimate]  # RATES and those asked for
    differences: Mapping[str, Difference]  # the same; empty for the reference itself
    infeasible_share: float  # of all ticks
    decision_ms: float  # median over episodes of their median


@dataclass(frozen=True, slots=True)
class Comparison:
    """The methods in one scene and setting."""

    scene: str
    setting: str
    reference: str
    rows: tuple[MethodRow, ...]
    people: tuple[str, ...] = ()  # how many people see the robot: the values of `PEOPLE`, each once
    num_layouts: int = 1  # that its episodes have, all methods together: one of a scene that draws nothing


def compare(
    cells: Sequence[CellRows], *, reference: str | None = None, figures: Sequence[str] = DEFAULT_FIGURES
) -> Iterator[Comparison]:
    """One table for every scene and setting, in the order of `cells`.

    `reference` is a method's label, by default the first. Raises InvalidValue for an unknown method or figure.
    """
    check_figures(figures)
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
        yield _comparison(scene, setting, of_table, base, (*RATES, *figures))


@lru_cache(8)
def bootstrap(num: int) -> SharedBootstrap:
    """The bootstrap that all figures of `num` seeds share."""
    return SharedBootstrap(num, stream(0, "compare.bootstrap"), resamples=RESAMPLES)


def _comparison(
    scene: str,
    setting: str,
    cells: Sequence[CellRows],
    base: CellRows | None,
    figures: Sequence[str],
) -> Comparison:
    others = [cell for cell in cells if base is not None and cell is not base]
    by_method: dict[str, dict[str, Difference]] = {}
    if base is not None:
        of_others = differences(others, base, figures)
        by_method = {cell.method: own for cell, own in zip(others, of_others, strict=True)}
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
            figures=own,
            differences=by_method.get(cell.method, {}),
            infeasible_share=_ratio(cell.columns["infeasible_ticks"], cell.columns["ticks"]),
            decision_ms=_median(cell.columns["compute_ms_control_p50"]),
        )
        for cell, own in zip(cells, estimates(cells, figures), strict=True)
    ]
    people = tuple(sorted({value for cell in cells for value in cell.people}))
    num_layouts = max(len({value for cell in cells for value in cell.layouts}), 1)
    return Comparison(scene, setting, base.method if base is not None else "", tuple(rows), people, num_layouts)


def estimate(cell: CellRows, figure: str) -> Estimate:
    """A rate or a mean of one cell."""
    return estimates([cell], [figure])[0][figure]


def estimates(cells: Sequence[CellRows], figures: Sequence[str]) -> list[dict[str, Estimate]]:
    """Rates and means of every cell."""
    means = [cell.values(figure) for cell in cells for figure in figures if not is_rate(figure)]
    intervals = iter(_by_length(means, lambda num: bootstrap(num).intervals))

    def one(values: Array, figure: str) -> Estimate:
        if not is_rate(figure):
            return _estimate(values, next(intervals))
        known = values[np.isfinite(values)]
        return _estimate(values, wilson(int(known.sum()), known.size))

    return [{figure: one(cell.values(figure), figure) for figure in figures} for cell in cells]


def difference(cell: CellRows, base: CellRows, figure: str) -> Difference:
    """cell - base over the common seeds, the p-value without correction."""
    return differences([cell], base, [figure])[0][figure]


def paired(changes: Array) -> Difference:
    """The mean of differences by seed (n,), NaN where undefined; the p-value of sign flips, without correction."""
    if not len(changes):
        return Difference(Estimate(nan, None, 0), None)
    shared = bootstrap(len(changes))
    return Difference(_estimate(changes, shared.interval(changes)), shared.p_values(changes[None])[0])


def common(cell: CellRows, base: CellRows) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The indices of the common seeds in the first and in the second cell, (n,) each."""
    _, here, there = np.intersect1d(cell.seeds, base.seeds, assume_unique=True, return_indices=True)
    return here, there


def differences(cells: Sequence[CellRows], base: CellRows, figures: Sequence[str]) -> list[dict[str, Difference]]:
    """cell - base for every cell over the common seeds, the p-values without correction."""
    changes: list[Array] = []
    for cell in cells:
        here, there = common(cell, base)
        changes += [cell.values(figure)[here] - base.values(figure)[there] for figure in figures]
    intervals = iter(_by_length(changes, lambda num: bootstrap(num).intervals))
    flipped = iter(_by_length(changes, lambda num: bootstrap(num).p_values))
    following = iter(changes)

    def one(change: Array, figure: str) -> Difference:
        p = next(flipped)
        if is_rate(figure) and p is not None:
            p = mcnemar(int((change > 0).sum()), int((change < 0).sum()))
        return Difference(_estimate(change, next(intervals)), p)

    return [{figure: one(next(following), figure) for figure in figures} for _ in cells]


def _by_length(rows: Sequence[Array], function_for: Callable[[int], Callable[[Array], list[Any]]]) -> list[Any]:
    """An answer for every row, computed for all rows of one length (F, n) together; None for an empty row.

    `function_for(n)` is the function that computes them.
    """
    answers: list[Any] = [None] * len(rows)
    for num in {len(row) for row in rows} - {0}:
        places = [i for i, row in enumerate(rows) if len(row) == num]
        for place, answer in zip(places, function_for(num)(np.array([rows[i] for i in places])), strict=True):
            answers[place] = answer
    return answers


def _estimate(values: Array, interval: Interval) -> Estimate:
    known = values[np.isfinite(values)]
    return Estimate(float(known.mean()) if known.size else nan, interval, known.size)


def _ratio(part: Array, whole: Array) -> float:
    total = np.nansum(whole)
    return float(np.nansum(part) / total) if total else nan


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan
