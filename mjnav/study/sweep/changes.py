"""What rows were made with, and what differs: before a sweep adds rows to others, in a table, and between folders."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.loop.provenance import FACTS, OWN_SOURCES, SOURCES, changes, shown
from mjnav.scene.toml import parse
from mjnav.study.store.row import CELL, MADE_WITH
from mjnav.study.store.store import Store
from mjnav.study.trial import Trial, made_with

MAX_LISTED = 12  # changes in one message
MAX_LENGTH = 60  # characters of a value
DIGEST = 12  # characters of the digest of mjnav's sources that are shown
UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class RowOrigin:
    """What `count` rows were made with."""

    cell: tuple[str, str, str, str]  # the values of `row.CELL`
    controller: str
    scenario: str  # the run file
    control: str  # JSON; "" where it was not recorded
    made_with: Mapping[str, str | None]  # by fact of `loop.provenance`; None where it was not recorded
    count: int


@dataclass(frozen=True, slots=True)
class Inconsistency:
    """Something that is not the same in all rows: how many rows have which value of it."""

    what: str
    rows: Mapping[str, int]

    def __str__(self) -> str:
        return f"{self.what}: {', '.join(f'{value} in {_rows(count)}' for value, count in self.rows.items())}"


@dataclass(frozen=True, slots=True)
class KeyChange:
    """One thing that differs between two folders: a key of the run file, a parameter, a package, the processor."""

    what: str
    before: str
    after: str
    cells: int  # in how many of the compared cells


def origins(store: Store, *, failed: bool = True) -> Iterator[RowOrigin]:
    """What the rows of a store were made with. Raises MjnavError where a shard is damaged."""
    columns = (*CELL, "controller", "scenario", "control", *MADE_WITH)
    for values, count in store.count_by(columns, failed=failed).items():
        value: dict[str, Any] = dict(zip(columns, values, strict=True))
        cell = value["study"], value["scene"], value["setting"], value["method"]
        facts = {fact: value[column] for column, fact in MADE_WITH.items()}
        yield RowOrigin(cell, value["controller"], value["scenario"] or "", value["control"] or "", facts, count)


def changes_since(wanted: Sequence[Trial], store: Store, *, failed: bool = True) -> Counter[str]:
    """What has changed since the store's rows of these trials' cells were made, in words; for how many rows each.

    Without `failed`, rows with an error do not count. Raises MjnavError where a shard is damaged.
    """
    cells = {trial.cell_place: trial.cell for trial in wanted}
    counts: Counter[str] = Counter()
    for origin in origins(store, failed=failed):
        cell = cells.get(origin.cell)
        if cell is not None:
            control = cell.control if origin.control else ""
            keys = _different_keys([(origin.scenario, origin.control), (cell.document, control)])
            texts = [f"{key} was {was}, is {now}" for key, (was, now) in keys]
            texts += changes(origin.made_with, made_with(cell.controller, cell.document))
            counts.update(dict.fromkeys(texts, origin.count))
    return counts


def changes_line(counts: Mapping[str, int]) -> str:
    """Changes in one line, those of most rows first."""
    ordered = sorted(counts.items(), key=lambda item: -item[1])
    more = f"; {len(ordered) - MAX_LISTED} more" if len(ordered) > MAX_LISTED else ""
    return "; ".join(f"{text} ({_rows(count)})" for text, count in ordered[:MAX_LISTED]) + more


def inconsistencies(store: Store, study: str) -> tuple[Inconsistency, ...]:
    """What differs among the rows of a study: programs and processors, and the scenario within a cell.

    Raises MjnavError where a shard is damaged.
    """
    rows = [origin for origin in origins(store) if origin.cell[0] == study]
    counts: dict[str, Counter[str]] = {}
    for fact, (name, _) in FACTS.items():
        # The sources of a controller are compared among its own rows only.
        for controller in sorted({origin.controller for origin in rows}) if fact == OWN_SOURCES else [""]:
            values: Counter[str] = Counter()
            for origin in rows:
                if controller in ("", origin.controller):
                    values[origin.made_with[fact] or ""] += origin.count
            texts = shown(fact, values) if len(values) > 1 else {}
            for value, text in texts.items():
                counts.setdefault(f"{name} {controller}".strip(), Counter())[text or UNKNOWN] += values[value]
    for cell in _by_cell(rows).values():
        for key, texts in _different_keys([(origin.scenario, origin.control) for origin in cell]):
            for text, origin in zip(texts, cell, strict=True):
                counts.setdefault(f"{key} within a cell", Counter())[text] += origin.count
    return tuple(Inconsistency(what, dict(values.most_common())) for what, values in counts.items())


def what_changed(before: Store, after: Store, cells: Iterable[tuple[str, str, str]]) -> tuple[KeyChange, ...]:
    """What differs in these cells (scene, setting and method), which both stores have; keys of the scenario first.

    Raises MjnavError where a shard is damaged.
    """
    by_cell = [_by_cell(origins(store)) for store in (before, after)]
    counts: tuple[Counter[tuple[str, str, str]], ...] = (Counter(), Counter())  # of keys, of facts
    for cell in cells:
        was, now = (side[cell] for side in by_cell)
        of_keys = _different_keys([(origin.scenario, origin.control) for origin in (*was, *now)])
        for changed, texts_of in zip(counts, (of_keys, _different_facts([*was, *now])), strict=True):
            for what, texts in texts_of:
                sides = dict.fromkeys(texts[: len(was)]), dict.fromkeys(texts[len(was) :])
                if sides[0].keys() != sides[1].keys():
                    changed[what, " or ".join(sides[0]), " or ".join(sides[1])] += 1
    return tuple(KeyChange(*change, num) for changed in counts for change, num in changed.items())


def _by_cell(rows: Iterable[RowOrigin]) -> dict[tuple[str, str, str], list[RowOrigin]]:
    cells: dict[tuple[str, str, str], list[RowOrigin]] = {}
    for origin in rows:
        cells.setdefault(origin.cell[1:], []).append(origin)
    return cells


def _different_keys(written: Sequence[tuple[str, str]]) -> Iterator[tuple[str, list[str]]]:
    """The keys that are not the same in all of these run files with their parameters, each with its value in each."""
    if len(set(written)) > 1:
        tables = [_content(*each) for each in written]
        for key in dict.fromkeys(key for table in tables for key in table):
            if any(table.get(key) != tables[0].get(key) for table in tables):
                yield key, [_value_text(table, key) for table in tables]


def _different_facts(rows: Sequence[RowOrigin]) -> Iterator[tuple[str, list[str]]]:
    """The programs and processors that are not the same in all of these rows, each with its value in each."""
    for fact, (name, _) in FACTS.items():
        values = [origin.made_with[fact] or "" for origin in rows]
        if len(set(values)) > 1:
            texts = shown(fact, set(values))
            yield name, [(texts[value][:DIGEST] if fact == SOURCES else texts[value]) or UNKNOWN for value in values]


@lru_cache
def _content(document: str, control: str) -> Mapping[str, object]:
    """Every value of a run file by its dotted key, with the controller's parameters."""
    try:
        table = parse(document, "scenario")
    except InvalidValue:
        return {"scenario": document}
    return dict(_leaves(table)) | {f"control.{key}": value for key, value in json.loads(control or "{}").items()}


def _leaves(value: Mapping[str, Any] | Sequence[Any], path: str = "") -> Iterator[tuple[str, object]]:
    for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
        if isinstance(item, Mapping) or (isinstance(item, list) and any(isinstance(i, Mapping) for i in item)):
            yield from _leaves(item, f"{path}{key}.")
        else:
            yield f"{path}{key}", item


def _value_text(table: Mapping[str, object], key: str) -> str:
    """The value of a dotted key, shortened for a message."""
    if key not in table:
        return "absent"
    text = json.dumps(table[key], default=str, ensure_ascii=False)
    return text if len(text) <= MAX_LENGTH else f"{text[:MAX_LENGTH]}..."


def _rows(count: int) -> str:
    return f"{count} row{'s' * (count != 1)}"
