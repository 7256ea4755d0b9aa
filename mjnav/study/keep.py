"""The logs that a sweep keeps beside its rows: logs/<scene>-<setting>-<method>-<seed>-<id>.mcap.

A row names its log in the column `log`. As folders of results may come from elsewhere, a file is taken for a log only
if its name has this form and it does not lie behind a link.

`Keep` is the log of one episode while the sweep runs: its path, and whether it is kept. `LogFault` is an error of it.
"""

import platform
import re
import stat
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mjnav.errors import InputError, MjnavError, unknown_name
from mjnav.log.log_format import check_path
from mjnav.log.write.writer import LogError
from mjnav.loop.supervision import RunFault

LOGS = "logs"  # the folder, below that of the results
ID_DIGITS = 16  # of the episode's id, in the name of its log
MAX_STEM = 150  # [characters] of the labels in a name, which are ASCII there
NAME = re.compile(rf"{LOGS}/[A-Za-z0-9_.=+-]{{1,{MAX_STEM + 30}}}-[0-9a-f]{{{ID_DIGITS}}}\.mcap")


def log_name(labels: Iterable[str], seed: int, id: str) -> str:
    """The path of an episode's log, from the folder of the results. The id alone makes it unique."""
    words = (re.sub(r"[^A-Za-z0-9_.=+-]+", "_", label) for label in labels)
    return f"{LOGS}/{'-'.join(words)[:MAX_STEM]}-{seed}-{id[:ID_DIGITS]}.mcap"


def kept_log(folder: Path, name: str | None) -> Path | None:
    """The log that a row of the results in `folder` names; None where it names none, or there is none (any more)."""
    if name is None or not NAME.fullmatch(name):
        return None
    path = folder / name
    try:
        links = stat.S_ISLNK(path.parent.lstat().st_mode)
        return path if not links and stat.S_ISREG(path.lstat().st_mode) else None
    except OSError:
        return None


def make_logs_folder(folder: Path) -> None:
    """Makes the folder of logs below `folder`. Raises InputError where it cannot, or something else has its name."""
    logs = folder / LOGS
    if logs.is_symlink() or (logs.exists() and not logs.is_dir()):
        raise InputError(f"{logs}: found {'a link' if logs.is_symlink() else 'a file'}; allowed: a folder, or none yet")
    try:
        logs.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{logs}: {error.strerror}") from None


def remove_logs(folder: Path, names: Iterable[str | None]) -> None:
    """Removes the logs of these names, where there are any."""
    for name in names:
        path = kept_log(folder, name)
        if path is not None:
            path.unlink(missing_ok=True)


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

    def new_log(self) -> Path:
        """Where the episode writes its log. Raises LogFault where that is not possible."""
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
