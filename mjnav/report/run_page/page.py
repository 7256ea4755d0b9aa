"""`mjnav report`: one HTML file with everything in it that shows what happened in a run, or in several side by side.

The page asks the network for nothing: its policy forbids it, and allows no script or style but its own, by their
hashes. Figures come from what `mjnav inspect --json` prints, and from nothing else.
"""

import json
from collections.abc import Sequence
from html import escape
from string import Template
from typing import Any

from mjnav.printable import printable
from mjnav.report.inspection import Inspection
from mjnav.report.look.document import asset, frame
from mjnav.report.run_page import page_figures, page_parts
from mjnav.report.run_page.page_parts import ShownRun, parameters, shown_run
from mjnav.report.run_page.playback import Playback

LETTERS = "ABCD"
MAX_RUNS = len(LETTERS)
FEW_LEGS = 8  # of people's planned ways, with which a map stays readable
GENERATOR = "mjnav report"  # by which a page is known
_PACKAGE = "mjnav.report.run_page"
LIDAR = "lidar"  # the script and the style of runs that go by a lidar alone
PLAN = "plan"  # and of runs of methods that plan ahead
_SCRIPTS = (
    "unpack",
    "drawing",
    "map",
    PLAN,
    LIDAR,
    "distribution",
    "plots",
    "quantities",
    "playback",
    "time_line",
    "page",
)


def page(found: Sequence[tuple[Inspection, Playback]]) -> str:
    """The page of one to MAX_RUNS runs: what `inspect` and `playback` say of each."""
    several = len(found) > 1
    runs = [shown_run(i, LETTERS[i] if several else "", *one) for i, one in enumerate(found)]
    lidar, plans = any(run.playback.lidar for run in runs), any(run.playback.plan for run in runs)
    extra = {name for name, shown in ((LIDAR, lidar), (PLAN, plans)) if shown}
    scripts = [name for name in _SCRIPTS if name not in (LIDAR, PLAN) or name in extra]
    styles = ["web/page.css", *(f"web/{name}.css" for name in (LIDAR, PLAN) if name in extra)]
    own = frame(GENERATOR, _PACKAGE, styles, [f"web/{name}.js" for name in scripts])
    fields = {
        "head": own.head(" | ".join(f"{run.scene}, {run.driver}" for run in runs)),
        "headline": _headline(runs),
        "notices": page_parts.notices(runs),
        "cards": "" if several else page_figures.cards(runs[0].figures),
        "comparison": page_figures.comparison([(run.heading, run.figures) for run in runs]) if several else "",
        "layout": "several" if several else "single",
        "parameters": parameters(runs),
        "predictions": "" if any("ways" in run.playback.fields for run in runs) else "hidden",
        "lidar_legend": page_parts.lidar_legend(runs) if lidar else "",
        "lidar_layers": page_parts.lidar_layers(runs) if lidar else "",
        "candidates": "" if all(run.playback.plan for run in runs) else "checked",
        "plan_legend": page_parts.plan_legend(runs) if plans else "",
        "plan_layers": page_parts.plan_layers() if plans else "",
        "ways": "checked" if all(len(run.playback.scene["people_legs"]) <= FEW_LEGS for run in runs) else "",
        "differ": ", above them what differs between the runs" if several else "",
        "runs": "".join(_run_block(run) for run in runs),
        "moments": page_parts.moments(runs),
        "events": page_parts.events(runs),
        "log": "".join(_log_section(run) for run in runs),
        "inspections": _script_json([run.document for run in runs]),
        "data": _script_json([{**run.playback.document(), "letter": LETTERS[run.number]} for run in runs]),
        "scripts": own.script_elements,
    }
    return Template(asset(_PACKAGE, "web/page.html")).substitute(fields)


def _script_json(document: Any) -> str:
    """JSON that cannot end the script element that it stands in."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _headline(runs: Sequence[ShownRun]) -> str:
    """The scene, or the number of runs, in large letters; how a single run ended."""
    scenes = list(dict.fromkeys(run.scene for run in runs))
    end = ""
    if len(runs) == 1:
        about, end = runs[0].driver, runs[0].badge
    else:
        mixed = " of different scenes: differences compare unlike with unlike" if len(scenes) > 1 else ""
        about = f"{len(runs)} runs side by side{mixed}"
    return f'<h1>{escape(", ".join(scenes))}</h1><p class="about">{escape(about)}</p>{end}'


def _run_block(run: ShownRun) -> str:
    """The map of one run, what it does at the moment, and the distribution of its closest obstacle."""
    name = f"<h2>{run.heading}</h2>{run.badge}" if run.letter else ""
    pose = asset(_PACKAGE, "web/pose.html") if run.playback.lidar and run.playback.lidar["side"] else ""
    plan = run.playback.plan
    violation = asset(_PACKAGE, "web/violation.html") if plan and plan["violation"] else ""
    return Template(asset(_PACKAGE, "web/run.html")).substitute(name=name, pose=pose, violation=violation)


def _log_section(run: ShownRun) -> str:
    topics, details = page_parts.topics(run), page_parts.details(run)
    path = escape(printable(run.inspection.path))
    return f'<h3>{run.mark}{path}</h3><div class="log">{topics}<div>{details}</div></div>'
