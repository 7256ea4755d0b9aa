"""What the items leave in their folders, and `index.html`, the page of all of them.

An item's folder has its figure, its data and its findings. The page is made of the folders alone, so it can be made
again without running anything, and needs no network.
"""

import csv
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.log.export.export import neutral
from mjnav.output_files import replacement
from mjnav.paper import ITEMS, load
from mjnav.paper.claims import LEAST_PAIRS, LEAST_RUNS, Finding, Verdict
from mjnav.paper.draw import style
from mjnav.paper.episodes import Basis
from mjnav.report.document import frame

FINDINGS, DATA, PICTURE, PRINT = "findings.json", "data.csv", "figure.png", "figure.pdf"
MARKS: Mapping[Verdict, str] = MappingProxyType(
    {Verdict.HOLDS: "✓", Verdict.PARTLY: "◐", Verdict.MIXED: "±", Verdict.FAILS: "✗", Verdict.OPEN: "?"}
)
ABOUT = (
    "What the figures and comparisons of Nair et al., “Non Holonomic Collision Avoidance under Non-Parametric "
    'Uncertainty: A Hilbert Space Approach” (<a href="https://arxiv.org/abs/2112.13034">arXiv 2112.13034</a>) show, '
    "measured again: in the paper’s kinematic setting and in MuJoCo, with the paper’s direct samples and with filtered "
    "ones. Claims are worded here and tested in every setting, over the seeds that both methods have a result for, "
    "paired by seed."
)
RULES = (
    f"Fewer than {LEAST_PAIRS} pairs of a setting decide nothing, nor do fewer than {LEAST_RUNS} runs of a "
    "measurement. The tests of an item are corrected together for their number (Holm): where nothing differs, at most "
    "one item in twenty reports a difference. Each interval has a level of 95 %, uncorrected. An episode that failed "
    "has no result: it counts neither as a success nor as a collision. The settings of an item share their scene and "
    "their seeds, so in how many of them a claim holds is no measure of how sure it is: read the intervals."
)


def publish(
    folder: Path, figure: Figure, rows: Sequence[Mapping[str, Any]], findings: Sequence[Finding], basis: Basis
) -> None:
    """Writes an item's folder, its findings last: where they are, all is there."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figure.savefig(folder / PICTURE, metadata={"Software": None})
        figure.savefig(folder / PRINT, metadata={"CreationDate": None})
    with open(folder / DATA, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows({key: neutral(cell) for key, cell in row.items()} for row in rows)
    document = {**asdict(basis), "findings": [asdict(finding) for finding in findings]}
    with replacement(folder / FINDINGS) as partial:
        partial.write_text(json.dumps(document, indent=1), encoding="utf-8")


def read(folder: Path) -> tuple[list[Finding], Basis] | None:
    """What an item's folder says; None where it has no findings. Raises InputError where they cannot be read."""
    path = folder / FINDINGS
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        findings = [Finding(**{**part, "verdict": Verdict(part["verdict"])}) for part in document.pop("findings")]
        return findings, Basis(**document)
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no findings of an item ({error}); `mjnav paper` makes them again") from None


def page(folder: Path, command: str) -> str:
    """The page of what is in `folder`, whose items each have a folder of their name; `command` made the page."""
    look = frame("mjnav paper", "mjnav.paper", ["page.css"], beside=True)
    items = {name: item for name in ITEMS if (item := read(folder / name)) is not None}
    missing = ", ".join(name for name in ITEMS if name not in items)
    contents = "".join(
        f'<li><a href="#{name}">{escape(load(name).title)}</a> <small>{_counts(findings)}</small></li>'
        for name, (findings, _) in items.items()
    )
    return f"""<!doctype html>
<html lang="en">
{look.head("The paper, figure by figure")}
<body><h1>The paper, figure by figure</h1><p>{ABOUT}</p>
<details><summary>How claims are judged</summary><p>{RULES}</p></details>
<p><small>made by: {escape(command)}</small></p>
<nav aria-label="Figures"><ol>{contents}</ol></nav>
{"".join(_item(name, *item) for name, item in items.items())}
{f'<p class="none">Not run: {missing}.</p>' if missing else ""}
{look.script_elements}</body></html>
"""


def _counts(findings: Iterable[Finding]) -> str:
    count = Counter(finding.verdict for finding in findings)
    return " ".join(
        f'<span class="{verdict.name.lower()}" title="{verdict}">{mark}&#8239;{count[verdict]}</span>'
        for verdict, mark in MARKS.items()
        if count[verdict]
    )


def _item(name: str, findings: Sequence[Finding], basis: Basis) -> str:
    title, limits = escape(load(name).title), load(name).limits
    parameters = "".join(
        f"<details><summary>Parameters: {escape(what)}</summary><pre>{escape(text)}</pre></details>"
        for what, text in basis.parameters.items()
    )
    gaps = "".join(f"<li>{escape(gap)}</li>" for gap in basis.gaps)
    return f"""<section class="item" id="{name}"><h2>{title}</h2>
<a href="{name}/{PRINT}"><img src="{name}/{PICTURE}" alt="{title}" loading="lazy"></a>
<p><a href="{name}/{PRINT}">PDF</a> · <a href="{name}/{DATA}">data (CSV)</a> <small>{escape(str(basis))}</small></p>
{f'<p class="limits">{escape(limits)}</p>' if limits else ""}{f'<ul class="gaps">{gaps}</ul>' if gaps else ""}
<ul class="claims">{"".join(map(_claim, findings))}</ul>{parameters}</section>"""


def _claim(finding: Finding) -> str:
    """A claim with its verdict, and the evidence below it."""
    heading, *lines = map(escape, finding.evidence.splitlines())
    verdict = f'<strong class="{finding.verdict.name.lower()}">{MARKS[finding.verdict]} {finding.verdict}</strong>'
    return (
        f'<li class="claim"><details><summary>{verdict} {escape(finding.claim)} '
        f"<small>({escape(finding.source)}) {heading}</small></summary>"
        f"<ul>{''.join(f'<li>{line}</li>' for line in lines)}</ul></details></li>"
    )
