"""A folder of a study's results as tables, with the missing and the failed episodes."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from mjnav.errors import InputError
from mjnav.study.cells import Labels, variants
from mjnav.study.compare.cell_rows import CellRows, cell_rows
from mjnav.study.compare.chosen_figures import (
    COLLISIONS,
    DEFAULT_FIGURES,
    LAYOUT,
    PEOPLE,
    WIN_BY,
    check_figures,
    check_win_by,
    columns_for,
    expanded,
)
from mjnav.study.compare.compare import Comparison, compare, pooled
from mjnav.study.compare.result_tables import html_table, percent
from mjnav.study.store.row import check_own
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import Inconsistency, inconsistencies

if TYPE_CHECKING:
    import pyarrow

NEEDED = ("study", "scene", "setting", "method", "seed", "success", *COLLISIONS, "ticks", "infeasible_ticks")
DECISION = ("compute_ms_control_p50", "compute_ms_control_p99")
TEXTS = ("error", "revision", "machine")

CellPlace = tuple[str, str, str]  # scene, setting and method


@dataclass(frozen=True, slots=True)
class StudyComparison:
    """The tables of a study, and what is missing from them. The study file may not be known."""

    folder: str
    study: str  # its name
    figures: tuple[str, ...]  # that are compared, without the rates
    tables: tuple[Comparison, ...]
    num_seeds: int | None  # of the study file; None without one
    missing: Mapping[CellPlace, int]  # number of seeds without a row, by cell
    absent: tuple[CellPlace, ...]  # cells of the study without any row
    causes: Counter[str]  # of failures
    revisions: tuple[str, ...]  # of mjnav, with which the rows were made
    others: tuple[str, ...]  # studies whose rows are left out
    inconsistencies: tuple[Inconsistency, ...]  # differences in programs, processors and a cell's scenario
    scenes_per_table: int = 1  # all of the study's, where they are pooled
    settings_per_table: int = 1  # and the same
    machines: tuple[str, ...] = ()  # that ran the episodes
    ratios: bool = False  # whether tables show ratios of costs to the reference's in place of differences
    labels: Labels = field(default_factory=Labels)  # of the study file

    @property
    def labelled(self) -> "StudyComparison":
        """The same for people to read: with labels in the place of names."""
        place = self.labels.place
        return replace(
            self,
            tables=tuple(_labelled(table, self.labels) for table in self.tables),
            missing={place(cell): lack for cell, lack in self.missing.items()},
            absent=tuple(map(place, self.absent)),
            labels=Labels(),
        )

    @property
    def num_episodes(self) -> int:
        """Rows, including those of failed episodes."""
        return sum(row.num for table in self.tables for row in table.rows)

    @property
    def num_missing(self) -> int:
        """Episodes of the study file that have no row."""
        return sum(self.missing.values()) + len(self.absent) * (self.num_seeds or 0)

    def __repr__(self) -> str:
        return f"StudyComparison({self.folder!r}: {self.num_episodes} episodes, tables: {len(self.tables)})"

    def _repr_html_(self) -> str:
        """The rates of all methods, as notebooks show them; `mjnav compare -o FILE.html` has every figure."""
        heads = ("scene", "setting", "method", "n", "success %", "collision %")
        rows = [
            (t.scene, t.setting, r.method, r.num, percent(r.figures["success"]), percent(r.figures["collision"]))
            for t in self.labelled.tables
            for r in t.rows
        ]
        return html_table(f"{self.study} in {self.folder}; Wilson 95 % intervals", heads, rows)


def compare_study(
    store: Store,
    study: StudyFile | None,
    *,
    reference: str | None = None,
    figures: Sequence[str],
    pool: bool = False,
    pool_all: bool = False,
    win_by: str = WIN_BY,
    rivals: bool = False,
    ratios: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> StudyComparison:
    """The study's rows in a store as tables; the rates are always among the figures.

    With `pool`, one table for each setting has the episodes of all scenes; with `pool_all`, one table has all episodes.
    `win_by` is the cost that decides between two successes; with `rivals`, every two methods are compared so.

    `progress` gets the number of tables that are done and of all. Raises InputError where there are no rows or rows of
    several studies, InvalidValue for an unknown figure or reference, MjnavError for a damaged store.
    """
    asked = expanded(figures)
    check_figures(asked)
    check_win_by(win_by)
    if not store.has_rows():
        raise InputError(f"{store.folder}: no results of a sweep")
    table = store.rows(list(dict.fromkeys((*NEEDED, PEOPLE, LAYOUT, *DECISION, win_by, *TEXTS, *columns_for(asked)))))
    table, name, others = _of_study(table, study, store)
    cells = cell_rows(table.drop_columns(list(TEXTS)), [method.identifier for method in study.methods] if study else ())
    check_distinct(cells, store)
    check_own(asked, cells[0].columns)
    figures = _defined(asked, figures, cells)
    wanted = np.array(study.all_seeds if study else [])
    missing = Counter({(c.scene, c.setting, c.method): len(np.setdiff1d(wanted, c.seeds)) for c in cells})
    absent = tuple(place for place in _cells_of(study, cells) if place not in missing)
    num_scenes = len({cell.scene for cell in cells}) if pool or pool_all else 1
    num_settings = len({cell.setting for cell in cells}) if pool_all else 1
    if pool or pool_all:
        cells = pooled(cells, settings=pool_all)
        missing, of_cells = Counter(), missing
        for (_, setting, method), lack in of_cells.items():
            missing[cells[0].scene, cells[0].setting if pool_all else setting, method] += lack
    places = list(dict.fromkeys((cell.scene, cell.setting) for cell in cells))
    tables = []
    for comparison in compare(cells, reference=reference, figures=figures, win_by=win_by, rivals=rivals):
        tables.append(comparison)
        progress(len(tables), len(places))
    return StudyComparison(
        folder=str(store.folder),
        study=name,
        figures=figures,
        tables=tuple(tables),
        num_seeds=len(wanted) if study else None,
        missing=missing,
        absent=absent,
        causes=Counter(error for error in table["error"].to_pylist() if error is not None),
        revisions=tuple(sorted(table["revision"].unique().to_pylist())),
        others=others,
        inconsistencies=inconsistencies(store, name),
        scenes_per_table=num_scenes,
        settings_per_table=num_settings,
        machines=tuple(sorted(table["machine"].unique().to_pylist())),
        ratios=ratios,
        labels=Labels.of(study),
    )


def _labelled(table: Comparison, labels: Labels) -> Comparison:
    of = labels.methods
    scene, setting, reference = labels.place((table.scene, table.setting, table.reference))
    rows = tuple(replace(row, method=of.get(row.method, row.method)) for row in table.rows)
    rivals = tuple(replace(r, method=of.get(r.method, r.method), other=of.get(r.other, r.other)) for r in table.rivals)
    return replace(table, scene=scene, setting=setting, reference=reference, rows=rows, rivals=rivals)


def _defined(asked: Sequence[str], figures: Sequence[str], cells: Sequence[CellRows]) -> tuple[str, ...]:
    """The figures without default ones that no row has: those of people in scenes without, and of older rows.

    What is asked for by name beside the default ones stays.
    """
    num = len(DEFAULT_FIGURES)
    if tuple(figures[:num]) != DEFAULT_FIGURES:
        return tuple(asked)
    by_name = expanded(figures[num:])

    def known(figure: str) -> bool:
        return any(np.isfinite(cell.columns[name]).any() for cell in cells for name in columns_for([figure]))

    return tuple(figure for figure in asked if figure not in DEFAULT_FIGURES or figure in by_name or known(figure))


def _of_study(
    table: "pyarrow.Table", study: StudyFile | None, store: Store
) -> tuple["pyarrow.Table", str, tuple[str, ...]]:
    """The rows of one study, its name, and the other studies, whose rows are left out."""
    import pyarrow.compute as compute

    names = sorted(table["study"].unique().to_pylist())
    if study is not None and study.name in names:
        others = tuple(name for name in names if name != study.name)
        return table.filter(compute.field("study") == study.name), study.name, others
    if len(names) > 1:
        raise InputError(f"{store.folder}: rows of several studies: {', '.join(names)}")
    if study is not None:
        raise InputError(f"{store.folder}: rows of study {names[0]!r}, none of {study.name!r}")
    return table, names[0], ()


def _cells_of(study: StudyFile | None, cells: Iterable[CellRows]) -> list[CellPlace]:
    """The study's cells; of scenes given by path, those that have rows."""
    if study is None:
        return []
    named = [scene for scene in study.scenes if "/" not in scene and not scene.endswith(".toml")]
    scenes = list(dict.fromkeys([*named, *(cell.scene for cell in cells)]))
    return [(variant.scene, *variant.names) for variant in variants(study, scenes)]


def check_distinct(cells: Iterable[CellRows], store: Store) -> None:
    """Raises InputError where a cell has a seed twice: its rows cannot be paired with those of other methods."""
    for cell in cells:
        twice = cell.seeds[1:][np.diff(cell.seeds) == 0]
        if twice.size:
            raise InputError(
                f"{store.folder}: scene {cell.scene}, setting {cell.setting}, method {cell.method} has seed {twice[0]} "
                "under two scenarios: the study was changed between sweeps; sweep it into a folder of its own with -o"
            )
