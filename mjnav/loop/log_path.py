"""Where the log of a run goes."""

import hashlib
import os
import sys
from datetime import datetime
from pathlib import Path

from mjnav.errors import InputError
from mjnav.recording.log_format import check_path
from mjnav.scenarios.spec import Scenario

OUT_FOLDER = Path("runs/out")
MAX_STEM = 200  # [bytes]: file systems take names of 255, and others are made of this one by adding to it


def log_path(log: bool | str | os.PathLike[str] | None, scenario: Scenario) -> Path | None:
    """The path of a log: None for no log, True for the default path, or a path. Raises InputError, as `check_path`."""
    if log is None or log is False:
        return None
    if log is True:
        make_out_folder()
    return check_path(default_log_path(scenario) if log is True else log)


def default_log_path(scenario: Scenario) -> Path:
    """runs/out/<scene>-<controller>-<seed>-<time>.mcap below the working directory; the time goes to microseconds."""
    return OUT_FOLDER / f"{file_stem(scenario, datetime.now().strftime('%Y%m%dT%H%M%S.%f'))}.mcap"


def make_out_folder() -> None:
    """Makes OUT_FOLDER, the only one that is made without having been asked for. Raises InputError where it cannot."""
    try:
        OUT_FOLDER.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{OUT_FOLDER}: cannot be made: {error.strerror}") from None


def file_stem(scenario: Scenario, time: str) -> str:
    """<scene>-<controller>-<seed>-<time> of characters and of a length that any file system takes.

    What is too long loses the end of <scene>-<controller>; a digest of the whole of it takes its place.
    """
    name = f"{scenario.name}-{scenario.control.method}"
    rest = f"-{scenario.seed}-{time}"
    if len(name.encode()) + len(rest) > MAX_STEM:
        mark = f"-{hashlib.sha256(name.encode()).hexdigest()[:8]}"
        name = name.encode()[: MAX_STEM - len(mark) - len(rest)].decode(errors="ignore") + mark
    stem = "".join(c if c.isalnum() or c in "-_." else "_" for c in name + rest)
    encoding = sys.getfilesystemencoding()
    return stem.encode(encoding, "replace").decode(encoding).replace("?", "_")
