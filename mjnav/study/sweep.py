"""A sweep: runs what a store has not yet got, and keeps every row soon after it is there."""

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from mjnav.errors import InputError
from mjnav.study.cells import Cell
from mjnav.study.row import Row
from mjnav.study.schedulers import Scheduler
from mjnav.study.store import Store
from mjnav.study.study_file import StudyFile
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


def sweep(
    wanted: Sequence[Trial],
    store: Store,
    scheduler: Scheduler,
    *,
    text: str = "",
    resume: bool = False,
    retry_failed: bool = False,
    stop: Callable[[], bool] = lambda: False,
    begin: Callable[[int], None] = lambda kept: None,
    progress: Callable[[int, Row], None] = lambda done, row: None,
) -> Report:
    """Runs the trials that the store has no row of, those that failed too with `retry_failed`.

    `text` is kept beside the rows; `begin` is told how many of them are there, `progress` how many were run and the
    latest row; `stop` is asked whether to end: what is done then is kept. Raises InputError
    where the store has rows and neither `resume` nor `retry_failed` is given, MjnavError where the disk refuses.
    """
    began = time.monotonic()
    if not (resume or retry_failed) and store.has_rows():
        raise InputError(f"{store.folder} has results: --resume adds what is missing, or -o names another folder")
    with store.writing(text):
        if retry_failed:
            store.forget_failures()
        done = store.done()
        missing = [trial for trial in wanted if trial.id not in done]
        begin(len(wanted) - len(missing))
        buffer = _Buffer(store)
        try:
            with closing(scheduler(missing, stop)) as rows:
                for row in rows:
                    if row is not None:
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
