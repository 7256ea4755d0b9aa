"""The methods of a sweep compared: figures with intervals, and differences from a reference method.

Rates have Wilson intervals. Means are over the seeds that succeeded, or over all where a figure's definition says so,
with bootstrap intervals. Differences are means over the seeds of both methods that count, with paired bootstrap
intervals. Their p-values come from sign-flip tests (rates: McNemar's) with Holm's correction over the methods compared
with one reference. Win ratios are those of `estimates`.

`compare` makes the tables of cells; `compare_study` those of a folder of results, with the missing and the failed
episodes.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from mjnav.errors import InputError, unknown_name
from mjnav.messages import Array
from mjnav.study.cells import Labels, variants
from mjnav.study.compare import cell_rows, estimates
from mjnav.study.compare.cell_rows import CellPlace, CellRows
from mjnav.study.store import Store, check_own
from mjnav.study.study_file import StudyFile, shipped_scenes
from mjnav.study.sweep.sweep import Inconsistency, inconsistencies

if TYPE_CHECKING:
    import pyarrow

# The columns that every table is made of.
NEEDED = (
    *("study", "scene", "setting", "method", "seed", "success"),
    *(*cell_rows.COLLISIONS, cell_rows.PEOPLE, cell_rows.LAYOUT),
    *("ticks", "infeasible_ticks", "compute_ms_control_p50", "compute_ms_control_p99"),
)
TEXTS = ("error", "revision", "machine")
NO_LABELS = Labels()

# --------------------------------------------------------------------------------------------- tables


@dataclass(frozen=True, slots=True)
class MethodRow:
    """A method's line of a table."""

    method: str
    label: str  # that people read in its place
    num: int  # episodes
    num_failed: int  # of them, those without a result
    num_missing: int  # seeds of the study without a row
    num_layouts: int  # of those with a result: one of a scene that draws nothing
    num_units: int  # of evidence: episodes, or where several are of one layout, layouts
    figures: Mapping[str, estimates.Estimate]  # RATES and those asked for
    differences: Mapping[str, estimates.Difference]  # the same; empty for the reference itself
    plain: Mapping[str, float]  # infeasible share of all ticks; medians over episodes of times of decisions
    wins: estimates.WinRatio | None = None  # against the reference; None of the reference itself and without one


@dataclass(frozen=True, slots=True)
class Comparison:
    """The methods in one scene and setting."""

    scene: str
    setting: str
    setting_label: str
    reference: str
    rows: tuple[MethodRow, ...]
    people: tuple[str, ...] = ()  # how many people see the robot: the values of `PEOPLE`, each once
    num_layouts: int = 1  # that its episodes have, all methods together: one of a scene that draws nothing
    rivals: tuple[estimates.Rivals, ...] = ()  # every two methods, where they were asked for

    @property
    def title(self) -> str:
        """For people."""
        return f"{self.scene}, {self.setting_label}"

    @property
    def reference_label(self) -> str:
        """What people read in the place of the reference."""
        return next((row.label for row in self.rows if row.method == self.reference), self.reference)

    def rivals_of(self, method: str) -> Iterator[tuple[str, estimates.WinRatio]]:
        """The win ratios of a method against every other one."""
        for pair in self.rivals:
            if pair.method == method:
                yield pair.other, pair.ratio
            elif pair.other == method:
                yield pair.method, pair.ratio.inverse


def compare(
    cells: Sequence[CellRows],
    *,
    reference: str | None = None,
    figures: Sequence[str] = cell_rows.DEFAULT_FIGURES,
    rivals: bool = False,
    labels: Labels = NO_LABELS,
) -> Iterator[Comparison]:
    """One table for every scene and setting, in the order of `cells`; with `rivals` also every two methods' win ratio.

    `reference` is a method's name, by default the first. Raises InvalidValue for an unknown method or figure.
    """
    cell_rows.check_figures(figures)
    methods = {cell.method for cell in cells}
    if reference is not None and reference not in methods:
        raise unknown_name("reference", reference, methods)
    tables: dict[tuple[str, str], list[CellRows]] = {}
    for cell in cells:
        tables.setdefault((cell.scene, cell.setting), []).append(cell)
    for (scene, setting), of_table in tables.items():
        base = next((cell for cell in of_table if cell.method == (reference or of_table[0].method)), None)
        yield Comparison(
            scene,
            setting,
            labels.settings.get(setting, setting),
            base.method if base is not None else "",
            tuple(_rows(of_table, base, (*cell_rows.RATES, *figures), labels)),
            _distinct(cell_rows.PEOPLE, of_table),
            max(len(_distinct(cell_rows.LAYOUT, of_table)), 1),
            estimates.all_rivals(of_table) if rivals else (),
        )


def _rows(cells: Sequence[CellRows], base: CellRows | None, figures: Sequence[str], labels: Labels) -> list[MethodRow]:
    changes: dict[str, Mapping[str, estimates.Difference]] = {}
    wins: dict[str, estimates.WinRatio] = {}
    if base is not None:
        others = [cell for cell in cells if cell is not base]
        changes = dict(zip((cell.method for cell in others), estimates.differences(others, base, figures), strict=True))
        wins = {cell.method: estimates.win_ratio(cell, base) for cell in others}
    rows = [
        MethodRow(
            method=cell.method,
            label=labels.methods.get(cell.method, cell.method),
            num=len(cell.seeds),
            num_failed=int(cell.failed.sum()),
            num_missing=cell.num_missing,
            num_layouts=max(len(cell.distinct(cell_rows.LAYOUT)), 1),
            num_units=len(cell.seeds if cell.units is None else np.unique(cell.units)),
            figures=own,
            differences=changes.get(cell.method, {}),
            plain={
                "infeasible_share": _ratio(cell.columns["infeasible_ticks"], cell.columns["ticks"]),
                "decision_ms": _median(cell.columns["compute_ms_control_p50"]),
                "decision_p99_ms": _median(cell.columns["compute_ms_control_p99"]),
            },
            wins=wins.get(cell.method),
        )
        for cell, own in zip(cells, estimates.estimates(cells, figures), strict=True)
    ]
    return corrected_rows(rows)


def corrected_rows(rows: Sequence[MethodRow]) -> list[MethodRow]:
    """Rows with Holm's correction over all that are compared with another, of each figure by itself."""
    compared = [row for row in rows if row.wins is not None]
    of_figures = {
        name: iter(estimates.corrected([row.differences[name] for row in compared]))
        for name in (compared[0].differences if compared else ())
    }
    wins = iter(estimates.corrected([row.wins for row in compared if row.wins is not None]))
    return [
        row
        if row.wins is None
        else replace(row, differences={name: next(tests) for name, tests in of_figures.items()}, wins=next(wins))
        for row in rows
    ]


def _distinct(text: str, cells: Sequence[CellRows]) -> tuple[str, ...]:
    return tuple(sorted({value for cell in cells for value in cell.distinct(text)}))


def _ratio(part: Array, whole: Array) -> float:
    total = np.nansum(whole)
    return float(np.nansum(part) / total) if total else nan


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan


# --------------------------------------------------------------------------------------------- studies


@dataclass(frozen=True, slots=True)
class StudyComparison:
    """The tables of a study, and what is missing from them. The study file may not be known."""

    folder: str
    study: str  # its name
    figures: tuple[str, ...]  # that are compared, without the rates
    tables: tuple[Comparison, ...]
    num_seeds: int | None  # of the study file; None without one
    absent: tuple[CellPlace, ...]  # cells of the study without any row, as people read them
    causes: Counter[str]  # of failures
    revisions: tuple[str, ...]  # of mjnav, with which the rows were made
    machines: tuple[str, ...]  # that ran the episodes
    others: tuple[str, ...]  # studies whose rows are left out
    inconsistencies: tuple[Inconsistency, ...]  # differences in programs, processors and a cell's scenario
    scenes_per_table: int = 1  # all of the study's, where they are pooled
    settings_per_table: int = 1  # and the same
    ratios: bool = False  # whether tables show ratios of costs to the reference's in place of differences
    overview: bool = False  # whether the first table is of all the others together

    @property
    def rows(self) -> list[tuple[Comparison, MethodRow]]:
        """Every line with its table."""
        return [(table, row) for table in self.tables for row in table.rows]

    @property
    def _counted(self) -> list[MethodRow]:
        """Every line but those of an overview, whose episodes the other tables have."""
        return [row for table in self.tables[self.overview :] for row in table.rows]

    @property
    def num_episodes(self) -> int:
        """Rows, including those of failed episodes."""
        return sum(row.num for row in self._counted)

    @property
    def num_missing(self) -> int:
        """Episodes of the study file that have no row."""
        return sum(row.num_missing for row in self._counted) + len(self.absent) * (self.num_seeds or 0)

    def __repr__(self) -> str:
        return f"StudyComparison({self.folder!r}: {self.num_episodes} episodes, tables: {len(self.tables)})"


def compare_study(
    store: Store,
    study: StudyFile | None,
    *,
    reference: str | None = None,
    figures: Sequence[str] = cell_rows.DEFAULT_FIGURES,
    pool: bool = False,
    pool_all: bool = False,
    rivals: bool = False,
    ratios: bool = False,
) -> StudyComparison:
    """The study's rows in a store as tables; the rates are always among the figures.

    With `pool`, one table for each setting has the episodes of all scenes; with `pool_all`, one table has all episodes.
    With `rivals`, every two methods have a win ratio, too.

    Raises InputError where there are no rows or rows of
    several studies, InvalidValue for an unknown figure or reference, MjnavError for a damaged store.
    """
    asked = cell_rows.expanded(figures)
    cell_rows.check_figures(asked)
    if not store.has_rows():
        raise InputError(f"{store.folder}: no results of a sweep")
    table = store.rows(list(dict.fromkeys((*NEEDED, cell_rows.WIN_BY, *TEXTS, *cell_rows.columns_for(asked)))))
    names = _distinct_values(table, "study")
    name = _name_of_study(names, study, store)
    table = rows_of(table, name)
    cells = cell_rows.cell_rows(table, [method.identifier for method in study.methods] if study else ())
    check_distinct(cells, store)
    check_own(asked, cells[0].columns)
    figures = _measured(figures, cells)
    wanted = np.array(study.all_seeds if study else [])
    cells = [replace(cell, num_missing=len(np.setdiff1d(wanted, cell.seeds))) for cell in cells]
    places = {cell.place for cell in cells}
    labels = Labels.of(study)
    num_scenes = len({cell.scene for cell in cells}) if pool or pool_all else 1
    num_settings = len({cell.setting for cell in cells}) if pool_all else 1
    absent = tuple(labels.place(place) for place in cells_of(store, study, cells) if place not in places)
    if pool or pool_all:
        cells = cell_rows.pooled(cells, settings=pool_all)
    tables = compare(cells, reference=reference, figures=figures, rivals=rivals, labels=labels)
    return StudyComparison(
        folder=str(store.folder),
        study=name,
        figures=figures,
        tables=tuple(tables),
        num_seeds=len(wanted) if study else None,
        absent=absent,
        causes=Counter(error for error in table["error"].to_pylist() if error is not None),
        revisions=_distinct_values(table, "revision"),
        machines=_distinct_values(table, "machine"),
        others=tuple(other for other in names if other != name),
        inconsistencies=inconsistencies(store, name),
        scenes_per_table=num_scenes,
        settings_per_table=num_settings,
        ratios=ratios,
    )


def _measured(figures: Sequence[str], cells: Sequence[CellRows]) -> tuple[str, ...]:
    """The figures without default ones that no row has: those of people in scenes without, and of older rows.

    What is asked for by name beside the default ones stays.
    """
    num = len(cell_rows.DEFAULT_FIGURES)
    named = cell_rows.expanded(figures[num:] if tuple(figures[:num]) == cell_rows.DEFAULT_FIGURES else figures)

    def measured(figure: str) -> bool:
        return any(np.isfinite(cell.columns[name]).any() for cell in cells for name in cell_rows.columns_for([figure]))

    return tuple(figure for figure in cell_rows.expanded(figures) if figure in named or measured(figure))


def _name_of_study(names: Sequence[str], study: StudyFile | None, store: Store) -> str:
    """The study whose rows are compared. Raises InputError."""
    if study is not None and study.name in names:
        return study.name
    if study is not None:
        raise InputError(f"{store.folder}: rows of study {names[0]!r}, none of {study.name!r}")
    if len(names) > 1:
        raise InputError(f"{store.folder}: rows of several studies: {', '.join(names)}")
    return names[0]


def _distinct_values(table: "pyarrow.Table", column: str) -> tuple[str, ...]:
    return tuple(sorted(table[column].unique().to_pylist()))


def rows_of(table: "pyarrow.Table", study: str) -> "pyarrow.Table":
    """The rows of one study."""
    import pyarrow.compute as compute

    return table.filter(compute.field("study") == study)


def cells_of(store: Store, study: StudyFile | None, cells: Iterable[CellRows]) -> list[CellPlace]:
    """The study's cells, in the scenes of the sweep's command if it gave any; of scenes by path, those with rows."""
    if study is None:
        return []
    scenes = [*shipped_scenes(store.swept_with("--scene") or study.scenes), *(cell.scene for cell in cells)]
    return [(variant.scene, *variant.names) for variant in variants(study, list(dict.fromkeys(scenes)))]


def check_distinct(cells: Iterable[CellRows], store: Store) -> None:
    """Raises InputError where a cell has a seed twice: its rows cannot be paired with those of other methods."""
    for cell in cells:
        twice = cell.seeds[1:][np.diff(cell.seeds) == 0]
        if twice.size:
            raise InputError(
                f"{store.folder}: scene {cell.scene}, setting {cell.setting}, method {cell.method} has seed {twice[0]} "
                "under two scenarios: the study was changed between sweeps; sweep it into a folder of its own with -o"
            )
