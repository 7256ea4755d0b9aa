"""The parts of a page of runs beside its key figures: notices, parameters, moments, events and details."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

from mjnav.log.encode.json_messages import dumps
from mjnav.report.inspection import Inspection
from mjnav.report.run_page.page_figures import element, figure_tables, flatten, shown, table
from mjnav.report.run_page.playback import Playback

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
        yield f"The log is damaged: {found.damage.error}. What is intact is shown."
    if found.truncated:
        yield "The log has no end: its writer was killed. What had been written is shown."
    if not found.complete:
        yield "The run did not end: there is no result."
    yield from (f"Missing: {sentence}." for sentence in found.missing)
    if data.stride > 1:
        yield f"Playback and plots have one tick in {data.stride} of {shown(data.ticks)}; figures have all."
    if data.candidates is None and not any(text.startswith("/candidates:") for text in found.missing):
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
    return {**first, **run.playback.parameters, "noise": run.playback.noise, **known}


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
    rows = [(one.time, run.number, run.mark, one) for run in runs for one in run.playback.events]
    rows.sort(key=lambda row: row[:2])
    if not rows:
        return '<p class="none">None.</p>'
    items = "".join(
        f'<li><button type="button" data-seek="{time!r}" class="{escape(event.level)}">{mark}'
        f'<span class="when">{time:.2f} <span class="unit">s</span></span><b>{escape(event.name)}</b> '
        f'<span class="what">{escape(event.text)}</span></button></li>'
        for time, _, mark, event in rows
    )
    left_out = sum(run.playback.num_events for run in runs) - len(rows)
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
