"""Two folders of results compared: for each cell in both, which seeds ended otherwise and how the figures changed.

A cell is a scene under a setting and a method. All is paired by seed: the differences after - before, with paired
bootstrap intervals and p-values (rates: McNemar's exact test), are those of `compare`, with Holm's correction over the
cells, each figure by itself.

`what_changed` lists what differs between the folders as their rows recorded it: scenes, parameters, programs,
processor.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InputError
from mjnav.loop.provenance import FACTS, OWN_SOURCES, SOURCES, shown
from mjnav.metrics.intervals import holm
from mjnav.study.cells import Labels
from mjnav.study.compare.cell_rows import CellRows, cell_rows
from mjnav.study.compare.chosen_figures import (
    DEFAULT_FIGURES,
    PEOPLE,
    RATES,
    WIN_BY,
    check_figures,
    columns_for,
    expanded,
)
from mjnav.study.compare.compare import MethodRow, compare
from mjnav.study.compare.estimates import common, corrected
from mjnav.study.compare.result_tables import html_table, percent
from mjnav.study.compare.study_comparison import DECISION, NEEDED, check_distinct
from mjnav.study.store.row import PLACE_IN_STUDY, check_own
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import RowOrigin, content, origins, value_text

# --------------------------------------------------------------------------------------- what changed


DIGEST = 12  # characters of a digest of sources that are shown

CellPlace = tuple[str, str, str]  # scene, setting and method


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
    was, now = _by_cell(before), _by_cell(after)
    keys: Counter[tuple[str, str, str]] = Counter()
    facts: Counter[tuple[str, str, str]] = Counter()
    for cell in cells:
        keys.update(_scenario(was[cell], now[cell]))
        facts.update(_facts(was[cell], now[cell]))
    return tuple(KeyChange(*change, num) for found in (keys, facts) for change, num in found.items())


def _by_cell(store: Store) -> dict[CellPlace, list[RowOrigin]]:
    found: dict[CellPlace, list[RowOrigin]] = {}
    for origin in origins(store):
        found.setdefault(origin.cell[1:], []).append(origin)
    return found


def _scenario(was: Sequence[RowOrigin], now: Sequence[RowOrigin]) -> Iterator[tuple[str, str, str]]:
    recorded = all(origin.control is not None for origin in (*was, *now))
    tables = [_contents(side, with_control=recorded) for side in (was, now)]
    for key in dict.fromkeys(key for side in tables for table in side for key in table):
        yield from _difference(key, *({value_text(table, key): None for table in side} for side in tables))


def _contents(side: Sequence[RowOrigin], *, with_control: bool) -> list[dict[str, object]]:
    different = dict.fromkeys((origin.scenario, origin.control if with_control else None) for origin in side)
    return [content(document, control) for document, control in different]


def _facts(was: Sequence[RowOrigin], now: Sequence[RowOrigin]) -> Iterator[tuple[str, str, str]]:
    for fact, (name, _) in FACTS.items():
        sides = [{origin.made_with[fact]: None for origin in side} for side in (was, now)]
        if sides[0].keys() == sides[1].keys():
            continue
        texts = shown(fact, {value or "" for side in sides for value in side})
        yield from _difference(name, *({_fact_text(fact, value, texts): None for value in side} for side in sides))


def _fact_text(fact: str, value: str | None, texts: Mapping[str, str]) -> str:
    if value is None:
        return "not recorded"
    text = texts[value] or "unknown"
    if fact == SOURCES:
        return text[:DIGEST]
    if fact == OWN_SOURCES:
        return " ".join(word[:DIGEST] if len(word) == 64 else word for word in text.split())
    return text


def _difference(what: str, was: Mapping[str, None], now: Mapping[str, None]) -> Iterator[tuple[str, str, str]]:
    if was.keys() != now.keys():
        yield what, " or ".join(was), " or ".join(now)


# ----------------------------------------------------------------------------- cells before and after


BEFORE, AFTER = "before", "after"
BETTER, WORSE, OTHER = "better", "worse", "other"
FAILED = "failed"  # the outcome of an episode without a result
MAX_NAMED = 5  # cells in a message
_TEXTS = ("outcome", "error", "state_hash", "log")


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
    num_before: int  # rows
    num_after: int
    pairs: int  # seeds in both
    identical: int  # of them, those with the same state hash
    seeds: tuple[SeedChange, ...]  # ascending
    before: MethodRow  # the figures over the common seeds
    after: MethodRow  # and the differences after - before, with Holm's correction over all cells
    people: tuple[str, ...]  # how many people see the robot: the values of both folders' rows, each once

    def named(self, kind: str) -> tuple[SeedChange, ...]:
        """The seeds that changed in this way."""
        return tuple(seed for seed in self.seeds if seed.kind == kind)


@dataclass(frozen=True, slots=True)
class BeforeAfter:
    """Everything that two folders of results say about each other."""

    before: str  # the folders
    after: str
    figures: tuple[str, ...]  # beside the rates
    cells: tuple[CellChange, ...]
    changed: tuple[KeyChange, ...]  # what the cells' rows were made with
    only_before: tuple[CellPlace, ...]
    only_after: tuple[CellPlace, ...]
    labels: Labels = field(default_factory=Labels)  # of a study file

    @property
    def labelled(self) -> "BeforeAfter":
        """The same for people to read: with labels in the place of names."""
        cells = [(cell, self.labels.place((cell.scene, cell.setting, cell.method))) for cell in self.cells]
        return replace(
            self,
            cells=tuple(replace(cell, setting=setting, method=method) for cell, (_, setting, method) in cells),
            only_before=tuple(map(self.labels.place, self.only_before)),
            only_after=tuple(map(self.labels.place, self.only_after)),
            labels=Labels(),
        )

    def __repr__(self) -> str:
        seeds = Counter(seed.kind for cell in self.cells for seed in cell.seeds)
        return (
            f"BeforeAfter({self.before!r}, {self.after!r}: {sum(cell.pairs for cell in self.cells)} pairs, "
            f"{seeds[BETTER]} better, {seeds[WORSE]} worse)"
        )

    def _repr_html_(self) -> str:
        """How many seeds of each cell changed, as notebooks show it."""
        heads = ("scene", "setting", "method", "pairs", "identical", "better", "worse", "success %: after - before")
        rows = [
            (
                *(cell.scene, cell.setting, cell.method, cell.pairs, cell.identical),
                *(len(cell.named(kind)) for kind in (BETTER, WORSE)),
                percent(cell.after.differences["success"].estimate, signed=True),
            )
            for cell in self.labelled.cells
        ]
        return html_table(f"{self.before} and {self.after}", heads, rows)


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
    was, now = _read(before, figures), _read(after, figures)
    places = [place for place in was.cells if place in now.cells]
    paired = [place for place in places if len(common(was.cells[place], now.cells[place])[0])]
    cells = [_change(was, now, place, figures) for place in paired]
    if not cells:
        raise InputError(_nothing_common(before, after, places, was, now))
    return BeforeAfter(
        before=str(before.folder),
        after=str(after.folder),
        figures=figures,
        cells=tuple(_corrected(cells, (*RATES, *figures))),
        changed=what_changed(before, after, [(cell.scene, cell.setting, cell.method) for cell in cells]),
        only_before=tuple(place for place in was.cells if place not in now.cells),
        only_after=tuple(place for place in now.cells if place not in was.cells),
        labels=Labels.of(study),
    )


@dataclass(frozen=True, slots=True)
class _Side:
    """The rows of one folder."""

    cells: Mapping[CellPlace, CellRows]
    texts: Mapping[tuple[CellPlace, int], tuple[str | None, ...]]  # the values of _TEXTS


def _read(store: Store, figures: Sequence[str]) -> _Side:
    labels = ("scene", "setting", "method", "seed")
    numbers = [
        name
        for name in dict.fromkeys((*NEEDED, PEOPLE, *DECISION, WIN_BY, *columns_for(figures)))
        if name not in PLACE_IN_STUDY
    ]
    table = store.rows([*labels, *numbers, *_TEXTS])
    rows = cell_rows(table.select([*labels, *numbers]))
    check_distinct(rows, store)
    check_own(figures, rows[0].columns)
    columns = (table[name].to_pylist() for name in (*labels, *_TEXTS))
    texts = {
        ((scene, setting, method), seed): tuple(own)
        for scene, setting, method, seed, *own in zip(*columns, strict=True)
    }
    return _Side({(cell.scene, cell.setting, cell.method): cell for cell in rows}, texts)


def _change(was: _Side, now: _Side, place: CellPlace, figures: Sequence[str]) -> CellChange:
    base, cell = was.cells[place], now.cells[place]
    here, there = common(cell, base)
    first, second = _subset(base, there), _subset(cell, here)
    labelled = [replace(rows, method=name) for rows, name in ((first, BEFORE), (second, AFTER))]
    table = next(compare(labelled, reference=BEFORE, figures=figures))
    seeds = [int(seed) for seed in first.seeds]
    changes, identical = [], 0
    for i, seed in enumerate(seeds):
        old, new = was.texts[place, seed], now.texts[place, seed]
        identical += old[2] is not None and old[2] == new[2]
        ends = [_outcome(rows.columns["success"][i], text) for rows, text in ((first, old), (second, new))]
        if ends[0] != ends[1]:
            gain = (second.columns["success"][i] == 1) - int(first.columns["success"][i] == 1)
            kind = BETTER if gain > 0 else WORSE if gain < 0 else OTHER
            changes.append(SeedChange(seed, ends[0], ends[1], kind, old[3], new[3]))
    return CellChange(
        *place,
        num_before=len(base.seeds),
        num_after=len(cell.seeds),
        pairs=len(seeds),
        identical=identical,
        seeds=tuple(changes),
        before=table.rows[0],
        after=table.rows[1],
        people=table.people,
    )


def _subset(cell: CellRows, places: NDArray[np.intp]) -> CellRows:
    columns = {name: column[places] for name, column in cell.columns.items()}
    return replace(cell, columns=columns, layout_by_row=(), units=cell.units_of(places))


def _outcome(success: float, texts: tuple[str | None, ...]) -> str:
    outcome = texts[0]
    if texts[1] is not None or outcome is None:
        return FAILED
    return f"{outcome} after contact" if outcome == "goal" and success != 1 else outcome


def _corrected(cells: Sequence[CellChange], figures: Sequence[str]) -> list[CellChange]:
    """The cells with Holm's correction of each figure's p-values over all of them."""
    found = [dict(cell.after.differences) for cell in cells]
    for figure in figures:
        known = [(own, p) for own in found if (p := own[figure].p) is not None]
        for (own, _), p in zip(known, holm([p for _, p in known]), strict=True):
            own[figure] = replace(own[figure], p=p)
    wins = iter(corrected([cell.after.wins for cell in cells if cell.after.wins is not None]))
    return [
        replace(cell, after=replace(cell.after, differences=own, wins=next(wins) if cell.after.wins else None))
        for cell, own in zip(cells, found, strict=True)
    ]


def _nothing_common(before: Store, after: Store, places: Sequence[CellPlace], was: _Side, now: _Side) -> str:
    where = f"{before.folder} and {after.folder} have no episode in common"
    if places:
        ranges = [f"{min(side.cells[places[0]].seeds)} to {max(side.cells[places[0]].seeds)}" for side in (was, now)]
        return f"{where}: {_named(places[:1])} has the seeds {ranges[0]} before, {ranges[1]} after"
    return f"{where}: before has {_named(was.cells)}; after has {_named(now.cells)}"


def _named(places: Sequence[CellPlace] | Mapping[CellPlace, CellRows]) -> str:
    texts = [" / ".join(place) for place in places]
    more = f" and {len(texts) - MAX_NAMED} more" if len(texts) > MAX_NAMED else ""
    return ", ".join(texts[:MAX_NAMED]) + more
