"""One HTML file that shows what happened in a run, or in several side by side: for `mjnav report` and for notebooks.

The page asks the network for nothing: its policy forbids it, and allows no script or style but its own, by their
hashes. Figures come from what `mjnav inspect --json` prints, and from nothing else.
"""

import json
import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from mjnav.errors import InputError, InvalidValue
from mjnav.log.read.log import Log, open_log
from mjnav.output_files import output_path, replacement
from mjnav.printable import printable
from mjnav.report import document
from mjnav.report.inspection import Inspection, inspect
from mjnav.report.run_page import page_parts
from mjnav.report.run_page.playback import Playback, playback

LETTERS = "ABCD"
MAX_RUNS = len(LETTERS)
FEW_LEGS = 8  # of people's planned ways, with which a map stays readable
FRAME_HEIGHT = 860  # [pixels] of the page in a notebook
MAX_FRAME = 5_000_000  # [characters] of a page in a notebook, which keeps it in its file
GENERATOR = "mjnav report"  # by which a page is known
_PACKAGE = "mjnav.report.run_page"
_SCRIPTS = (
    *("unpack", "drawing", "map", "plan", "lidar", "distribution"),
    *("plots", "quantities", "playback", "time_line", "page"),
)

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


def frame(log: Log) -> str | None:
    """The page of a log in a frame of its own, as HTML for a notebook; None where it is too large for that."""
    text = page([shown(log)])
    if len(text) > MAX_FRAME:
        return None
    return (
        f'<iframe srcdoc="{escape(text)}" sandbox="allow-scripts" title="{escape(str(log.path))}" '
        f'style="width:100%;height:{FRAME_HEIGHT}px;border:1px solid #8884"></iframe>'
    )


def shown(log: Log) -> tuple[Inspection, Playback]:
    """What `mjnav inspect` finds in a log, and what the page plays back. Raises InputError where it holds no run."""
    if log.run is None:
        raise log.error or InputError(f"{log.path}: not the log of a run of mjnav")
    inspection = inspect(log)
    return inspection, playback(log, keep=[moment.tick for moment in inspection.moments])


def page(found: Sequence[tuple[Inspection, Playback]]) -> str:
    """The page of one to MAX_RUNS runs: what `inspect` and `playback` say of each."""
    several = len(found) > 1
    runs = [page_parts.ShownRun.of(i, LETTERS[i] if several else "", *one) for i, one in enumerate(found)]
    played = [run.playback for run in runs]
    own = document.frame(GENERATOR, _PACKAGE, ["web/page.css"], [f"web/{name}.js" for name in _SCRIPTS])
    block = Template(document.asset(_PACKAGE, "web/run.html"))
    fields = {
        "head": own.head(" | ".join(f"{run.said('scene')}, {run.driver}" for run in runs)),
        "headline": _headline(runs),
        "notices": page_parts.notices(runs),
        "cards": "" if several else page_parts.cards(runs[0].figures),
        "comparison": page_parts.comparison([(run.heading, run.figures) for run in runs]) if several else "",
        "layout": "several" if several else "single",
        "parameters": page_parts.parameters(runs),
        "predictions": _hidden(any("ways" in one["fields"] for one in played)),
        "lidar": _hidden(any(one["lidar"] for one in played)),
        "known": _hidden(any(one["lidar"] and one["lidar"]["map"] for one in played)),
        "routes": _hidden(any(one["scene"]["own_ways"] for one in played)),
        "plans": _hidden(any(one["plan"] for one in played)),
        "candidates": "" if all(one["plan"] for one in played) else "checked",
        "ways": "checked" if all(len(one["scene"]["people_legs"]) <= FEW_LEGS for one in played) else "",
        "differ": ", above them what differs between the runs" if several else "",
        "runs": "".join(block.substitute(name=f"<h2>{run.heading}</h2>{run.badge}" * several) for run in runs),
        "moments": page_parts.moments(runs),
        "events": page_parts.events(runs),
        "log": "".join(_log_section(run) for run in runs),
        "inspections": _script_json([run.document for run in runs]),
        "data": _script_json([{**run.playback, "letter": LETTERS[run.number]} for run in runs]),
        "scripts": own.script_elements,
    }
    return Template(document.asset(_PACKAGE, "web/page.html")).substitute(fields)


def _hidden(is_shown: bool) -> str:
    """The attribute of an element that only some runs need."""
    return "" if is_shown else "hidden"


def _script_json(document: Any) -> str:
    """JSON that cannot end the script element that it stands in."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _headline(runs: Sequence[page_parts.ShownRun]) -> str:
    """The scene, or the number of runs, in large letters; how a single run ended."""
    scenes = list(dict.fromkeys(run.said("scene") for run in runs))
    end = ""
    if len(runs) == 1:
        about, end = runs[0].driver, runs[0].badge
    else:
        mixed = " of different scenes: differences compare unlike with unlike" if len(scenes) > 1 else ""
        about = f"{len(runs)} runs side by side{mixed}"
    return f'<h1>{escape(", ".join(scenes))}</h1><p class="about">{escape(about)}</p>{end}'


def _log_section(run: page_parts.ShownRun) -> str:
    path = escape(printable(run.inspection.path))
    return f'<h3>{run.mark}{path}</h3><div class="log">{page_parts.details(run)}</div>'
