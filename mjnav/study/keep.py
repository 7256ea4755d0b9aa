"""The log that one episode of a sweep is to keep: its path, whether it is there, and what a fault of it is."""

import platform
from dataclasses import dataclass
from pathlib import Path

from mjnav.errors import InputError, MjnavError, unknown_name
from mjnav.loop.faults.fault import RunFault
from mjnav.recording.log_format import check_path
from mjnav.recording.write.writer import LogError
from mjnav.study.store.logs import kept_log, remove_logs

NONE, FAILURES, ALL = KINDS = ("none", "failures", "all")


class LogFault(MjnavError):
    """A log that was to be kept cannot be written."""


@dataclass(frozen=True, slots=True)
class Keep:
    """The log of one episode: its path, and whether it is kept whatever the outcome."""

    folder: str  # of the results, absolute
    name: str  # of the log, from that folder
    every: bool  # or only where the episode does not succeed

    @property
    def kept(self) -> str | None:
        """Its name where the file is there."""
        return None if kept_log(Path(self.folder), self.name) is None else self.name

    def first_log(self) -> Path | None:
        """Where the first run of the episode writes its log, if it is to write one. Raises LogFault."""
        self.remove()
        return self.new_log() if self.every else None

    def new_log(self) -> Path:
        """Where a run of the episode writes its log. Raises LogFault where that is not possible."""
        self.remove()  # what a killed process left
        try:
            return check_path(Path(self.folder) / self.name)
        except InputError as error:
            raise LogFault(f"{error} (on {platform.node()})") from None

    def remove(self) -> None:
        """Removes the file, if there is one."""
        remove_logs(Path(self.folder), [self.name])


def check_kind(kind: str) -> None:
    """Raises InvalidValue for a word that is not one of KINDS."""
    if kind not in KINDS:
        raise unknown_name("keep_logs", kind, KINDS)


def raise_log_fault(error: BaseException, keep: Keep | None) -> None:
    """Raises LogFault where this error of a run is its log's, which is then removed; else does nothing."""
    cause = error.__cause__ if isinstance(error, RunFault) else error
    if isinstance(cause, LogFault):
        raise cause
    if keep is not None and (isinstance(cause, LogError) or _cannot_open(cause)):
        keep.remove()
        raise LogFault(str(cause)) from error


def _cannot_open(error: BaseException | None) -> bool:
    return isinstance(error, InputError) and isinstance(error.__cause__, OSError)
