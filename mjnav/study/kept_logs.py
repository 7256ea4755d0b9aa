"""Which episodes of a sweep keep their logs.

Writing every log costs 1.4 to 1.9 times the time of an episode without one. So where only failures keep theirs, an
episode that failed is run a second time, with a log: it ends in the same state hash, or the log is not kept.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from mjnav.loop.episode import Episode
from mjnav.study.keep import ALL, LOGS, NONE, Keep, check_kind, log_name, make_logs_folder, raise_log_fault
from mjnav.study.store.row import Row
from mjnav.study.trial import Trial, cause_of, prepared


def keeping(trials: Iterable[Trial], folder: Path, kind: str) -> Iterator[Trial]:
    """The trials, their logs kept in a folder of results as `kind`, one of KINDS, says.

    Makes the folder of logs, and removes what is left of these trials there. Raises InputError.
    """
    check_kind(kind)
    if kind == NONE and not (folder / LOGS).exists():
        yield from trials
        return
    place = os.path.abspath(folder)
    if kind != NONE:
        make_logs_folder(folder)
    for trial in trials:
        keep = Keep(place, log_name(trial.cell_place[1:], trial.seed, trial.id), kind == ALL)
        keep.remove()
        yield trial if kind == NONE else replace(trial, keep=keep)


def wants_log(trial: Trial, row: Row) -> bool:
    """Whether the episode has to be run again for its log."""
    return trial.keep is not None and not trial.keep.every and not row.figures.get("success")


def with_log(trial: Trial, row: Row, beat: Callable[[float], None] = lambda time: None) -> Row:
    """The row with the log of a second run of its episode; as it was where that did not end as the first.

    Everything else in the row, times included, is that of the first run. `beat` gets the simulated time [s] before
    every tick. Raises LogFault where the log cannot be written.
    """
    keep = trial.keep
    if keep is None:
        return row
    try:
        ended = Episode(prepared(trial), log=keep.new_log(), progress=beat).run().run.state_hash
    except BaseException as error:  # as in `run_trial`
        raise_log_fault(error, keep)
        ended = cause_of(error)
    if ended != (row.error or row.figures["state_hash"]):
        keep.remove()
    return replace(row, log=keep.kept)
