"""The version of what a log's topics hold.

1: /candidates holds lines that Foxglove draws. Not read any more: ranks of costs by colour were all that it told.
2: /candidates holds arrays; the lines are /candidates/arcs, in a log that was asked for drawings.
"""

from collections.abc import Mapping
from pathlib import Path

from mjnav.errors import InputError

FORMAT = 2
FORMAT_KEY = "log_format"  # of the metadata mjnav/run; format 1 does not have it


def check_format(path: Path, run: Mapping[str, str]) -> None:
    """Raises InputError for a log of another format than this version and those before it write."""
    if (found := run.get(FORMAT_KEY, "1")) not in ("1", str(FORMAT)):
        raise InputError(f"{path}: of log format {found[:20]!r}; this version of mjnav reads 1 and {FORMAT}")


def unreadable_topics(run: Mapping[str, str] | None) -> Mapping[str, str]:
    """Topics of a log that this version does not read, and why and what does, from the metadata mjnav/run."""
    if run is None or FORMAT_KEY in run:
        return {}
    writer = " ".join(run[key] for key in ("version.mjnav", "git_revision") if run.get(key)) or "0.1.0"
    writer = "".join(filter(str.isprintable, writer[:80]))  # another program may have written the log
    why = f"drawn lines in a log of format 1, which mjnav {writer} reads; this version reads format {FORMAT}"
    return {"/candidates": why}
