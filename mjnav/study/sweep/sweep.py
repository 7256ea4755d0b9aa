"""A sweep: runs the episodes that a store lacks, and writes their rows while it runs.

What rows were made with, and what differs, is known before a sweep adds rows to others, in a table, and between
folders.
"""

import json
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from mjnav.errors import InputError, InvalidValue, MjnavError
from mjnav.loop.provenance import FACTS, OWN_SOURCES, SOURCES, changes, shown
from mjnav.scene.toml import parse
from mjnav.study.cells import Cell
from mjnav.study.keep import ALL, LOGS, NONE, Keep, check_kind, log_name, make_logs_folder
from mjnav.study.store import CELL, MADE_WITH, STUDY_FILE, Row, Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.schedulers import Scheduler
from mjnav.study.trial import Trial, made_with

# -------------------------------------------------------------------------------------------- changes


MAX_LISTED = 12  # changes in one message
MAX_LENGTH = 60  # characters of a value
DIGEST = 12  # characters of the digest of mjnav's sources that are shown
UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class RowOrigin:
    """What `count` rows were made with."""

    cell: tuple[str, str, str, str]  # the values of `store.CELL`
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

    Without `failed`, rows with an error do not count. Rows do not say whether `detour` was asked for; the study file
    that the last sweep left does. Raises MjnavError where a shard is damaged.
    """
    asked = {trial.cell_place: trial for trial in wanted}
    swept = _swept(store)
    counts: Counter[str] = Counter()
    for origin in origins(store, failed=failed):
        trial = asked.get(origin.cell)
        if trial is not None:
            cell = trial.cell
            control = cell.control if origin.control else ""
            keys = _different_keys([(origin.scenario, origin.control), (cell.document, control)])
            texts = [f"{key} was {was}, is {now}" for key, (was, now) in keys]
            if swept.get("name") == trial.study and swept["detour"] != trial.detour:
                texts.append(f"detour was {_value_text(swept, 'detour')}, is {json.dumps(trial.detour)}")
            texts += changes(origin.made_with, made_with(cell.controller, cell.document))
            counts.update(dict.fromkeys(texts, origin.count))
    return counts


def _swept(store: Store) -> Mapping[str, object]:
    """The study file of the last sweep, with `detour`; nothing else where there is none, or it is no TOML."""
    with suppress(InvalidValue):
        return {"detour": False, **parse(store.study(), STUDY_FILE)}
    return {"detour": False}


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


# ---------------------------------------------------------------------------------------------- sweep


# A shard holds the rows of a share of the sweep's time so far, within these limits: a killed sweep repeats little, and
# a long one has few shards.
SHARD_SHARE = 0.02
SHARD_SECONDS = (1.0, 60.0)  # [s]
SHARD_ROWS = 5_000


@dataclass(frozen=True, slots=True)
class SweepSummary:
    """What a sweep did. `seconds` is its wall time, `episode_seconds` the sum of its episodes' wall times."""

    episodes: int  # of the study
    kept: int  # that the store had before
    run: int
    failed: int  # rows of the store with an error
    seconds: float
    episode_seconds: float
    interrupted: bool
    unlogged: int  # episodes that did not succeed and have no log, where failures were to keep theirs


def trials(study: StudyFile, cells: Sequence[Cell]) -> list[Trial]:
    """Every cell under every seed, seed by seed: an unfinished sweep has run all cells equally often."""
    return [Trial(study.name, cell, seed, detour=study.detour) for seed in study.all_seeds for cell in cells]


def check(wanted: Sequence[Trial], store: Store, *, resume: bool, failed: bool = True, accept: bool = False) -> None:
    """Raises InputError where these trials cannot be added to the store; writes nothing.

    They cannot where the folder has files that no sweep wrote, where it has rows and `resume` is false, and where
    something has changed since the rows of the same cells were made and `accept` is false. Without `failed`, rows with
    an error do not count. Raises MjnavError where a shard is damaged.
    """
    store.check_own()
    if not resume and store.has_rows():
        raise InputError(f"{store.folder} has results: --resume adds what is missing, or -o names another folder")
    found = {} if accept else changes_since(wanted, store, failed=failed)
    if found:
        raise InputError(
            f"{store.folder}: not the same as when its rows were made: {changes_line(found)}. Nothing was written: "
            "-o names another folder; --accept-changed keeps the rows that are there and adds the missing ones"
        )


def keeping(trials: Iterable[Trial], folder: Path, kind: str) -> Iterator[Trial]:
    """The trials, their logs kept in a folder of results as `kind`, one of KINDS, says.

    Makes the folder of logs, and removes what is left of these trials there. Raises InputError.
    """
    check_kind(kind)
    if kind == NONE and not (folder / LOGS).exists():
        yield from trials
        return
    if kind != NONE:
        make_logs_folder(folder)
    for trial in trials:
        keep = Keep(os.path.abspath(folder), log_name(trial.cell_place[1:], trial.seed, trial.id), kind == ALL)
        keep.remove()
        yield trial if kind == NONE else replace(trial, keep=keep)


def sweep(
    wanted: Sequence[Trial],
    store: Store,
    scheduler: Scheduler,
    *,
    text: str = "",
    resume: bool = False,
    retry_failed: bool = False,
    accept_changed: bool = False,
    keep_logs: str = NONE,
    stop: Callable[[], bool] = lambda: False,
    begin: Callable[[int], None] = lambda kept: None,
    progress: Callable[[int, Row], None] = lambda done, row: None,
) -> SweepSummary:
    """Runs the trials that have no row in the store; with `retry_failed`, also those that failed.

    With `accept_changed`, rows that were made before a change count as done, and rows of workers that differ from this
    process are added: there is never more than one row of an episode. `keep_logs` is one of `keep.KINDS`: which of the
    episodes that are run keep their log. `text` is written beside the rows. `begin` gets
    the number of rows that are there, `progress` the number of episodes that were run and the latest row. The sweep
    ends when `stop` returns true; what is done is kept.

    Raises InputError as `check` does, before anything is written, and MjnavError where the disk refuses, and where a
    worker differs from this process, cannot import the controller or cannot write a log: the row of that episode is
    not kept.
    """
    began = time.monotonic()
    check_kind(keep_logs)
    resume = resume or retry_failed

    def checked() -> None:
        check(wanted, store, resume=resume, failed=not retry_failed, accept=accept_changed)

    if not resume:
        checked()  # before there is a folder
    with store.writing(text, checked):
        if retry_failed:
            store.forget_failures({trial.place for trial in wanted})
        done = store.done()
        missing = list(keeping((trial for trial in wanted if trial.place not in done), store.folder, keep_logs))
        begin(len(wanted) - len(missing))
        buffer, unlogged = _Buffer(store), 0
        try:
            with closing(scheduler(missing)) as rows:
                for row in rows:
                    if row is not None:
                        check_worker(row, accept_changed=accept_changed)
                        buffer.add(row)
                        unlogged += keep_logs != NONE and row.log is None and not row.figures.get("success")
                        progress(buffer.count, row)
                    buffer.flush_if_due()
                    if stop():
                        break
        finally:
            buffer.flush()
        return SweepSummary(
            episodes=len(wanted),
            kept=len(wanted) - len(missing),
            run=buffer.count,
            failed=store.causes().total(),
            seconds=time.monotonic() - began,
            episode_seconds=buffer.seconds,
            interrupted=buffer.count < len(missing),
            unlogged=unlogged,
        )


def check_worker(row: Row, *, accept_changed: bool) -> None:
    """Raises MjnavError where the worker that made a row could not import the controller.

    Without `accept_changed`, also where the row has a result and the worker differs from this process.
    """
    controller = row.controller
    if row.error is not None and row.made_with[OWN_SOURCES] == "" != made_with(controller, row.scenario)[OWN_SOURCES]:
        raise MjnavError(
            f"the worker on {row.machine} cannot import {controller.partition(':')[0]}: start it in the folder that "
            f"has this module; its episode was left out ({row.error})"
        )
    differences = changes(made_with(controller, row.scenario), row.made_with)
    if row.error is None and not accept_changed and differences:
        raise MjnavError(
            f"the worker on {row.machine} differs from this process: {'; '.join(differences)}; its episode was left "
            "out. Make them the same, or keep the episodes of both with --accept-changed"
        )


class _Buffer:
    """Rows that are not yet on the disk."""

    def __init__(self, store: Store):
        self._store = store
        self._rows: list[Row] = []
        self._began = self._flushed = time.monotonic()
        self.count = 0
        self.seconds = 0.0

    def add(self, row: Row) -> None:
        self._rows.append(row)
        self.count += 1
        self.seconds += row.wall_s or 0.0

    def flush_if_due(self) -> None:
        now = time.monotonic()
        shortest, longest = SHARD_SECONDS
        interval = min(max(shortest, SHARD_SHARE * (now - self._began)), longest)
        if now - self._flushed >= interval or len(self._rows) >= SHARD_ROWS:
            self.flush()

    def flush(self) -> None:
        # Rows are handed over once, even if the disk refuses them: a second time could write them twice.
        rows, self._rows = self._rows, []
        if rows:
            self._store.append(rows)
        self._flushed = time.monotonic()
