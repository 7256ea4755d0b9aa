"""The page of logs: for `mjnav report`, for `mjnav.report`, and for notebooks."""

import os
from collections.abc import Sequence
from html import escape
from pathlib import Path

from mjnav.errors import InputError, InvalidValue
from mjnav.log.read.log import Log, open_log
from mjnav.output_files import output_path, replacement
from mjnav.report.inspection import Inspection, inspect
from mjnav.report.run_page.page import MAX_RUNS, page
from mjnav.report.run_page.playback import Playback, playback

FRAME_HEIGHT = 860  # [pixels] of the page in a notebook
MAX_FRAME = 5_000_000  # [characters] of a page in a notebook, which keeps it in its file

LogOrPath = Log | str | os.PathLike[str]


def report(logs: LogOrPath | Sequence[LogOrPath], output: str | os.PathLike[str]) -> Path:
    """Writes one HTML page that plays back the runs of one log, or of up to four side by side; returns its path.

    `output` ends in .html and replaces a file of that name. Raises InputError where it cannot be written or a file is
    not the log of a run, and DamagedLogError for a damaged log unless it was opened with `allow_damage`.
    """
    given = list(logs) if isinstance(logs, Sequence) and not isinstance(logs, str) else [logs]
    if not 1 <= len(given) <= MAX_RUNS:
        raise InvalidValue("logs", len(given), f"1 to {MAX_RUNS} logs on a page")
    path = output_path("output", output, ".html", ".htm")
    opened = [one if isinstance(one, Log) else open_log(one) for one in given]
    if path.exists() and any(one.path.exists() and path.samefile(one.path) for one in opened):
        raise InvalidValue("output", str(path), "another file than the log")
    text = page([shown(one) for one in opened])
    with replacement(path) as partial:
        partial.write_text(text, encoding="utf-8")
    return path


def shown(log: Log) -> tuple[Inspection, Playback]:
    """What `mjnav inspect` finds in a log, and what the page plays back. Raises InputError where it holds no run."""
    if log.run is None:
        raise log.error or InputError(f"{log.path}: not the log of a run of mjnav")
    inspection = inspect(log)
    return inspection, playback(log, keep=[moment.tick for moment in inspection.moments])


def frame(log: Log) -> str | None:
    """The page of a log in a frame of its own, as HTML for a notebook; None where it is too large for that."""
    text = page([shown(log)])
    if len(text) > MAX_FRAME:
        return None
    return (
        f'<iframe srcdoc="{escape(text)}" sandbox="allow-scripts" title="{escape(str(log.path))}" '
        f'style="width:100%;height:{FRAME_HEIGHT}px;border:1px solid #8884"></iframe>'
    )
