"""The parts of a page of runs beside its key figures: the runs, their parameters, notices, events and details.

`ShownRun` is one run of a page: what was found in its log, its place among the page's runs, and what it is called.

`parameters` shows how each run was made: scene, controller, what was set, noise, seed and versions.

The other parts are notices, legends, worst moments, events, topics and metadata.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

from mjnav.log.encode.json_messages import dumps
from mjnav.report.inspection import Inspection, ShownPerson
from mjnav.report.run_page.page_figures import element, figure_table, flatten, shown
from mjnav.report.run_page.playback import Playback

# ----------------------------------------------------------------------------------------------- runs


_OUTCOMES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "goal": ("good", "✓ goal reached"),
        "collision": ("bad", "✕ collision"),
        "timeout": ("fair", "■ out of time"),
        "aborted": ("fair", "■ aborted"),
    }
)
_UNFINISHED = ("fair", "■ the run did not end")


@dataclass(frozen=True, slots=True)
class ShownRun:
    """A run and its number on the page, from 0."""

    number: int
    letter: str  # "" for the only run
    inspection: Inspection
    document: dict[str, Any]  # what `mjnav inspect --json` prints
    figures: dict[str, Any]  # the document's leaves by dotted key
    playback: Playback

    @property
    def scene(self) -> str:
        """The name of the scene."""
        return str((self.inspection.run or {}).get("scene", "unknown scene"))

    @property
    def driver(self) -> str:
        """Controller and seed, in words."""
        run = self.inspection.run or {}
        return f"{run.get('controller', 'unknown controller')}, seed {run.get('seed', 'unknown')}"

    @property
    def heading(self) -> str:
        """Letter, scene, controller and seed, in HTML."""
        return f"{self.mark}{' ' * bool(self.letter)}{escape(f'{self.scene}, {self.driver}')}"

    @property
    def mark(self) -> str:
        """The letter in the run's colour, in HTML; nothing for the only run."""
        return f'<b class="letter run-{self.number}">{self.letter}</b>' if self.letter else ""

    @property
    def badge(self) -> str:
        """How the run ended, in HTML: a sign, a word and a colour."""
        outcome = self.inspection.outcome
        kind, text = _UNFINISHED if outcome is None else _OUTCOMES.get(outcome, ("fair", outcome))
        return f'<span class="badge {kind}" data-outcome="{self.number}">{escape(text)}</span>'


def shown_run(number: int, letter: str, inspection: Inspection, playback: Playback) -> ShownRun:
    """A run of a page, from what `inspect` and `playback` say of it."""
    document = json.loads(dumps(inspection.document()))
    return ShownRun(number, letter, inspection, document, flatten(document), playback)


# ----------------------------------------------------------------------------------------- parameters


_DIFFERS = ' class="differs"'
FACTS = (  # of the log's metadata `mjnav/run`
    ("scene", "scene"),
    ("controller", "controller"),
    ("seed", "seed"),
    ("engine", "engine"),
    ("version.mjnav", "mjnav"),
    ("git_revision", "revision"),
    ("version.mujoco", "MuJoCo"),
    ("python", "Python"),
    ("argv", "command"),
)


def parameters(runs: Sequence[ShownRun]) -> str:
    """The section of a page: a column a run, first what differs between them; HTML."""
    columns = [_of_run(run) for run in runs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    texts = {name: [column.get(name, "") for column in columns] for name in names}
    names.sort(key=lambda name: len(set(texts[name])) == 1)  # stable: what differs comes first
    head = "".join(f'<th scope="col">{run.heading}</th>' for run in runs)
    rows = "".join(
        f'<tr{_DIFFERS * (len(set(texts[name])) > 1)}><th scope="row">{escape(name)}</th>'
        f"{''.join(f'<td>{escape(text)}</td>' for text in texts[name])}</tr>"
        for name in names
    )
    top = f"<thead><tr><td></td>{head}</tr></thead>" if len(runs) > 1 else ""
    return f'<div class="wide"><table class="parameters">{top}<tbody>{rows}</tbody></table></div>'


def _of_run(run: ShownRun) -> dict[str, str]:
    """Names and values: scene, controller and what was set first, then noise, seed and versions."""
    info = run.inspection.run or {}
    known = {label: str(info[key]) for key, label in FACTS if info.get(key)}
    first = {label: known.pop(label) for label in ("scene", "controller") if label in known}
    return {**first, **run.playback.parameters, "noise": run.playback.noise, **known}


# --------------------------------------------------------------- notices, moments, events and details


_TOPIC_COLUMNS = (
    ("messages", "messages", ""),
    ("hz", "rate", "Hz"),
    ("max_gap_s", "longest gap", "s"),
    ("bytes", "size", "B"),
)


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


def lidar_legend(runs: Sequence[ShownRun]) -> str:
    """What the marks of a robot that goes by its lidar mean."""
    marks = {
        "scan": "scan, from where the robot believed to be",
        "detected": "detection, with 95&#8239;% of its place",
        "track": "track, its number and age",
        "coasting": "track of which nothing is seen",
    }
    if _has_own_map(runs):
        marks["known"] = "the robot's map"
    return "".join(f'<li><i class="mark {mark}"></i>{text}</li>' for mark, text in marks.items())


def lidar_layers(runs: Sequence[ShownRun]) -> str:
    """The switches of what it shows."""
    layers = {"scan": "scan", "detections": "detections", **({"map": "the robot's map"} if _has_own_map(runs) else {})}
    return "".join(
        f'<label><input type="checkbox" data-layer="{layer}" checked> {text}</label>' for layer, text in layers.items()
    )


def plan_legend(runs: Sequence[ShownRun]) -> str:
    """What the marks of a method that plans ahead mean."""
    steps = {run.playback.plan["after"] for run in runs if run.playback.plan}
    dots = f", a dot every {steps.pop():.2g}&#8239;s" if len(steps) == 1 else ""
    marks = {
        "plan": f"plan{dots}, and where the robot stands at its end",
        "unfeasible": "plan that is not feasible",
        "ramp": "other plans weighed, cheap to costly",
    }
    return "".join(f'<li><i class="mark {mark}"></i>{text}</li>' for mark, text in marks.items())


def plan_layers() -> str:
    """The switches of what it shows."""
    layers = {"plan": "plan", "fan": "other plans"}
    return "".join(
        f'<label><input type="checkbox" data-layer="{layer}" checked> {text}</label>' for layer, text in layers.items()
    )


def _has_own_map(runs: Sequence[ShownRun]) -> bool:
    return any(run.playback.lidar and run.playback.lidar["map"] for run in runs)


def moments(runs: Sequence[ShownRun]) -> str:
    """The worst moments of all runs as buttons, numbered for the keyboard."""
    rows = []
    for run in runs:
        for i, moment in enumerate(run.document["moments"]):
            number, key = len(rows) + 1, f"moments.{i}"
            value = (
                "" if moment["value"] is None else element(run.number, f"{key}.value", moment["value"], moment["unit"])
            )
            rows.append(
                f'<li><button type="button" data-seek="{float(moment["time_s"])!r}" data-moment="{number}" '
                f'data-kind="{escape(moment["kind"])}">'
                f'<b class="number">{number}</b>{run.mark}'
                f'<span class="when">{element(run.number, f"{key}.time_s", moment["time_s"], "s")}</span>'
                f'<span class="what">{escape(moment["text"])}</span><span>{value}</span></button></li>'
            )
    return f'<ol class="moments">{"".join(rows)}</ol>' if rows else '<p class="none">None stands out.</p>'


def events(runs: Sequence[ShownRun]) -> str:
    """What the logs have under /events, in order of time, as buttons."""
    rows = [(event.time, run.number, event, run.mark) for run in runs for event in run.playback.events]
    if not rows:
        return '<p class="none">None.</p>'
    items = "".join(
        f'<li><button type="button" data-seek="{time!r}" class="{escape(event.level)}">{mark}'
        f'<span class="when">{time:.2f} <span class="unit">s</span></span><b>{escape(event.name)}</b> '
        f'<span class="what">{escape(event.text)}</span></button></li>'
        for time, _, event, mark in sorted(rows, key=lambda row: row[:2])
    )
    left_out = sum(run.playback.num_events for run in runs) - len(rows)
    more = f'<p class="none">{left_out} more are in the log.</p>' if left_out else ""
    return f'<ol class="events" tabindex="0" aria-label="Events">{items}</ol>{more}'


def topics(run: ShownRun) -> str:
    """What each topic of a log holds."""
    head = "".join(
        f'<th scope="col">{label} <span class="unit">{unit}</span></th>' for _, label, unit in _TOPIC_COLUMNS
    )
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td class="schema">{escape(topic["schema"])}</td>'
        + "".join(f"<td>{element(run.number, f'topics.{name}.{key}', topic[key])}</td>" for key, _, _ in _TOPIC_COLUMNS)
        + "</tr>"
        for name, topic in run.document["topics"].items()
    )
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="Topics"><table class="topics"><thead><tr>'
        f'<th scope="col">topic</th><th scope="col">schema</th>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    )


def _people(people: Sequence[ShownPerson]) -> str:
    """A row for each person of the scene."""
    head = "".join(
        f'<th scope="col">{label}</th>'
        for label in (
            "person",
            "behaviour",
            "temperament",
            "sees the robot",
            _in_seconds("enters"),
            _in_seconds("leaves"),
        )
    )
    rows = "".join(
        f'<tr><th scope="row">{i}</th><td>{escape(person.behaviour)}</td><td>{escape(person.temperament)}</td>'
        f"<td>{shown(person.sees_robot)}</td><td>{shown(person.enters_s)}</td><td>{shown(person.leaves_s)}</td></tr>"
        for i, person in enumerate(people)
    )
    return f'<table class="people"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def _in_seconds(label: str) -> str:
    return f'{label} <span class="unit">s</span>'


def details(run: ShownRun) -> str:
    """Everything else of the document."""
    parts = (
        ("All figures", ("figures", "timing", "ticks", "duration_s", "bytes")),
        ("Result in the log", ("result",)),
        ("Run", ("run",)),
    )
    tables = {
        title: figure_table(run.number, flatten({key: run.document[key] for key in keys})) for title, keys in parts
    }
    if run.inspection.people:
        tables = {"People": _people(run.inspection.people), **tables}
    return "".join(
        f'<details><summary>{title}</summary><div class="wide">{table}</div></details>'
        for title, table in tables.items()
    )
