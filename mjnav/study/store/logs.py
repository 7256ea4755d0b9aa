"""The logs that a sweep keeps beside its rows: logs/<scene>-<setting>-<method>-<seed>-<id>.mcap.

A row names its log in the column `log`. Folders of results come from elsewhere, too: what is no name of this form, or
lies behind a link, is no log.
"""

import re
import stat
from collections.abc import Iterable
from pathlib import Path

from mjnav.errors import InputError

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
