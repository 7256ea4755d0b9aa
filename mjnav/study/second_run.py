"""The log of an episode that failed: the episode is run again with a log, and has to end as it did."""

from collections.abc import Callable
from dataclasses import replace

from mjnav.loop.episode import Episode
from mjnav.study.keep import raise_log_fault
from mjnav.study.store.row import Row
from mjnav.study.trial import Trial, cause_of, prepared


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
    except Exception as error:
        raise_log_fault(error, keep)
        ended = cause_of(error)
    if ended != (row.error or row.figures["state_hash"]):
        keep.remove()
    return replace(row, log=keep.kept)
