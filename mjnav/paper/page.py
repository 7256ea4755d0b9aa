"""What an item leaves in its folder, and `index.html`, which is made of these folders alone.

So the page can be made again without running anything; it needs no network and no script.
"""

import csv
import json
import os
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.loop.provenance.run_info import revision
from mjnav.paper.contrast import LEAST_RUNS
from mjnav.paper.episodes import ItemRows
from mjnav.paper.item import LEAST_PAIRS, Finding, Verdict
from mjnav.paper.items import ITEMS
from mjnav.paper.style import DPI, style
from mjnav.recording.export.csv_cells import neutral

FINDINGS, DATA, PICTURE, PRINT = "findings.json", "data.csv", "figure.png", "figure.pdf"
CORRECTION = "Holm"  # of the verdicts, for the number of an item's tests
MARKS = {Verdict.HOLDS: "✓", Verdict.PARTLY: "◐", Verdict.MIXED: "±", Verdict.FAILS: "✗", Verdict.OPEN: "?"}


@dataclass(frozen=True, slots=True)
class Basis:
    """What an item's findings rest on: the numbers are of episodes, 0 of a measurement."""

    command: str
    parameters: Mapping[str, str] = field(default_factory=dict)  # texts by title
    revision: str = field(default_factory=revision)
    asked_for: int = 0
    episodes: int = 0
    failed: int = 0
    left_out: int = 0  # rows of other scenarios or seeds
    absent: Sequence[str] = ()  # cells without any episode

    @classmethod
    def of_episodes(cls, command: str, rows: ItemRows) -> "Basis":
        """Of an item that is judged by episodes."""
        parameters = {study.file.name: study.text for study in rows.studies}
        missing = {"failed": rows.num_failed, "left_out": rows.left_out, "absent": rows.absent}
        return cls(command, parameters, asked_for=rows.asked, episodes=rows.num, **missing)


@dataclass(frozen=True, slots=True)
class Published:
    """What an item's folder says."""

    findings: tuple[Finding, ...]
    basis: Basis
    corrected: bool  # folders of earlier versions have verdicts that were not


def publish(
    folder: Path, figure: Figure, rows: Sequence[Mapping[str, Any]], findings: Sequence[Finding], basis: Basis
) -> None:
    """Writes an item's folder, its findings last: where they are, all is there."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figure.savefig(folder / PICTURE, dpi=DPI, metadata={"Software": None})
        figure.savefig(folder / PRINT, metadata={"CreationDate": None})
    with open(folder / DATA, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows({key: neutral(cell) for key, cell in row.items()} for row in rows)
    parts = [asdict(finding) for finding in findings]
    document = {**asdict(basis), "correction": CORRECTION, "findings": parts}
    temporary = folder / f"{FINDINGS}.tmp"
    temporary.write_text(json.dumps(document, indent=1), encoding="utf-8")
    os.replace(temporary, folder / FINDINGS)


def read(folder: Path) -> Published | None:
    """What an item's folder says; None where it has no findings. Raises InputError where they cannot be read."""
    path = folder / FINDINGS
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        findings = tuple(Finding(**{**part, "verdict": Verdict(part["verdict"])}) for part in document.pop("findings"))
        corrected = document.pop("correction", None) is not None
        basis = Basis(**{key.replace(" ", "_"): value for key, value in document.items()})  # once "asked for"
        return Published(findings, basis, corrected)
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no findings of an item ({error}); `mjnav paper` makes them again") from None


def page(folder: Path, command: str) -> str:
    """The page of what is in `folder`, whose items each have a folder of their name; `command` made the page."""
    about = (
        f"made by: {command}",
        f"revision: {revision()}",
        f"machine: {platform.machine()}, {os.cpu_count()} processors, Python {platform.python_version()}",
    )
    there = {name: found for name in ITEMS if (found := read(folder / name)) is not None}
    css = (files("mjnav.paper") / "page.css").read_text(encoding="utf-8")
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        "<title>The paper, figure by figure</title>",
        f"<style>\n{css}</style></head><body>",
        "<h1>The paper, figure by figure</h1>",
        "<p>What the figures and comparisons of Nair et al., “Non Holonomic Collision Avoidance under Non-Parametric "
        'Uncertainty: A Hilbert Space Approach” (<a href="https://arxiv.org/abs/2112.13034">arXiv 2112.13034</a>) '
        "show, measured again: in the paper’s kinematic setting and in MuJoCo, with the paper’s direct samples and "
        "with filtered ones. Claims are worded here and tested in every setting, over the seeds that both methods have "
        f"a result for, paired by seed. Fewer than {LEAST_PAIRS} of them decide nothing, nor do fewer than "
        f"{LEAST_RUNS} runs of a measurement. The tests of an item are corrected together for their number (Holm): "
        "where nothing differs, at most one item in twenty reports a difference. Each interval has a level of 95 %, "
        "uncorrected. An episode that failed has no result: it counts neither as a success nor as a "
        "collision.</p>",
        f"<p><small>{'<br>'.join(map(escape, about))}</small></p>",
        "<h2>Claims</h2>",
        _claims(there),
    ]
    parts += [_item(name, found) for name, found in there.items()]
    missing = [name for name in ITEMS if name not in there]
    if missing:
        parts.append(f'<p class="quiet">Not run: {escape(", ".join(missing))}.</p>')
    return "\n".join([*parts, "</body></html>", ""])


def _claims(there: Mapping[str, Published]) -> str:
    every = [(name, finding) for name, found in there.items() for finding in found.findings]
    count = Counter(finding.verdict for _, finding in every)
    total = ", ".join(f"{count[verdict]} {verdict.value}" for verdict in Verdict if count[verdict])
    rows = [
        f'<tr><td class="verdict {finding.verdict.name.lower()}">{MARKS[finding.verdict]} '
        f"{escape(finding.verdict.value)}</td><td>{escape(finding.claim)}<br>"
        f"<small>{escape(finding.evidence.partition(chr(10))[0])}</small></td>"
        f'<td><a href="#{name}">{escape(ITEMS[name].title)}</a></td></tr>'
        for name, finding in every
    ]
    head = "<tr><th>verdict</th><th>claim</th><th>item</th></tr>"
    return f'<p>{escape(total)}.</p><div class="wide"><table>{head}{"".join(rows)}</table></div>'


def _item(name: str, found: Published) -> str:
    title, basis = escape(ITEMS[name].title), found.basis
    claims = "".join(
        f'<details><summary><strong class="{finding.verdict.name.lower()}">{MARKS[finding.verdict]}</strong> '
        f"{escape(finding.claim)} <small>({escape(finding.source)}): {escape(finding.verdict.value)}</small></summary>"
        f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in finding.evidence.splitlines())}</ul></details>"
        for finding in found.findings
    )
    data = [f'<a href="{name}/{PRINT}">PDF</a>', f'<a href="{name}/{DATA}">data (CSV)</a>']
    parameters = "".join(
        f"<details><summary>{escape(what)}</summary><pre>{escape(text)}</pre></details>"
        for what, text in basis.parameters.items()
    )
    facts = f"{basis.command}; revision {basis.revision}" + f"; {basis.episodes} episodes" * bool(basis.asked_for)
    return (
        f'<h2 id="{name}">{title}</h2>'
        f'<a href="{name}/{PRINT}"><img src="{name}/{PICTURE}" alt="{title}" loading="lazy"></a>'
        f"<p>{' · '.join(data)}<br><small>{escape(facts)}</small></p>{_gaps(found)}{claims}{parameters}"
    )


def _gaps(found: Published) -> str:
    """What of the item's episodes is missing, and whether its verdicts lack the correction."""
    basis, told = found.basis, []
    if basis.episodes < basis.asked_for:
        told.append(f"{basis.episodes} of {basis.asked_for} episodes were run.")
    if basis.failed:
        told.append(f"{basis.failed} episodes failed and have no result.")
    if basis.left_out:
        told.append(f"{basis.left_out} rows are left out: they are of other scenarios or seeds.")
    if not found.corrected:
        told.append("The verdicts are of an earlier version, not corrected for their number.")
    if basis.absent:
        rows = "".join(f"<li>{escape(cell)}</li>" for cell in basis.absent)
        told.append(
            f"<details><summary>{len(basis.absent)} cells were not run at all</summary><ul>{rows}</ul></details>"
        )
    return f'<div class="gaps">{" ".join(told)}</div>' if told else ""
