"""The parts of a page beside its key figures: the runs' maps, worst moments, events, topics and metadata."""

from collections.abc import Mapping, Sequence
from html import escape
from types import MappingProxyType
from typing import Any

from mjnav.report.run_page.page_figures import element, figure_table, flatten, shown

_OUTCOMES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "goal": ("good", "✓ goal reached"),
        "collision": ("bad", "✕ collision"),
        "timeout": ("fair", "■ out of time"),
        "aborted": ("fair", "■ aborted"),
    }
)
_UNFINISHED = ("fair", "■ the run did not end")


def heading(inspection: Mapping[str, Any]) -> str:
    """Controller and seed of a run, in words."""
    run = inspection["run"] or {}
    return f"{run.get('controller', 'unknown controller')}, seed {run.get('seed', 'unknown')}"


def scene_name(inspection: Mapping[str, Any]) -> str:
    """The scene of a run."""
    return (inspection["run"] or {}).get("scene", "unknown scene")


def badge(run: int, inspection: Mapping[str, Any]) -> str:
    """How a run ended: a sign, a word and a colour."""
    outcome = inspection["outcome"]
    kind, text = _UNFINISHED if outcome is None else _OUTCOMES.get(outcome, ("fair", str(outcome)))
    return f'<span class="badge {kind}" data-outcome="{run}">{escape(text)}</span>'


def notices(inspection: Mapping[str, Any], data: Mapping[str, Any]) -> list[str]:
    """What a reader must know before anything else: what of the run is missing here."""
    found = []
    if damage := inspection["damage"]:
        found.append(f"The log is damaged: {damage['error']}. What is intact is shown.")
    if inspection["truncated"]:
        found.append("The log has no end: its writer was killed. What had been written is shown.")
    if not inspection["complete"]:
        found.append("The run did not end: there is no result.")
    found += [f"Missing: {sentence}." for sentence in inspection["missing"]]
    if data["stride"] > 1:
        found.append(
            f"Playback and plots have one tick in {data['stride']} of {shown(data['ticks'])}; figures have all."
        )
    if data["candidates"] is None and not any(text.startswith("/candidates:") for text in inspection["missing"]):
        found.append("This run's method logs no candidates.")
    return found


def moments(inspections: Sequence[Mapping[str, Any]], letters: Sequence[str]) -> str:
    """The worst moments of all runs as buttons, numbered for the keyboard."""
    rows = []
    for run, inspection in enumerate(inspections):
        for i, moment in enumerate(inspection["moments"]):
            number, key = len(rows) + 1, f"moments.{i}"
            value = (
                "" if moment["value"] is None else element(run, f"{key}.value", moment["value"], moment["unit"] or "")
            )
            rows.append(
                f'<li><button type="button" data-seek="{float(moment["time_s"])!r}" data-moment="{number}">'
                f'<b class="number">{number}</b>{run_letter(run, letters)}'
                f'<span class="when">{element(run, f"{key}.time_s", moment["time_s"], "s")}</span>'
                f'<span class="what">{escape(str(moment["text"]))}</span><span>{value}</span></button></li>'
            )
    return f'<ol class="moments">{"".join(rows)}</ol>' if rows else '<p class="none">None stands out.</p>'


def events(runs: Sequence[Mapping[str, Any]], letters: Sequence[str]) -> str:
    """What the logs have under /events, in order of time, as buttons."""
    rows = [(event["time"], run, event) for run, data in enumerate(runs) for event in data["events"]]
    items = "".join(
        f'<li><button type="button" data-seek="{time!r}" class="{escape(event["level"])}">{run_letter(run, letters)}'
        f'<span class="when">{time:.2f} <span class="unit">s</span></span><b>{escape(event["name"])}</b> '
        f'<span class="what">{escape(event["text"])}</span></button></li>'
        for time, run, event in sorted(rows, key=lambda row: row[:2])
    )
    left_out = sum(data["num_events"] - len(data["events"]) for data in runs)
    more = f'<p class="none">{left_out} more are in the log.</p>' if left_out else ""
    return (
        f'<ol class="events" tabindex="0" aria-label="Events">{items}</ol>{more}'
        if rows
        else '<p class="none">None.</p>'
    )


def run_letter(run: int, letters: Sequence[str]) -> str:
    """The letter of one run of several, in its colour; nothing for a run alone."""
    return f'<b class="letter run-{run}">{letters[run]}</b>' if len(letters) > 1 else ""


def topics(run: int, inspection: Mapping[str, Any]) -> str:
    """What each topic holds."""
    columns = (
        ("messages", "messages", ""),
        ("hz", "rate", "Hz"),
        ("max_gap_s", "longest gap", "s"),
        ("bytes", "size", "B"),
    )
    head = "".join(f'<th scope="col">{label} <span class="unit">{unit}</span></th>' for _, label, unit in columns)
    rows = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td class="schema">{escape(str(topic["schema"]))}</td>'
        + "".join(f"<td>{element(run, f'topics.{name}.{key}', topic[key])}</td>" for key, _, _ in columns)
        + "</tr>"
        for name, topic in inspection["topics"].items()
    )
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="Topics"><table class="topics"><thead><tr>'
        f'<th scope="col">topic</th><th scope="col">schema</th>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
    )


def details(run: int, inspection: Mapping[str, Any], *, expanded: bool) -> str:
    """Everything else of the document: all figures, the result, how the run was made; the last may be `expanded`."""
    parts = (
        ("All figures", {key: inspection.get(key) for key in ("figures", "timing", "ticks", "duration_s", "bytes")}),
        ("Result in the log", {"result": inspection["result"]}),
        ("Run", {"run": inspection["run"]}),
    )
    return "".join(
        f"<details{' open' if expanded and title == 'Run' else ''}><summary>{title}</summary>"
        f'<div class="wide">{figure_table(run, flatten(part))}</div></details>'
        for title, part in parts
    )
