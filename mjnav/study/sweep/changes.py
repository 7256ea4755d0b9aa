"""What rows were made with, and where that is not the same: before a sweep adds to them, and in a table."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.loop.provenance.facts import FACTS, NOT_RECORDED, OWN_SOURCES, changes, provenance, shown
from mjnav.scenarios.parse import parse
from mjnav.study.cells import Cell
from mjnav.study.store.row import CELL, MADE_WITH, made_with
from mjnav.study.store.store import Store
from mjnav.study.trial import Trial

COLUMNS = (*CELL, "controller", "scenario", "control", *MADE_WITH)
MAX_TOLD = 12  # changes in one message
MAX_SHOWN = 60  # characters of a value

Kind = dict[str, Any]  # a value of each of COLUMNS


@dataclass(frozen=True, slots=True)
class Mixture:
    """Something that is not the same in all rows: how many rows have which value of it."""

    what: str
    rows: Mapping[str, int]

    def __str__(self) -> str:
        parts = [f"{value} in {_rows(count)}" for value, count in self.rows.items()]
        return f"{self.what}: {', '.join(parts)}"


def changes_since(wanted: Sequence[Trial], store: Store, *, failed: bool = True) -> Counter[str]:
    """What is not the same as when the store's rows of these trials' cells were made: in words, and of how many rows.

    Without `failed`, rows with an error do not count. Raises MjnavError where a shard is damaged.
    """
    cells = {trial.cell_place: trial.cell for trial in wanted}
    found: Counter[str] = Counter()
    for kind, count in _kinds(store, failed=failed):
        cell = cells.get((kind["study"], kind["scene"], kind["setting"], kind["method"]))
        if cell is None:
            continue
        texts = [*_scenario_changes(kind, cell)]
        texts += changes(made_with(kind), provenance(cell.controller))
        found.update(dict.fromkeys(texts, count))
    return found


def _scenario_changes(kind: Kind, cell: Cell) -> Iterator[str]:
    control = None if kind["control"] is None else cell.control  # earlier versions did not record all parameters
    if (kind["scenario"], kind["control"]) == (cell.document, control):
        return
    before, now = _content(kind["scenario"], kind["control"]), _content(cell.document, control)
    for key in dict.fromkeys((*before, *now)):
        if before.get(key) != now.get(key):
            yield f"{key} was {_shown(before, key)}, is {_shown(now, key)}"


def told(found: Mapping[str, int]) -> str:
    """Changes in one line, those of most rows first."""
    ordered = sorted(found.items(), key=lambda item: -item[1])
    more = f"; {len(ordered) - MAX_TOLD} more" if len(ordered) > MAX_TOLD else ""
    return "; ".join(f"{text} ({_rows(count)})" for text, count in ordered[:MAX_TOLD]) + more


def mixtures(store: Store, study: str) -> tuple[Mixture, ...]:
    """What is not the same in all rows of a study: of their programs and processors, and within a cell of its scenario.

    Raises MjnavError where a shard is damaged.
    """
    kinds = [(kind, count) for kind, count in _kinds(store) if kind["study"] == study]
    return (*_of_facts(kinds), *_of_scenarios(kinds))


def _of_facts(kinds: Sequence[tuple[Kind, int]]) -> Iterator[Mixture]:
    known = [(kind, made_with(kind), count) for kind, count in kinds]
    silent = sum(count for _, facts, count in known if not any(facts.values()))
    if silent:
        yield Mixture("what rows were made with", {f"{NOT_RECORDED} it": silent})
    known = [(kind, facts, count) for kind, facts, count in known if any(facts.values())]
    for fact, (name, _) in FACTS.items():
        # Methods differ in their controllers' sources; only rows of one controller are to have the same.
        of = {kind["controller"] if fact == OWN_SOURCES else "" for kind, _, _ in known}
        for controller in sorted(of):
            values: Counter[str] = Counter()
            for kind, facts, count in known:
                if fact != OWN_SOURCES or kind["controller"] == controller:
                    values[facts[fact] or "unknown"] += count
            if len(values) > 1:
                words = shown(fact, values)
                yield Mixture(f"{name} {controller}".strip(), {words[v]: count for v, count in values.most_common()})


def _of_scenarios(kinds: Sequence[tuple[Kind, int]]) -> Iterator[Mixture]:
    cells: dict[tuple, Counter[tuple[str, str | None]]] = {}
    for kind, count in kinds:
        content = cells.setdefault(tuple(kind[name] for name in CELL), Counter())
        content[kind["scenario"] or "", kind["control"]] += count
    found: dict[str, Counter[str]] = {}
    for content in cells.values():
        if len(content) < 2:
            continue
        complete = all(control is not None for _, control in content)
        tables = [(_content(document, control if complete else None), n) for (document, control), n in content.items()]
        for key in dict.fromkeys(key for table, _ in tables for key in table):
            if any(table.get(key) != tables[0][0].get(key) for table, _ in tables):
                values = found.setdefault(key, Counter())
                for table, count in tables:
                    values[_shown(table, key)] += count
    for key, values in found.items():
        yield Mixture(f"{key} within a cell", values)


def _kinds(store: Store, *, failed: bool = True) -> Iterator[tuple[Kind, int]]:
    for values, count in store.kinds(COLUMNS, failed=failed).items():
        yield dict(zip(COLUMNS, values, strict=True)), count


def _content(document: str | None, control: str | None) -> dict[str, object]:
    """Every value of a run file by its dotted key; the controller's from `control` where that is known."""
    try:
        table = parse(document or "", "scenario")
    except InvalidValue:
        return {"scenario": document}
    return dict(_leaves(table)) | (
        {} if control is None else {f"control.{k}": v for k, v in json.loads(control).items()}
    )


def _leaves(value: Mapping[str, Any] | Sequence[Any], path: str = "") -> Iterator[tuple[str, object]]:
    for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
        tables = isinstance(item, Mapping) or (isinstance(item, list) and any(isinstance(i, Mapping) for i in item))
        if tables:
            yield from _leaves(item, f"{path}{key}.")
        else:
            yield f"{path}{key}", item


def _shown(table: Mapping[str, object], key: str) -> str:
    if key not in table:
        return "absent"
    text = json.dumps(table[key], default=str, ensure_ascii=False)
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


def _rows(count: int) -> str:
    return f"{count} row{'s' * (count != 1)}"
