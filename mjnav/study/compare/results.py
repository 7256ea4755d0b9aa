"""A folder of a study's results as tables, with what is missing from them and what went wrong."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mjnav.errors import InputError
from mjnav.study.compare.compare import COLLISIONS, RATES, CellRows, Comparison, cell_rows, check_figures, compare
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import Mixture, mixtures
from mjnav.study.variants import variants

if TYPE_CHECKING:
    import pyarrow

NEEDED = ("study", "scene", "setting", "method", "seed", "success", *COLLISIONS, "ticks", "infeasible_ticks")
DECISION = "compute_ms_control_p50"

Place = tuple[str, str, str]  # a cell's scene, setting and method


@dataclass(frozen=True, slots=True)
class Results:
    """What a folder says of a study."""

    folder: str
    study: str  # its name
    figures: tuple[str, ...]  # that are compared, without the rates
    tables: tuple[Comparison, ...]
    num_seeds: int | None  # that the study file asks for; None without one
    missing: Mapping[Place, int]  # of them, how many a cell lacks
    absent: tuple[Place, ...]  # cells of the study without any
    causes: Counter[str]  # of failures
    revisions: tuple[str, ...]  # of mjnav that the rows are of
    others: tuple[str, ...]  # studies whose rows are left out
    mixtures: tuple[Mixture, ...]  # what is not the same in all rows: programs, processors, a cell's scenario

    @property
    def num_episodes(self) -> int:
        """Rows, failed ones too."""
        return sum(row.num for table in self.tables for row in table.rows)

    @property
    def num_missing(self) -> int:
        """Episodes that the study file asks for and the folder has not got."""
        return sum(self.missing.values()) + len(self.absent) * (self.num_seeds or 0)


def read_results(
    store: Store,
    study: StudyFile | None,
    *,
    reference: str | None = None,
    figures: Sequence[str],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Results:
    """Every row of the store that is the study's, compared; rates are always among the figures.

    `progress` is told how many tables of how many are done. Raises InputError where there is nothing to compare or it
    cannot be told apart, InvalidValue for a figure or a reference that there is not, MjnavError for a damaged store.
    """
    figures = tuple(dict.fromkeys(figure for figure in figures if figure not in RATES))
    check_figures(figures)
    if not store.has_rows():
        raise InputError(f"{store.folder}: no results of a sweep")
    table = store.rows(list(dict.fromkeys((*NEEDED, DECISION, "error", "revision", *figures))))
    table, name, others = _of_study(table, study, store)
    cells = cell_rows(table.drop_columns(["error"]), [method.label for method in study.methods] if study else ())
    check_distinct(cells, store)
    places = list(dict.fromkeys((cell.scene, cell.setting) for cell in cells))
    tables = []
    for comparison in compare(cells, reference=reference, figures=figures):
        tables.append(comparison)
        progress(len(tables), len(places))
    wanted = np.array(study.all_seeds if study else [])
    there = {(cell.scene, cell.setting, cell.method): cell for cell in cells}
    return Results(
        folder=str(store.folder),
        study=name,
        figures=figures,
        tables=tuple(tables),
        num_seeds=len(wanted) if study else None,
        missing={place: len(np.setdiff1d(wanted, cell.seeds)) for place, cell in there.items()},
        absent=tuple(place for place in _wanted(study, cells) if place not in there),
        causes=Counter(error for error in table["error"].to_pylist() if error is not None),
        revisions=tuple(sorted(table["revision"].unique().to_pylist())),
        others=others,
        mixtures=mixtures(store, name),
    )


def _of_study(
    table: "pyarrow.Table", study: StudyFile | None, store: Store
) -> tuple["pyarrow.Table", str, tuple[str, ...]]:
    """The rows of one study, its name, and whose rows were left out."""
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


def _wanted(study: StudyFile | None, cells: Iterable[CellRows]) -> list[Place]:
    """The study's cells; of scenes that it gives by path, those of which there is any."""
    if study is None:
        return []
    named = [scene for scene in study.scenes if "/" not in scene and not scene.endswith(".toml")]
    scenes = list(dict.fromkeys([*named, *(cell.scene for cell in cells)]))
    return [(variant.scene, *variant.labels) for variant in variants(study, scenes)]


def check_distinct(cells: Iterable[CellRows], store: Store) -> None:
    """Raises InputError where a cell has a seed twice: its rows could not be paired."""
    for cell in cells:
        twice = cell.seeds[1:][np.diff(cell.seeds) == 0]
        if twice.size:
            raise InputError(
                f"{store.folder}: scene {cell.scene}, setting {cell.setting}, method {cell.method} has seed {twice[0]} "
                "under two scenarios: the study was changed between sweeps; sweep it into a folder of its own with -o"
            )
