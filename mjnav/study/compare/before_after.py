"""Two folders of results compared: for each cell in both, which seeds ended otherwise and how the figures changed.

A cell is a scene under a setting and a method. It is a table of two rows, before and after, of the seeds that both
folders have: differences, intervals and p-values are those of `study_comparison`, but with Holm's correction over the
cells, each figure by itself. `changed` is what differs between the folders as their rows recorded it: scenes,
parameters, programs, processor.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mjnav.errors import InputError
from mjnav.study.cells import Labels
from mjnav.study.compare import cell_rows
from mjnav.study.compare.cell_rows import CellPlace, CellRows
from mjnav.study.compare.estimates import common
from mjnav.study.compare.study_comparison import NEEDED, Comparison, MethodRow, check_distinct, compare, corrected_rows
from mjnav.study.store import Store, check_own
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.sweep import KeyChange, what_changed

BEFORE, AFTER = "before", "after"
BETTER, WORSE, OTHER = KINDS = "better", "worse", "other"
FAILED = "failed"  # the outcome of an episode without a result
TEXTS = ("outcome", "error", "state_hash", "log")


@dataclass(frozen=True, slots=True)
class SeedChange:
    """A seed that ended otherwise: "goal" before, "collision" after."""

    seed: int
    before: str
    after: str
    kind: str  # BETTER: a success after only; WORSE: before only; OTHER: another failure
    before_log: str | None  # as their rows name them
    after_log: str | None


@dataclass(frozen=True, slots=True)
class CellChange:
    """One cell in both folders."""

    place: CellPlace
    labels: CellPlace  # the same as people read them
    num_before: int  # rows
    num_after: int
    identical: int  # pairs with the same state hash
    seeds: tuple[SeedChange, ...]  # ascending
    table: Comparison  # of the common seeds before and after

    @property
    def before(self) -> MethodRow:
        """The figures before."""
        return self.table.rows[0]

    @property
    def after(self) -> MethodRow:
        """The figures after, and the differences after - before, with Holm's correction over all cells."""
        return self.table.rows[1]

    @property
    def pairs(self) -> int:
        """Seeds in both."""
        return self.before.num

    def seeds_of(self, kind: str) -> tuple[SeedChange, ...]:
        """The seeds that changed in this way."""
        return tuple(seed for seed in self.seeds if seed.kind == kind)


@dataclass(frozen=True, slots=True)
class BeforeAfter:
    """Everything that two folders of results say about each other."""

    before: str  # the folders
    after: str
    cells: tuple[CellChange, ...]
    changed: tuple[KeyChange, ...]  # what the cells' rows were made with
    only_before: tuple[CellPlace, ...]
    only_after: tuple[CellPlace, ...]
    labels: Labels  # of a study file

    def num_seeds(self, kind: str) -> int:
        """How many seeds changed in this way."""
        return sum(len(cell.seeds_of(kind)) for cell in self.cells)

    def __repr__(self) -> str:
        return (
            f"BeforeAfter({self.before!r}, {self.after!r}: {sum(cell.pairs for cell in self.cells)} pairs, "
            f"{self.num_seeds(BETTER)} better, {self.num_seeds(WORSE)} worse)"
        )


def before_after(
    before: Store,
    after: Store,
    *,
    figures: Sequence[str] = cell_rows.DEFAULT_FIGURES,
    study: StudyFile | None = None,
) -> BeforeAfter:
    """Compares the cells that two stores share; the rates are always among the figures. Labels are those of `study`.

    Raises InputError where they have no seed of a cell in common, InvalidValue for an unknown figure, MjnavError where
    a shard is damaged.
    """
    figures = cell_rows.expanded(figures)
    cell_rows.check_figures(figures)
    if before.folder.resolve() == after.folder.resolve():
        raise InputError(f"{before.folder} and {after.folder} are the same folder")
    was, now = _cells(before, figures), _cells(after, figures)
    labels = Labels.of(study)
    shared = [place for place in was if place in now and len(common(was[place], now[place])[0])]
    if not shared:
        raise InputError(f"{before.folder} and {after.folder} have no episode in common")
    cells = [_cell_change(was[place], now[place], figures, labels) for place in shared]
    corrected = corrected_rows([cell.after for cell in cells])
    return BeforeAfter(
        before=str(before.folder),
        after=str(after.folder),
        cells=tuple(
            replace(cell, table=replace(cell.table, rows=(cell.before, row)))
            for cell, row in zip(cells, corrected, strict=True)
        ),
        changed=what_changed(before, after, shared),
        only_before=tuple(place for place in was if place not in now),
        only_after=tuple(place for place in now if place not in was),
        labels=labels,
    )


def _cells(store: Store, figures: Sequence[str]) -> dict[CellPlace, CellRows]:
    """The cells of a folder. Raises InputError, InvalidValue, MjnavError."""
    columns = dict.fromkeys((*NEEDED, cell_rows.WIN_BY, *TEXTS, *cell_rows.columns_for(figures)))
    cells = cell_rows.cell_rows(store.rows(list(columns)))
    check_distinct(cells, store)
    check_own(figures, cells[0].columns)
    return {cell.place: cell for cell in cells}


def _cell_change(base: CellRows, cell: CellRows, figures: Sequence[str], labels: Labels) -> CellChange:
    here, there = common(cell, base)
    was, now = replace(base.taken(there), method=BEFORE), replace(cell.taken(here), method=AFTER)
    changes = []
    for i, ends in enumerate(zip(_outcomes(was), _outcomes(now), strict=True)):
        if ends[0] != ends[1]:
            gain = (now.columns["success"][i] == 1) - int(was.columns["success"][i] == 1)
            kind = BETTER if gain > 0 else WORSE if gain < 0 else OTHER
            changes.append(SeedChange(int(was.seeds[i]), *ends, kind, was.texts["log"][i], now.texts["log"][i]))
    hashes = zip(was.texts["state_hash"], now.texts["state_hash"], strict=True)
    return CellChange(
        cell.place,
        labels.place(cell.place),
        num_before=len(base.seeds),
        num_after=len(cell.seeds),
        identical=sum(old is not None and old == new for old, new in hashes),
        seeds=tuple(changes),
        table=next(compare([was, now], reference=BEFORE, figures=figures)),
    )


def _outcomes(cell: CellRows) -> list[str]:
    """How each episode ended."""
    ends = zip(cell.texts["outcome"], cell.texts["error"], cell.columns["success"], strict=True)
    return [
        FAILED
        if error is not None or outcome is None
        else f"{outcome} after contact"
        if outcome == "goal" and success != 1
        else outcome
        for outcome, error, success in ends
    ]
