"""A sweep: runs the episodes that a store lacks, and writes their rows while it runs."""

import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from mjnav.errors import InputError, MjnavError
from mjnav.loop.provenance import OWN_SOURCES, changes
from mjnav.study.cells import Cell
from mjnav.study.keep import ALL, LOGS, NONE, Keep, check_kind, log_name, make_logs_folder
from mjnav.study.store.row import Row
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile
from mjnav.study.sweep.changes import changes_line, changes_since
from mjnav.study.sweep.schedulers import Scheduler
from mjnav.study.trial import Trial, made_with

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
            store.forget_failures()
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
            failed=store.num_failed(),
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
