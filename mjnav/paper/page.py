"""`index.html`: every item of the paper with its figure, what was claimed and what became of it.

It is made of the items' folders alone, so it can be made again without running anything, and needs no network.
"""

import os
import platform
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path

from mjnav.loop.provenance import revision
from mjnav.paper.contrast import LEAST_RUNS
from mjnav.paper.item import LEAST_PAIRS, TOO_FEW, Finding, Verdict
from mjnav.paper.items import ITEMS
from mjnav.paper.published import DATA, PICTURE, PRINT, Published, read
from mjnav.report.look.document import frame

MARKS = {Verdict.HOLDS: "✓", Verdict.PARTLY: "◐", Verdict.MIXED: "±", Verdict.FAILS: "✗", Verdict.OPEN: "?"}
REVISION = re.compile(r"\b([0-9a-f]{10})[0-9a-f]{30}\b")  # of git, of which the first digits are enough
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


def page(folder: Path, command: str) -> str:
    """The page of what is in `folder`, whose items each have a folder of their name; `command` made the page."""
    own = frame("mjnav paper", "mjnav.paper", ["page.css"], ["filter.js"], beside=True)
    about = (
        f"made by: {command}",
        f"revision: {_short(revision())}",
        f"machine: {platform.machine()}, {os.cpu_count()} processors, Python {platform.python_version()}",
    )
    there = {name: found for name in ITEMS if (found := read(folder / name)) is not None}
    every = [finding for found in there.values() for finding in found.findings]
    missing = [name for name in ITEMS if name not in there]
    parts = [
        '<!doctype html>\n<html lang="en">',
        own.head("The paper, figure by figure"),
        f"<body><h1>The paper, figure by figure</h1><p>{ABOUT}</p>",
        f"<details><summary>How claims are judged</summary><p>{RULES}</p></details>",
        f"<p><small>{'<br>'.join(map(escape, about))}</small></p>",
        _undecided(every),
        f'<div class="columns"><aside>{_contents(there)}{_filter(every)}</aside><main>',
        *(_item(name, found) for name, found in there.items()),
        f'<p class="none">Not run: {escape(", ".join(missing))}.</p>' if missing else "",
        f"</main></div>\n{own.script_elements}</body></html>\n",
    ]
    return "\n".join(part for part in parts if part)


def _short(text: str) -> str:
    return REVISION.sub(r"\1", text)


def _cannot(finding: Finding) -> bool:
    """Whether there are too few runs in every setting, so that the claim cannot be judged at all."""
    lines = finding.evidence.splitlines()[1:]
    return finding.verdict == Verdict.OPEN and all(line.endswith(TOO_FEW) for line in lines)


def _undecided(every: Iterable[Finding]) -> str:
    """Said once for all claims that too few runs leave without a verdict."""
    findings = list(every)
    number = sum(map(_cannot, findings))
    if not number:
        return ""
    which = "None of the claims" if number == len(findings) else f"{number} of {len(findings)} claims"
    verb = "can be judged" if number == len(findings) else "cannot be judged"
    return (
        f'<p class="notices">{which} {verb} by what was run: a setting needs {LEAST_PAIRS} seeds for which both '
        f"methods have a result, a measurement {LEAST_RUNS} runs. They stand below without a verdict, with what was "
        "measured; <code>mjnav paper</code> without <code>--quick</code> runs enough.</p>"
    )


def _name(finding: Finding) -> str:
    """The class of a finding: of its verdict, or none where there are too few runs for one."""
    return "few" if _cannot(finding) else finding.verdict.name.lower()


def _counts(findings: Iterable[Finding]) -> str:
    count = Counter(finding.verdict for finding in findings if not _cannot(finding))
    return " ".join(
        f'<span class="{verdict.name.lower()}" title="{verdict.value}">{MARKS[verdict]}&#8239;{count[verdict]}</span>'
        for verdict in Verdict
        if count[verdict]
    )


def _contents(there: Mapping[str, Published]) -> str:
    rows = "".join(
        f'<li><a href="#{name}">{escape(ITEMS[name].title)}</a> <small>{_counts(found.findings)}</small></li>'
        for name, found in there.items()
    )
    return f'<nav aria-label="Figures"><h2>Figures</h2><ol>{rows}</ol></nav>' if rows else ""


def _filter(every: Iterable[Finding]) -> str:
    """The controls, which a script shows: without one all claims are there."""
    findings = list(every)
    number = Counter(map(_name, findings))
    names = {"few": "too few runs"} | {verdict.name.lower(): verdict.value for verdict in Verdict}
    options = "".join(
        f'<option value="{name}">{text} ({number[name]})</option>' for name, text in names.items() if number[name]
    )
    return (
        '<form id="filter" role="search" aria-label="Claims" hidden><h2>Claims</h2>'
        f'<label>verdict <select id="verdict"><option value="">all ({len(findings)})</option>{options}</select></label>'
        '<label>text <input type="search" id="words" placeholder="control cost"></label>'
        '<output id="shown" aria-live="polite"></output></form>'
    )


def _item(name: str, found: Published) -> str:
    title, basis = escape(ITEMS[name].title), found.basis
    data = [f'<a href="{name}/{PRINT}">PDF</a>', f'<a href="{name}/{DATA}">data (CSV)</a>']
    parameters = "".join(
        f"<details><summary>Parameters: {escape(what)}</summary><pre>{escape(text)}</pre></details>"
        for what, text in basis.parameters.items()
    )
    facts = f"{basis.command}; revision {_short(basis.revision)}" + f"; {basis.episodes} episodes" * bool(
        basis.asked_for
    )
    limits = f'<p class="limits">{escape(ITEMS[name].limits)}</p>' if ITEMS[name].limits else ""
    return (
        f'<section class="item" id="{name}"><h2>{title}</h2>'
        f'<a href="{name}/{PRINT}"><img src="{name}/{PICTURE}" alt="{title}" loading="lazy"></a>'
        f"<p>{' · '.join(data)} <small>{escape(facts)}</small></p>{limits}{_gaps(found)}"
        f'<ul class="claims">{"".join(map(_claim, found.findings))}</ul>{parameters}</section>'
    )


def _claim(finding: Finding) -> str:
    """A claim with its verdict, and the evidence below it."""
    heading, *lines = finding.evidence.splitlines()
    verdict = (
        f'<strong class="{finding.verdict.name.lower()}">{MARKS[finding.verdict]} {finding.verdict.value}</strong>'
    )
    if _cannot(finding):
        verdict, heading = "", ""
        lines = [line.removesuffix(TOO_FEW).removesuffix("; ") for line in lines]
    told = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return (
        f'<li class="claim" data-verdict="{_name(finding)}"><details><summary>{verdict} {escape(finding.claim)} '
        f"<small>({escape(finding.source)}) {escape(heading)}</small></summary><ul>{told}</ul></details></li>"
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
