"""The runs that the items rest on: the episodes of studies, their rows, and decisions that are taken again.

All studies share one store and take turns, seed by seed: where a run is interrupted, every cell has as many episodes.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from mjnav.loop.provenance import revision
from mjnav.paper.claims import Item, StudyItem
from mjnav.scene.spec import Scenario
from mjnav.study.cells import Cell, resolve
from mjnav.study.compare.cell_rows import CellRows, cell_rows
from mjnav.study.compare.estimates import estimate
from mjnav.study.compare.study_comparison import check_distinct
from mjnav.study.store import COLUMNS, PLACE_IN_STUDY, Store
from mjnav.study.study_file import StudyFile, load_study, study_text
from mjnav.study.sweep.sweep import trials as trials_of
from mjnav.study.trial import Trial

T = TypeVar("T")
CLASS = "mjnav.control.methods.rkhs:Rkhs"  # with the class's defaults: what tuning found belongs to the name `rkhs`
# The paper's samples, as `--set` takes them: a reading less draws of its noise, in place of a particle filter's.
DIRECT = (f"control.method={CLASS}", "estimation.robot.source=direct", "estimation.obstacles.source=direct")


@dataclass(frozen=True, slots=True)
class Basis:
    """What an item's findings rest on: the numbers are of episodes, 0 of a measurement."""

    command: str
    parameters: Mapping[str, str] = field(default_factory=dict)  # texts by title
    revision: str = field(default_factory=revision)
    asked_for: int = 0
    episodes: int = 0
    failed: int = 0
    left_out: int = 0  # rows of other scenarios or seeds
    absent: Sequence[str] = ()  # cells without any episode

    def __str__(self) -> str:
        episodes = f"; {self.episodes} episodes" if self.asked_for else ""
        return f"{self.command}; revision {self.revision}{episodes}"

    @property
    def gaps(self) -> list[str]:
        """What of the item's episodes is missing, in sentences."""
        sentences = (
            (self.episodes < self.asked_for, f"{self.episodes} of {self.asked_for} episodes were run."),
            (self.failed, f"{self.failed} episodes failed and have no result."),
            (self.left_out, f"{self.left_out} rows are left out: they are of other scenarios or seeds."),
            (self.absent, f"{len(self.absent)} cells were not run at all: {'; '.join(self.absent)}."),
        )
        return [sentence for applies, sentence in sentences if applies]


@dataclass(frozen=True, slots=True)
class PaperStudy:
    """A study and its cells."""

    file: StudyFile
    cells: tuple[Cell, ...]


def studies(items: Iterable[Item], seeds: int | None = None) -> tuple[PaperStudy, ...]:
    """The studies of these items, each once, with `seeds` seeds in place of their own. Raises InvalidValue."""
    names = dict.fromkeys(name for item in items if isinstance(item, StudyItem) for name in item.studies)
    files = [load_study(name) if seeds is None else load_study(name).with_seeds(seeds) for name in names]
    return tuple(PaperStudy(file, resolve(file)) for file in files)


def trials(wanted: Sequence[PaperStudy]) -> list[Trial]:
    """Every cell's first seed, then every cell's second, ..."""
    every = [trial for study in wanted for trial in trials_of(study.file, study.cells)]
    return sorted(every, key=lambda trial: trial.seed)


def rows(store: Store, wanted: Sequence[PaperStudy], command: str = "") -> tuple[list[CellRows], Basis]:
    """The rows of these studies, of their present cells and seeds alone, methods in the studies' order.

    Raises InputError where a cell has a seed twice.
    """
    table = store.rows(list(COLUMNS))
    keys = list(zip(*(table[name].to_pylist() for name in (*PLACE_IN_STUDY, "scenario")), strict=True))
    table = table.drop_columns(["scenario"])
    cells: list[CellRows] = []
    absent, num_asked, left_out = [], 0, 0
    for study in wanted:
        asked = {(*trial.place, trial.cell.document) for trial in trials([study])}
        methods = [method.identifier for method in study.file.methods]
        of_study = cell_rows(table.filter(np.array([key in asked for key in keys], bool)), methods)
        check_distinct(of_study, store)
        run = {(cell.scene, cell.setting, cell.method) for cell in of_study}
        cells += of_study
        absent += [cell.label for cell in study.cells if (cell.scene, cell.setting, cell.method) not in run]
        num_asked += len(asked)
        left_out += sum(key[0] == study.file.name and key not in asked for key in keys)
    return cells, Basis(
        command,
        {study.file.name: study_text(study.file) for study in wanted},
        asked_for=num_asked,
        episodes=sum(len(cell.seeds) for cell in cells),
        failed=sum(int(cell.failed.sum()) for cell in cells),
        left_out=left_out,
        absent=absent,
    )


def table_of(cells: Iterable[CellRows]) -> list[dict[str, Any]]:
    """Every numeric figure of every cell with its interval and number of seeds, one a row."""
    names = ["collision", *(name for name, column in COLUMNS.items() if column.type != "string" and name != "seed")]
    table = []
    for cell in cells:
        place = {"scene": cell.scene, "setting": cell.setting, "method": cell.method}
        for name in names:
            e = estimate(cell, name)
            if e.num:
                low, high = e.interval or (None, None)
                table.append({**place, "figure": name, "mean": e.value, "low": low, "high": high, "seeds": e.num})
    return table


def changed(scenario: Scenario, method: str, **parameters: Any) -> Scenario:
    """The scenario under another method or parameters; its own parameters stay with its own method."""
    control = scenario.control
    kept = control.parameters if control.method == method else {}
    return replace(scenario, control=replace(control, method=method, parameters={**kept, **parameters}))


def spread(values: Sequence[T], num: int) -> Iterator[T]:
    """At most `num` of the values, evenly spaced, the first and the last included."""
    for i in dict.fromkeys(np.linspace(0, len(values) - 1, num).round().astype(int).tolist() if values else ()):
        yield values[i]
