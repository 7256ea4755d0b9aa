"""What rows were made with, and what differs: before a sweep adds rows to others, and among the rows of a table."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.loop.provenance import FACTS, NOT_RECORDED, OWN_SOURCES, changes, shown
from mjnav.scene.toml import parse
from mjnav.study.cells import Cell
from mjnav.study.store.row import CELL, MADE_WITH
from mjnav.study.store.store import Store
from mjnav.study.trial import Trial, made_with

MAX_LISTED = 12  # changes in one message
MAX_LENGTH = 60  # characters of a value


@dataclass(frozen=True, slots=True)
class RowOrigin:
    """What `count` rows were made with. None where the version of mjnav that wrote them did not record it."""

    cell: tuple[str, str, str, str]  # the values of `row.CELL`
    controller: str
    scenario: str | None  # the run file
    control: str | None  # JSON
    made_with: Mapping[str, str | None]  # by fact of `loop.provenance`
    count: int


@dataclass(frozen=True, slots=True)
class Inconsistency:
    """Something that is not the same in all rows: how many rows have which value of it."""

    what: str
    rows: Mapping[str, int]

    def __str__(self) -> str:
        parts = [f"{value} in {_rows(count)}" for value, count in self.rows.items()]
        return f"{self.what}: {', '.join(parts)}"


def changes_since(wanted: Sequence[Trial], store: Store, *, failed: bool = True) -> Counter[str]:
    """What has changed since the store's rows of these trials' cells were made, in words; for how many rows each.

    Without `failed`, rows with an error do not count. Raises MjnavError where a shard is damaged.
    """
    cells = {trial.cell_place: trial.cell for trial in wanted}
    found: Counter[str] = Counter()
    for origin in origins(store, failed=failed):
        cell = cells.get(origin.cell)
        if cell is not None:
            here = made_with(cell.controller, cell.document)
            texts = [*_scenario_changes(origin, cell), *changes(origin.made_with, here)]
            found.update(dict.fromkeys(texts, origin.count))
    return found


def _scenario_changes(origin: RowOrigin, cell: Cell) -> Iterator[str]:
    control = None if origin.control is None else cell.control
    if (origin.scenario, origin.control) == (cell.document, control):
        return
    before, now = content(origin.scenario, origin.control), content(cell.document, control)
    for key in dict.fromkeys((*before, *now)):
        if before.get(key) != now.get(key):
            yield f"{key} was {value_text(before, key)}, is {value_text(now, key)}"


def changes_line(found: Mapping[str, int]) -> str:
    """Changes in one line, those of most rows first."""
    ordered = sorted(found.items(), key=lambda item: -item[1])
    more = f"; {len(ordered) - MAX_LISTED} more" if len(ordered) > MAX_LISTED else ""
    return "; ".join(f"{text} ({_rows(count)})" for text, count in ordered[:MAX_LISTED]) + more


def inconsistencies(store: Store, study: str) -> tuple[Inconsistency, ...]:
    """What differs among the rows of a study: programs and processors, and the scenario within a cell.

    Raises MjnavError where a shard is damaged.
    """
    found = [origin for origin in origins(store) if origin.cell[0] == study]
    return (*_of_facts(found), *_of_scenarios(found))


def _of_facts(among: Sequence[RowOrigin]) -> Iterator[Inconsistency]:
    known = [origin for origin in among if any(origin.made_with.values())]
    unknown = sum(origin.count for origin in among) - sum(origin.count for origin in known)
    if unknown:
        yield Inconsistency("what rows were made with", {f"{NOT_RECORDED} it": unknown})
    for fact, (name, _) in FACTS.items():
        # The sources of a controller are compared among its own rows only.
        groups: dict[str, Counter[str]] = {}
        for origin in known:
            group = groups.setdefault(origin.controller if fact == OWN_SOURCES else "", Counter())
            group[origin.made_with[fact] or "unknown"] += origin.count
        for controller, values in sorted(groups.items()):
            if len(values) > 1:
                texts = shown(fact, values)
                rows = {texts[value]: count for value, count in values.most_common()}
                yield Inconsistency(f"{name} {controller}".strip(), rows)


def _of_scenarios(rows: Iterable[RowOrigin]) -> Iterator[Inconsistency]:
    cells: dict[tuple[str, str, str, str], Counter[tuple[str | None, str | None]]] = {}
    for origin in rows:
        cells.setdefault(origin.cell, Counter())[origin.scenario, origin.control] += origin.count
    found: dict[str, Counter[str]] = {}
    for versions in cells.values():
        if len(versions) < 2:
            continue
        complete = all(control is not None for _, control in versions)
        tables = [(content(document, control if complete else None), n) for (document, control), n in versions.items()]
        for key in dict.fromkeys(key for table, _ in tables for key in table):
            if any(table.get(key) != tables[0][0].get(key) for table, _ in tables):
                values = found.setdefault(key, Counter())
                for table, count in tables:
                    values[value_text(table, key)] += count
    for key, values in found.items():
        yield Inconsistency(f"{key} within a cell", values)


def origins(store: Store, *, failed: bool = True) -> Iterator[RowOrigin]:
    """What the rows of a store were made with. Raises MjnavError where a shard is damaged."""
    columns = (*CELL, "controller", "scenario", "control", *MADE_WITH)
    for values, count in store.count_by(columns, failed=failed).items():
        value: dict[str, Any] = dict(zip(columns, values, strict=True))
        yield RowOrigin(
            cell=(value["study"], value["scene"], value["setting"], value["method"]),
            controller=value["controller"],
            scenario=value["scenario"],
            control=value["control"],
            made_with={fact: value[column] for column, fact in MADE_WITH.items()},
            count=count,
        )


def content(document: str | None, control: str | None) -> dict[str, object]:
    """Every value of a run file by its dotted key; the controller's from `control` where that is known."""
    try:
        table = parse(document or "", "scenario")
    except InvalidValue:
        return {"scenario": document}
    parameters = {} if control is None else {f"control.{k}": v for k, v in json.loads(control).items()}
    return dict(_leaves(table)) | parameters


def _leaves(value: Mapping[str, Any] | Sequence[Any], path: str = "") -> Iterator[tuple[str, object]]:
    for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
        if isinstance(item, Mapping) or (isinstance(item, list) and any(isinstance(i, Mapping) for i in item)):
            yield from _leaves(item, f"{path}{key}.")
        else:
            yield f"{path}{key}", item


def value_text(table: Mapping[str, object], key: str) -> str:
    """The value of a dotted key, shortened for a message."""
    if key not in table:
        return "absent"
    text = json.dumps(table[key], default=str, ensure_ascii=False)
    return text if len(text) <= MAX_LENGTH else f"{text[:MAX_LENGTH]}..."


def _rows(count: int) -> str:
    return f"{count} row{'s' * (count != 1)}"
