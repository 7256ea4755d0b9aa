"""Two folders of results compared: for each cell in both, which seeds ended otherwise and how the figures changed.

A cell is a scene under a setting and a method. It is a table of two rows, before and after, of the seeds that both
folders have: differences, intervals and p-values are those of `study_comparison`, but with Holm's correction over the
cells, each figure by itself.

`what_changed` lists what differs between the folders as their rows recorded it: scenes, parameters, programs,
processor.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from mjnav.errors import InputError
from mjnav.loop.provenance import FACTS, OWN_SOURCES, SOURCES, shown
from mjnav.study.cells import Labels
from mjnav.study.compare.cell_rows import CellPlace, CellRows, cell_rows
from mjnav.study.compare.chosen_figures import (
    DEFAULT_FIGURES,
    WIN_BY,
    check_figures,
    columns_for,
    expanded,
)
from mjnav.study.compare.estimates import common
from mjnav.study.compare.study_comparison import (
    NEEDED,
    Comparison,
    MethodRow,
    check_distinct,
    compare,
    corrected_rows,
)
from mjnav.study.store.row import check_own
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import RowOrigin, content, origins, value_text

# --------------------------------------------------------------------------------------- what changed


DIGEST = 12  # characters of a digest of sources that are shown


@dataclass(frozen=True, slots=True)
class KeyChange:
    """One thing that differs: a key of the run file, a parameter, a package, the processor."""

    what: str
    before: str
    after: str
    cells: int  # in how many of the compared cells


def what_changed(before: Store, after: Store, cells: Iterable[CellPlace]) -> tuple[KeyChange, ...]:
    """What differs in these cells, which both stores have; keys of the scenario first.

    Raises MjnavError where a shard is damaged.
    """
    by_cell: tuple[dict[CellPlace, list[RowOrigin]], ...] = ({}, {})
    for side, store in zip(by_cell, (before, after), strict=True):
        for origin in origins(store):
            side.setdefault(origin.cell[1:], []).append(origin)
    keys: Counter[tuple[str, str, str]] = Counter()
    facts: Counter[tuple[str, str, str]] = Counter()
    for cell in cells:
        sides = [side[cell] for side in by_cell]
        keys.update(_scenario(sides))
        facts.update(_facts(sides))
    return tuple(KeyChange(*change, num) for changes in (keys, facts) for change, num in changes.items())


def _scenario(sides: Sequence[Sequence[RowOrigin]]) -> Iterator[tuple[str, str, str]]:
    """The keys of the run file whose values are not those of the other side."""
    recorded = all(origin.control is not None for side in sides for origin in side)
    tables = [
        [
            content(*written)
            for written in dict.fromkeys((origin.scenario, origin.control if recorded else None) for origin in side)
        ]
        for side in sides
    ]
    for key in dict.fromkeys(key for side in tables for table in side for key in table):
        yield from _difference(key, [[value_text(table, key) for table in side] for side in tables])


def _facts(sides: Sequence[Sequence[RowOrigin]]) -> Iterator[tuple[str, str, str]]:
    """The programs and processors that are not those of the other side."""
    for fact, (name, _) in FACTS.items():
        values = [[origin.made_with[fact] for origin in side] for side in sides]
        if set(values[0]) != set(values[1]):
            texts = shown(fact, {value or "" for side in values for value in side})
            yield from _difference(name, [[_fact_text(fact, value, texts) for value in side] for side in values])


def _fact_text(fact: str, value: str | None, texts: Mapping[str, str]) -> str:
    if value is None:
        return "not recorded"
    text = texts[value] or "unknown"
    if fact == SOURCES:
        return text[:DIGEST]
    if fact == OWN_SOURCES:
        return " ".join(word[:DIGEST] if len(word) == 64 else word for word in text.split())
    return text


def _difference(what: str, sides: Sequence[Sequence[str]]) -> Iterator[tuple[str, str, str]]:
    was, now = (dict.fromkeys(side) for side in sides)
    if was.keys() != now.keys():
        yield what, " or ".join(was), " or ".join(now)


# ----------------------------------------------------------------------------- cells before and after


BEFORE, AFTER = "before", "after"
BETTER, WORSE, OTHER = KINDS = "better", "worse", "other"
FAILED = "failed"  # the outcome of an episode without a result
MAX_NAMED = 5  # cells in a message
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

    scene: str
    setting: str
    method: str
    labels: CellPlace  # the same as people read them
    num_before: int  # rows
    num_after: int
    identical: int  # pairs with the same state hash
    seeds: tuple[SeedChange, ...]  # ascending
    table: Comparison  # of the common seeds before and after

    @property
    def place(self) -> CellPlace:
        """Scene, setting and method."""
        return self.scene, self.setting, self.method

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

    def named(self, kind: str) -> tuple[SeedChange, ...]:
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
        return sum(len(cell.named(kind)) for cell in self.cells)

    def __repr__(self) -> str:
        return (
            f"BeforeAfter({self.before!r}, {self.after!r}: {sum(cell.pairs for cell in self.cells)} pairs, "
            f"{self.num_seeds(BETTER)} better, {self.num_seeds(WORSE)} worse)"
        )


def before_after(
    before: Store,
    after: Store,
    *,
    figures: Sequence[str] = DEFAULT_FIGURES,
    study: StudyFile | None = None,
) -> BeforeAfter:
    """Compares the cells that two stores share; the rates are always among the figures. Labels are those of `study`.

    Raises InputError where they have no seed of a cell in common, InvalidValue for an unknown figure, MjnavError where
    a shard is damaged.
    """
    figures = expanded(figures)
    check_figures(figures)
    if before.folder.resolve() == after.folder.resolve():
        raise InputError(f"{before.folder} and {after.folder} are the same folder")
    was, now = _cells(before, figures), _cells(after, figures)
    shared = [place for place in was if place in now]
    labels = Labels.of(study)
    cells = [
        _cell_change(was[place], now[place], figures, labels)
        for place in shared
        if len(common(was[place], now[place])[0])
    ]
    if not cells:
        raise InputError(f"{before.folder} and {after.folder} have no episode in common: {_apart(shared, was, now)}")
    corrected = corrected_rows([cell.after for cell in cells])
    return BeforeAfter(
        before=str(before.folder),
        after=str(after.folder),
        cells=tuple(
            replace(cell, table=replace(cell.table, rows=(cell.before, row)))
            for cell, row in zip(cells, corrected, strict=True)
        ),
        changed=what_changed(before, after, [cell.place for cell in cells]),
        only_before=tuple(place for place in was if place not in now),
        only_after=tuple(place for place in now if place not in was),
        labels=labels,
    )


def _cells(store: Store, figures: Sequence[str]) -> dict[CellPlace, CellRows]:
    """The cells of a folder. Raises InputError, InvalidValue, MjnavError."""
    needed = [name for name in NEEDED if name != "study"]
    cells = cell_rows(store.rows(list(dict.fromkeys((*needed, WIN_BY, *TEXTS, *columns_for(figures))))))
    check_distinct(cells, store)
    check_own(figures, cells[0].columns)
    return {cell.place: cell for cell in cells}


def _cell_change(base: CellRows, cell: CellRows, figures: Sequence[str], labels: Labels) -> CellChange:
    here, there = common(cell, base)
    was, now = base.taken(there), cell.taken(here)
    sides = [replace(was, method=BEFORE), replace(now, method=AFTER)]
    changes = []
    for i, ends in enumerate(zip(_outcomes(was), _outcomes(now), strict=True)):
        if ends[0] != ends[1]:
            gain = (now.columns["success"][i] == 1) - int(was.columns["success"][i] == 1)
            kind = BETTER if gain > 0 else WORSE if gain < 0 else OTHER
            changes.append(SeedChange(int(was.seeds[i]), *ends, kind, was.texts["log"][i], now.texts["log"][i]))
    hashes = zip(was.texts["state_hash"], now.texts["state_hash"], strict=True)
    return CellChange(
        *cell.place,
        labels=labels.place(cell.place),
        num_before=len(base.seeds),
        num_after=len(cell.seeds),
        identical=sum(old is not None and old == new for old, new in hashes),
        seeds=tuple(changes),
        table=next(compare(sides, reference=BEFORE, figures=figures)),
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


def _apart(shared: Sequence[CellPlace], was: Mapping[CellPlace, CellRows], now: Mapping[CellPlace, CellRows]) -> str:
    """Why two folders have no episode in common."""
    if shared:
        ranges = [f"{min(side[shared[0]].seeds)} to {max(side[shared[0]].seeds)}" for side in (was, now)]
        return f"{named(shared[:1])} has the seeds {ranges[0]} before, {ranges[1]} after"
    return f"before has {named(was)}; after has {named(now)}"


def named(places: Iterable[CellPlace]) -> str:
    """Some cells in a message."""
    texts = [" / ".join(place) for place in places]
    more = f" and {len(texts) - MAX_NAMED} more" if len(texts) > MAX_NAMED else ""
    return ", ".join(texts[:MAX_NAMED]) + more
