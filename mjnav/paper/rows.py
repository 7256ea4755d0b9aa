"""The episodes that the paper's items rest on, and their rows.

All studies share one store and take turns, seed by seed: a run that is interrupted has every cell equally often.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.paper import ITEMS, module
from mjnav.study.cells import Cell, resolve
from mjnav.study.compare.compare import CellRows, cell_rows
from mjnav.study.compare.study_comparison import check_distinct
from mjnav.study.store.row import COLUMNS, PLACE_IN_STUDY
from mjnav.study.store.store import Store
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


@dataclass(frozen=True, slots=True)
class ItemRows:
    """The rows that an item rests on, and what of them is not there."""

    cells: list[CellRows]
    asked: int  # episodes of its studies
    absent: tuple[str, ...]  # cells without any row
    left_out: int  # rows of its studies under other scenarios or seeds than are asked for

    @property
    def num(self) -> int:
        """Episodes that were run, failed ones too."""
        return sum(len(cell.seeds) for cell in self.cells)

    @property
    def num_failed(self) -> int:
        """Of them, those without a result."""
        return sum(int(cell.failed.sum()) for cell in self.cells)


def rows(store: Store, wanted: Sequence[PaperStudy], names: Sequence[str]) -> ItemRows:
    """The rows of the studies called `names`, of their present cells and seeds alone, methods in the files' order.

    Raises InputError where a cell has a seed twice.
    """
    table = store.rows(list(COLUMNS))
    keys = list(zip(*(table[name].to_pylist() for name in (*PLACE_IN_STUDY, "scenario")), strict=True))
    table = table.drop_columns(["scenario"])
    found, absent, num_asked, left_out = [], [], 0, 0
    for study in wanted:
        name = study.file.name
        if name not in names:
            continue
        asked = {
            (*Trial(name, cell, seed).place, cell.document) for cell in study.cells for seed in study.file.all_seeds
        }
        cells = cell_rows(
            table.filter(np.array([key in asked for key in keys], bool)),
            [method.label for method in study.file.methods],
        )
        check_distinct(cells, store)
        there = {(cell.scene, cell.setting, cell.method) for cell in cells}
        found += cells
        absent += [cell.label for cell in study.cells if (cell.scene, cell.setting, cell.method) not in there]
        num_asked += len(asked)
        left_out += sum(key[0] == name and key not in asked for key in keys)
    return ItemRows(found, num_asked, tuple(absent), left_out)
