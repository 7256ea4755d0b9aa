"""The parts of a page of runs as HTML: figures, notices, parameters, moments, events and details.

Figures are those of `mjnav inspect --json`: every one bears its key and its raw value. What a figure is called and its
unit come from its definition (`mjnav.metrics`).
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

from mjnav.log.encode.json_messages import dumps
from mjnav.metrics.summary import FIGURES
from mjnav.report.document import term
from mjnav.report.figure_text import by_group, definition, unit
from mjnav.report.inspection import Inspection
from mjnav.report.run_page.playback import Playback

# -------------------------------------------------------------------------------------------- figures


# Figures that belong together, the first in large letters.
CARDS = (
    ("time_s", "real_time_factor"),
    ("min_clearance_m",),
    (*(f"collisions_{kind}" for kind in ("person", "table", "wall", "pillar")), "robot_at_fault"),
    ("min_human_distance_m", "personal_space_share", "min_time_to_collision_s"),
    ("detour_displacement_m", "detour_path_m", "detour_delay_s"),
    ("people_see_robot",),
    ("path_length_m", "path_ratio", "straight_line_m"),
    ("mean_deviation_m", "max_deviation_m"),
    ("control_cost",),
    ("stalled_s",),
    ("lane_violation_s",),
    ("infeasible_ticks", "ticks"),
    ("localization_rmse_m", "tracking_rmse_m"),
    ("gospa_m", "tracked_share", "identity_switches"),
    ("robot_coverage", "people_coverage"),
    *(tuple(f"compute_ms_{phase}_{level}" for level in ("p50", "p99", "max")) for phase in ("control", "tick")),
    ("deadline_misses",),
)
DASH = "–"


def key_of(figure: str) -> str:
    """Where a figure stands in the document that `mjnav inspect --json` prints."""
    known = FIGURES[figure]
    return f"{'timing' if known.group == 'computing' else 'figures'}.{known.name}"


def flatten(document: Any, prefix: str = "") -> dict[str, Any]:
    """Every leaf of a JSON document under its dotted key; an empty object or list is a leaf."""
    is_list = isinstance(document, list)
    parts = document.items() if isinstance(document, dict) else enumerate(document) if is_list else ()
    leaves: dict[str, Any] = {}
    for name, part in parts:
        leaves |= flatten(part, f"{prefix}.{name}" if prefix else str(name))
    return leaves or {prefix: document}


def shown(value: Any) -> str:
    """A value for people: three digits, thousands apart, a dash for what is unknown."""
    if value is None or value == {} or value == []:
        return DASH
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}".replace(",", "\u202f").replace("-", "−")
    if isinstance(value, float):
        return (f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:.3g}").replace("-", "−")
    return str(value)


def element(run: int, key: str, value: Any, unit: str = "", *, name: str = "span") -> str:
    """One figure; `data-value` is the raw value as JSON."""
    raw = escape(json.dumps(value))
    tail = f' <span class="unit">{escape(unit)}</span>' if unit and value is not None else ""
    return f'<{name} data-run="{run}" data-key="{escape(key)}" data-value="{raw}">{escape(shown(value))}</{name}>{tail}'


def table(kind: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are HTML; the first cell of each row is its heading. Without `head`, it has none."""
    top = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    body = "".join(f'<tr><th scope="row">{first}</th>{"".join(map("<td>{}</td>".format, rest))}</tr>'
                   for first, *rest in rows)  # fmt: skip
    return f'<table class="{kind}">{f"<thead><tr>{top}</tr></thead>" if head else ""}<tbody>{body}</tbody></table>'


def cards(flat: Mapping[str, Any]) -> str:
    """The key figures of one run; what a log does not have makes no card."""
    known = [[name for name in names if flat.get(key_of(name)) is not None] for names in CARDS]
    found = "\n".join(_card(names, flat) for names in known if names)
    return f'<section class="figures" aria-label="Key figures">{found}</section>'


def _card(names: Sequence[str], flat: Mapping[str, Any]) -> str:
    first, *rest = (FIGURES[name] for name in names)
    about = "\n".join(f"{one.words}: {one.about}" for one in (first, *rest)) if rest else first.about
    heading = term(first.words[0].upper() + first.words[1:], about)
    large = element(0, key_of(first.column), flat[key_of(first.column)], first.unit, name="strong")
    rows = " ".join(
        f'<span title="{escape(one.about)}">{element(0, key_of(one.column), flat[key_of(one.column)], one.unit)} '
        f'<span class="what">{escape(one.words)}</span></span>'
        for one in rest
    )
    return f'<div class="card"><h2>{heading}</h2><p class="figure">{large}</p>{f"<p>{rows}</p>" if rows else ""}</div>'


def comparison(runs: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """The key figures of several runs in columns, each with its difference from the first; headings are HTML."""
    rows = []
    for name in ("outcome", *(name for names in CARDS for name in names)):
        key, known = key_of(name), FIGURES[name]
        values = [flat.get(key) for _, flat in runs]
        if any(value is not None for value in values):
            unit = f' <span class="unit">{escape(known.unit)}</span>' if known.unit else ""
            cells = (element(i, key, value) + _difference(value, values[0]) * (i > 0) for i, value in enumerate(values))
            rows.append((term(known.words, known.about) + unit, *cells))
    figures = table("comparison", ("", *(heading for heading, _ in runs)), rows)
    return f'<section class="figures"><h2>Figures</h2>{figures}</section>'


def _difference(value: Any, first: Any) -> str:
    if isinstance(value, bool) or not (isinstance(value, int | float) and isinstance(first, int | float)):
        return ""
    change = value - first
    text = f"{'+' if change > 0 else ''}{shown(float(f'{change:.3g}'))}" if change else "="
    return f' <span class="difference">{text}</span>'


def figure_tables(run: int, flat: Mapping[str, Any]) -> str:
    """All leaves of `flat`: the figures of the run first, each with its unit, a table for each of their groups."""
    groups = by_group(key for key in flat if key.startswith("figures."))
    rest = [key for key in flat if not key.startswith("figures.")]
    return "".join(
        f"{f'<h4>{escape(group)}</h4>' if group else ''}"
        + table("all", (), ((_named(key), element(run, key, flat[key], unit(key))) for key in keys))
        for group, keys in (*groups.items(), ("", rest))
        if keys
    )


def _named(key: str) -> str:
    return term(key, definition(key) if key.startswith("figures.") else "", reach=False)


# ---------------------------------------------------------------------------------------------- parts


_OUTCOMES: Mapping[str | None, tuple[str, str]] = MappingProxyType(
    {
        "goal": ("good", "✓ goal reached"),
        "believed": ("fair", "■ out of time, at the goal by its belief"),
        "collision": ("bad", "✕ collision"),
        "timeout": ("fair", "■ out of time"),
        "aborted": ("fair", "■ aborted"),
        None: ("fair", "■ the run did not end"),
    }
)
# Of the log's metadata `mjnav/run`.
_FACTS = (
    *("scene", "controller", "seed", "engine", "version.mjnav", "git_revision"),
    *("version.mujoco", "python", "argv"),
)
_PEOPLE_COLUMNS = (("behaviour", ""), ("temperament", ""), ("sees_robot", ""), ("enters", "s"), ("leaves", "s"))


@dataclass(frozen=True, slots=True)
class ShownRun:
    """A run and its number on the page, from 0."""

    number: int
    letter: str  # "" for the only run
    inspection: Inspection
    document: dict[str, Any]  # what `mjnav inspect --json` prints
    figures: dict[str, Any]  # the document's leaves by dotted key
    playback: Playback

    @classmethod
    def of(cls, number: int, letter: str, inspection: Inspection, playback: Playback) -> "ShownRun":
        """A run, from what `inspect` and `playback` say of it."""
        document = json.loads(dumps(inspection.document()))
        return cls(number, letter, inspection, document, flatten(document), playback)

    def said(self, key: str) -> str:
        """What the log's metadata say of the run."""
        return str((self.inspection.run or {}).get(key, f"unknown {key}"))

    @property
    def driver(self) -> str:
        """Controller and seed, in words."""
        return f"{self.said('controller')}, seed {self.said('seed')}"

    @property
    def heading(self) -> str:
        """Letter, scene, controller and seed, in HTML."""
        scene = self.said("scene")
        return f"{self.mark} {escape(f'{scene}, {self.driver}')}".strip()

    @property
    def mark(self) -> str:
        """The letter in the run's colour, in HTML; nothing for the only run."""
        return f'<b class="letter run-{self.number}">{self.letter}</b>' if self.letter else ""

    @property
    def badge(self) -> str:
        """How the run ended, in HTML: a sign, a word and a colour."""
        outcome = self.inspection.outcome
        kind, text = _OUTCOMES.get(outcome) or ("fair", str(outcome))
        return f'<span class="badge {kind}" data-outcome="{self.number}">{escape(text)}</span>'


def notices(runs: Sequence[ShownRun]) -> str:
    """What a reader must know before anything else: which parts of the runs are missing here."""
    items = "".join(f"<li>{run.mark}{escape(text)}</li>" for run in runs for text in _notices(run))
    return f'<ul class="notices">{items}</ul>' if items else ""


def _notices(run: ShownRun) -> Iterator[str]:
    found, data = run.inspection, run.playback
    if found.damage is not None:
        yield f"The log is damaged: {found.damage['error']}. What is intact is shown."
    if found.truncated:
        yield "The log has no end: its writer was killed. What had been written is shown."
    if not found.complete:
        yield "The run did not end: there is no result."
    yield from (f"Missing: {sentence}." for sentence in found.missing)
    if data["stride"] > 1:
        yield f"Playback and plots have one tick in {data['stride']} of {shown(data['ticks'])}; figures have all."
    if data["candidates"] is None:
        yield "This run's method logs no candidates."


def parameters(runs: Sequence[ShownRun]) -> str:
    """How each run was made: a column a run, first what differs between them."""
    columns = [_of_run(run) for run in runs]
    texts = {name: [column.get(name, "") for column in columns] for column in columns for name in column}
    rows = sorted(texts.items(), key=lambda row: len(set(row[1])) == 1)  # stable: what differs comes first
    cells = [(escape(name), *(_differing(text, values) for text in values)) for name, values in rows]
    head = ("", *(run.heading for run in runs)) if len(runs) > 1 else ()
    return f'<div class="wide">{table("parameters", head, cells)}</div>'


def _differing(text: str, values: Sequence[str]) -> str:
    return f"<strong>{escape(text)}</strong>" if len(set(values)) > 1 else escape(text)


def _of_run(run: ShownRun) -> dict[str, str]:
    """Names and values: scene, controller and what was set first, then noise, seed and versions."""
    info = run.inspection.run or {}
    known = {key: str(info[key]) for key in _FACTS if info.get(key)}
    first = {key: known.pop(key) for key in ("scene", "controller") if key in known}
    return {**first, **run.playback["parameters"], "noise": run.playback["noise"], **known}


def moments(runs: Sequence[ShownRun]) -> str:
    """The worst moments of all runs as buttons, numbered for the keyboard."""
    found = [(run, f"moments.{i}", one) for run in runs for i, one in enumerate(run.document["moments"])]
    rows = "".join(
        f'<li><button type="button" data-seek="{float(one["time_s"])!r}" data-moment="{number}" '
        f'data-kind="{escape(one["kind"])}"><b class="number">{number}</b>{run.mark}'
        f'<span class="when">{element(run.number, f"{key}.time_s", one["time_s"], "s")}</span>'
        f'<span class="what">{escape(one["text"])}</span>'
        f"<span>{element(run.number, f'{key}.value', one['value'], one['unit'])}</span></button></li>"
        for number, (run, key, one) in enumerate(found, start=1)
    )
    return f'<ol class="moments">{rows}</ol>' if rows else '<p class="none">None stands out.</p>'


def events(runs: Sequence[ShownRun]) -> str:
    """What the logs have under /events, in order of time, as buttons."""
    rows = [(one["time"], run.number, run.mark, one) for run in runs for one in run.playback["events"]]
    rows.sort(key=lambda row: row[:2])
    if not rows:
        return '<p class="none">None.</p>'
    items = "".join(
        f'<li><button type="button" data-seek="{time!r}" class="{escape(event["level"])}">{mark}'
        f'<span class="when">{time:.2f} <span class="unit">s</span></span><b>{escape(event["name"])}</b> '
        f'<span class="what">{escape(event["text"])}</span></button></li>'
        for time, _, mark, event in rows
    )
    left_out = sum(run.playback["num_events"] for run in runs) - len(rows)
    more = f'<p class="none">{left_out} more are in the log.</p>' if left_out else ""
    return f'<ol class="events" tabindex="0" aria-label="Events">{items}</ol>{more}'


def _headed(label: str, unit: str) -> str:
    return f'{label} <span class="unit">{unit}</span>' if unit else label


def details(run: ShownRun) -> str:
    """The people, and everything else of the document."""
    parts = (
        ("All figures", ("figures", "timing", "ticks", "duration_s", "bytes")),
        ("Result in the log", ("result",)),
        ("Run", ("run",)),
    )
    tables = {
        title: figure_tables(run.number, flatten({key: run.document[key] for key in keys})) for title, keys in parts
    }
    if people := run.inspection.people:
        cells = [(one.behaviour, one.temperament, one.sees_robot, one.enters_s, one.leaves_s) for one in people]
        head = ("person", *(_headed(label.replace("_", " "), unit) for label, unit in _PEOPLE_COLUMNS))
        rows = [(str(i), *(escape(shown(cell)) for cell in row)) for i, row in enumerate(cells)]
        tables = {"People": table("people", head, rows), **tables}
    return "".join(
        f'<details><summary>{title}</summary><div class="wide">{content}</div></details>'
        for title, content in tables.items()
    )
