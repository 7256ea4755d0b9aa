"""A sweep: runs what a store has not yet got, and keeps every row soon after it is there."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from mjnav.errors import InputError, MjnavError
from mjnav.loop.provenance.facts import OWN_SOURCES, changes, provenance
from mjnav.study.cells import Cell
from mjnav.study.store.row import Row, made_with
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import changes_since, told
from mjnav.study.sweep.schedulers import Scheduler
from mjnav.study.trial import Trial

SHARD_SECONDS = 1.0  # a killed sweep repeats what it ran for so long,
SHARD_SHARE = 0.02  # or for this share of its time: a long one has few shards all the same,
MAX_SHARD_SECONDS = 60.0  # but never more than this
SHARD_ROWS = 5_000


@dataclass(frozen=True, slots=True)
class Report:
    """What a sweep did. `seconds` is the time that it took, `episode_seconds` that of its episodes, summed."""

    episodes: int  # of the study
    kept: int  # that the store had
    run: int
    failed: int  # rows of the store with an error
    seconds: float
    episode_seconds: float
    interrupted: bool


def trials(study: StudyFile, cells: Sequence[Cell]) -> list[Trial]:
    """Every cell under every seed, seed by seed: a sweep that is not finished has all cells equally often."""
    return [Trial(study.name, cell, seed) for seed in study.all_seeds for cell in cells]


def check(wanted: Sequence[Trial], store: Store, *, resume: bool, failed: bool = True, accept: bool = False) -> None:
    """Raises InputError where these trials cannot be added to the store.

    That is where it has files that no sweep wrote; has rows, and `resume` is not asked for; or where its rows of the
    same cells were made with something that is another now, and `accept` is not asked for. Without `failed`, rows with
    an error do not count. Nothing is written. Raises MjnavError where a shard is damaged.
    """
    store.check_own()
    if not resume and store.has_rows():
        raise InputError(f"{store.folder} has results: --resume adds what is missing, or -o names another folder")
    found = {} if accept else changes_since(wanted, store, failed=failed)
    if found:
        raise InputError(
            f"{store.folder}: not the same as when its rows were made: {told(found)}. Nothing was changed: -o names "
            "another folder; --accept-changed keeps the rows that are there, and adds what is missing as it is now"
        )


def sweep(
    wanted: Sequence[Trial],
    store: Store,
    scheduler: Scheduler,
    *,
    text: str = "",
    resume: bool = False,
    retry_failed: bool = False,
    accept_changed: bool = False,
    stop: Callable[[], bool] = lambda: False,
    begin: Callable[[int], None] = lambda kept: None,
    progress: Callable[[int, Row], None] = lambda done, row: None,
) -> Report:
    """Runs the trials whose place in the study has no row in the store, those that failed too with `retry_failed`.

    With `accept_changed`, rows that were made with something that is another now count as done, and so do those of
    workers that differ from this process: never are there two rows of one place. `text` is kept beside the rows;
    `begin` is told how many of them are there, `progress` how many were run and the latest row; `stop` is asked whether
    to end: what is done then is kept. Raises InputError as `check` does, before anything is written; MjnavError where
    the disk refuses, and where a worker differs from this process or cannot import the controller: its episode is left
    out, others are kept.
    """
    began = time.monotonic()
    resume = resume or retry_failed

    def checked() -> None:
        check(wanted, store, resume=resume, failed=not retry_failed, accept=accept_changed)

    if not resume:
        checked()  # before there is a folder
    with store.writing(text, checked):
        if retry_failed:
            store.forget_failures()
        done = store.done()
        missing = [trial for trial in wanted if trial.place not in done]
        begin(len(wanted) - len(missing))
        buffer = _Buffer(store)
        try:
            with closing(scheduler(missing, stop)) as rows:
                for row in rows:
                    if row is not None:
                        check_worker(row, accept_changed=accept_changed)
                        buffer.add(row)
                        progress(buffer.count, row)
                    buffer.flush_if_due()
                    if stop():
                        break
        finally:
            buffer.flush()
        return Report(
            episodes=len(wanted),
            kept=len(wanted) - len(missing),
            run=buffer.count,
            failed=store.num_failed(),
            seconds=time.monotonic() - began,
            episode_seconds=buffer.seconds,
            interrupted=buffer.count < len(missing),
        )


def check_worker(row: Row, *, accept_changed: bool) -> None:
    """Raises MjnavError where a row shows that its worker cannot give the rows of this process.

    That is where it could not import the controller, and, without `accept_changed`, where a row with a result was made
    with something else than this process has.
    """
    own = row["controller"]
    if row["error"] is not None and made_with(row)[OWN_SOURCES] == "" != provenance(own)[OWN_SOURCES]:
        raise MjnavError(
            f"the worker on {row['machine']} cannot import {own.partition(':')[0]}: start it in the folder that has "
            f"this module; its episode was left out ({row['error']})"
        )
    if row["error"] is None and not accept_changed and (found := worker_changes(row)):
        raise MjnavError(
            f"the worker on {row['machine']} is not as this process: {'; '.join(found)}; its episode was left out. "
            "Make them the same, or keep the episodes of both with --accept-changed"
        )


def worker_changes(row: Row) -> tuple[str, ...]:
    """What the process that made a row has that is another here, in words: "numpy was 2.4.6, is 2.4.5" there."""
    here, there = provenance(row["controller"]), made_with(row)
    return () if here == there else changes(here, there)


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
        self.seconds += row["wall_s"] or 0.0

    def flush_if_due(self) -> None:
        now = time.monotonic()
        interval = min(max(SHARD_SECONDS, SHARD_SHARE * (now - self._began)), MAX_SHARD_SECONDS)
        if now - self._flushed >= interval or len(self._rows) >= SHARD_ROWS:
            self.flush()

    def flush(self) -> None:
        # Rows that the disk refuses are run again; handed over twice, they would stand there twice.
        rows, self._rows = self._rows, []
        if rows:
            self._store.append(rows)
        self._flushed = time.monotonic()
