"""The episodes that the paper's items rest on, and their rows.

All studies share one store and take turns, seed by seed: a run that is interrupted has every cell equally often.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from mjnav.study.cells import Cell, resolve
from mjnav.study.compare import CellRows, cell_rows
from mjnav.study.paper import ITEMS, module
from mjnav.study.row import COLUMNS, PLACE_IN_STUDY
from mjnav.study.store import Store
from mjnav.study.study_file import StudyFile, load_study
from mjnav.study.trial import Trial


@dataclass(frozen=True, slots=True)
class PaperStudy:
    """A study file and its cells."""

    file: StudyFile
    cells: tuple[Cell, ...]


def studies(names: Iterable[str], seeds: int | None = None) -> tuple[PaperStudy, ...]:
    """The studies of these items, each once, with `seeds` seeds in place of their own. Raises InvalidValue."""
    files = dict.fromkeys(study for name in names if ITEMS[name].is_sweep for study in module(name).STUDIES)
    found = []
    for name in files:
        file = load_study(name)
        file = file if seeds is None else file.with_seeds(seeds)
        found.append(PaperStudy(file, resolve(file)))
    return tuple(found)


def trials(wanted: Sequence[PaperStudy]) -> list[Trial]:
    """Every cell's first seed, then every cell's second, ..."""
    most = max((len(study.file.all_seeds) for study in wanted), default=0)
    return [
        Trial(study.file.name, cell, study.file.all_seeds[k])
        for k in range(most)
        for study in wanted
        if k < len(study.file.all_seeds)
        for cell in study.cells
    ]


def rows(store: Store, wanted: Sequence[PaperStudy], names: Sequence[str]) -> list[CellRows]:
    """The rows of the studies called `names`, of their present cells and seeds alone, methods in the files' order."""
    import pyarrow as pa

    table = store.rows(list(COLUMNS))
    same = [*PLACE_IN_STUDY, "scenario"]
    keys = list(zip(*(table[name].to_pylist() for name in same), strict=True))
    table = table.drop_columns(["scenario"])
    found: list[CellRows] = []
    for study in wanted:
        if study.file.name in names:
            asked = {
                (*trial.place, trial.cell.document)
                for trial in (
                    Trial(study.file.name, cell, seed) for cell in study.cells for seed in study.file.all_seeds
                )
            }
            of_study = table.filter(pa.array([key in asked for key in keys], pa.bool_()))
            found += cell_rows(of_study, [method.label for method in study.file.methods])
    return found
