"""What `mjnav.open_log` returns: a log that notebooks show as its page."""

import os
from dataclasses import dataclass, fields
from html import escape

from mjnav.log.read import log as recording


@dataclass(frozen=True, slots=True, repr=False)
class Log(recording.Log):
    """A log; a notebook shows it as the page of `mjnav report`."""

    def _repr_html_(self) -> str:
        from mjnav.report.run_page.page import frame

        text = f"<code>{escape(repr(self))}</code>"
        if self.run is None:
            return text
        return frame(self) or f"{text}: too long for a notebook; mjnav.report(log, 'page.html') makes a page of it"


def open_log(path: str | os.PathLike[str], *, allow_damage: bool = False) -> Log:
    """Reads a log; a notebook shows it as the page of `mjnav report`.

    Raises InputError where the file is missing or not MCAP, and DamagedLogError where it is damaged: with
    `allow_damage`, its `error` says so, and its messages are those that are intact.
    """
    log = recording.open_log(path, allow_damage=allow_damage)
    return Log(**{field.name: getattr(log, field.name) for field in fields(log)})
