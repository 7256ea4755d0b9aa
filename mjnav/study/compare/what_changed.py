"""What changed between two folders of results, as their rows recorded it: scenes, parameters, programs, processor."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mjnav.loop.provenance.facts import FACTS, OWN_SOURCES, SOURCES, shown
from mjnav.study.store.store import Store
from mjnav.study.sweep.changes import RowOrigin, content, origins, value_text

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
