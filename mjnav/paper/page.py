"""What the items leave in their folders, and `index.html`, the page of all of them.

An item's folder has its figure, its data and its findings. The page is made of the folders alone, so it can be made
again without running anything, and needs no network.
"""

import csv
import json
import os
import platform
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.log.export.table_files import neutral
from mjnav.loop.provenance import revision
from mjnav.output_files import replacement
from mjnav.paper import ITEMS, load
from mjnav.paper.claims import LEAST_PAIRS, LEAST_RUNS, TOO_FEW, Finding, Verdict
from mjnav.paper.draw import style
from mjnav.paper.episodes import Basis
from mjnav.report.look.document import frame

FINDINGS, DATA, PICTURE, PRINT = "findings.json", "data.csv", "figure.png", "figure.pdf"
FEW = "few"
KINDS: Mapping[str, tuple[str, str]] = MappingProxyType(  # of a finding, a class of its HTML -> its mark, its name
    {
        FEW: ("", "too few runs"),  # in every setting, so that the claim cannot be judged at all
        "holds": ("✓", Verdict.HOLDS.value),
        "partly": ("◐", Verdict.PARTLY.value),
        "mixed": ("±", Verdict.MIXED.value),
        "fails": ("✗", Verdict.FAILS.value),
        "open": ("?", Verdict.OPEN.value),
    }
)
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


@dataclass(frozen=True, slots=True)
class Published:
    """What an item's folder says."""

    findings: tuple[Finding, ...]
    basis: Basis


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


def read(folder: Path) -> Published | None:
    """What an item's folder says; None where it has no findings. Raises InputError where they cannot be read."""
    path = folder / FINDINGS
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        document.pop("correction", None)  # which versions before wrote
        findings = tuple(Finding(**{**part, "verdict": Verdict(part["verdict"])}) for part in document.pop("findings"))
        return Published(findings, Basis(**document))
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no findings of an item ({error}); `mjnav paper` makes them again") from None


def page(folder: Path, command: str) -> str:
    """The page of what is in `folder`, whose items each have a folder of their name; `command` made the page."""
    look = frame("mjnav paper", "mjnav.paper", ["page.css"], ["filter.js"], beside=True)
    about = (
        f"made by: {command}",
        f"revision: {_short(revision())}",
        f"machine: {platform.machine()}, {os.cpu_count()} processors, Python {platform.python_version()}",
    )
    items = {name: item for name in ITEMS if (item := read(folder / name)) is not None}
    missing = ", ".join(name for name in ITEMS if name not in items)
    findings = [finding for item in items.values() for finding in item.findings]
    contents = "".join(
        f'<li><a href="#{name}">{escape(load(name).title)}</a> <small>{_counts(item.findings)}</small></li>'
        for name, item in items.items()
    )
    return f"""<!doctype html>
<html lang="en">
{look.head("The paper, figure by figure")}
<body><h1>The paper, figure by figure</h1><p>{ABOUT}</p>
<details><summary>How claims are judged</summary><p>{RULES}</p></details>
<p><small>{"<br>".join(map(escape, about))}</small></p>
{_undecided(findings)}
<div class="columns"><aside>
{f'<nav aria-label="Figures"><h2>Figures</h2><ol>{contents}</ol></nav>' if items else ""}
{_filter(findings)}</aside><main>
{"".join(_item(name, item) for name, item in items.items())}
{f'<p class="none">Not run: {missing}.</p>' if missing else ""}
</main></div>
{look.script_elements}</body></html>
"""


def _short(text: str) -> str:
    return REVISION.sub(r"\1", text)


def _kind(finding: Finding) -> str:
    lines = finding.evidence.splitlines()[1:]
    few = finding.verdict == Verdict.OPEN and all(line.endswith(TOO_FEW) for line in lines)
    return FEW if few else finding.verdict.name.lower()


def _undecided(findings: Sequence[Finding]) -> str:
    """Said once for all claims that too few runs leave without a verdict."""
    number = [_kind(finding) for finding in findings].count(FEW)
    if not number:
        return ""
    which = f"{number} of {len(findings)} claims cannot"
    return (
        f'<p class="notices">{"None of the claims can" if number == len(findings) else which} be judged by what was '
        f"run: a setting needs {LEAST_PAIRS} seeds for which both methods have a result, a measurement {LEAST_RUNS} "
        "runs. They stand below without a verdict, with what was measured; <code>mjnav paper</code> without "
        "<code>--quick</code> runs enough.</p>"
    )


def _counts(findings: Iterable[Finding]) -> str:
    count = Counter(map(_kind, findings))
    return " ".join(
        f'<span class="{kind}" title="{name}">{mark}&#8239;{count[kind]}</span>'
        for kind, (mark, name) in KINDS.items()
        if count[kind] and kind != FEW
    )


def _filter(findings: Sequence[Finding]) -> str:
    """The controls, which a script shows: without one all claims are there."""
    count = Counter(map(_kind, findings))
    options = "".join(
        f'<option value="{kind}">{name} ({count[kind]})</option>' for kind, (_, name) in KINDS.items() if count[kind]
    )
    return f"""<form id="filter" role="search" aria-label="Claims" hidden><h2>Claims</h2>
<label>verdict <select id="verdict"><option value="">all ({len(findings)})</option>{options}</select></label>
<label>text <input type="search" id="words" placeholder="control cost"></label>
<output id="shown" aria-live="polite"></output></form>"""


def _item(name: str, item: Published) -> str:
    title, limits, basis = escape(load(name).title), load(name).limits, item.basis
    parameters = "".join(
        f"<details><summary>Parameters: {escape(what)}</summary><pre>{escape(text)}</pre></details>"
        for what, text in basis.parameters.items()
    )
    facts = f"{basis.command}; revision {_short(basis.revision)}"
    facts += f"; {basis.episodes} episodes" if basis.asked_for else ""
    return f"""<section class="item" id="{name}"><h2>{title}</h2>
<a href="{name}/{PRINT}"><img src="{name}/{PICTURE}" alt="{title}" loading="lazy"></a>
<p><a href="{name}/{PRINT}">PDF</a> · <a href="{name}/{DATA}">data (CSV)</a> <small>{escape(facts)}</small></p>
{f'<p class="limits">{escape(limits)}</p>' if limits else ""}{_gaps(basis)}
<ul class="claims">{"".join(map(_claim, item.findings))}</ul>{parameters}</section>"""


def _claim(finding: Finding) -> str:
    """A claim with its verdict, and the evidence below it."""
    heading, *lines = finding.evidence.splitlines()
    kind = _kind(finding)
    mark, name = KINDS[kind]
    verdict = f'<strong class="{kind}">{mark} {name}</strong>'
    if kind == FEW:
        verdict, heading = "", ""
        lines = [line.removesuffix(TOO_FEW).removesuffix("; ") for line in lines]
    evidence = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return (
        f'<li class="claim" data-verdict="{kind}"><details><summary>{verdict} {escape(finding.claim)} '
        f"<small>({escape(finding.source)}) {escape(heading)}</small></summary><ul>{evidence}</ul></details></li>"
    )


def _gaps(basis: Basis) -> str:
    """What of the item's episodes is missing."""
    texts = []
    if basis.episodes < basis.asked_for:
        texts.append(f"{basis.episodes} of {basis.asked_for} episodes were run.")
    if basis.failed:
        texts.append(f"{basis.failed} episodes failed and have no result.")
    if basis.left_out:
        texts.append(f"{basis.left_out} rows are left out: they are of other scenarios or seeds.")
    if basis.absent:
        rows = "".join(f"<li>{escape(cell)}</li>" for cell in basis.absent)
        texts.append(
            f"<details><summary>{len(basis.absent)} cells were not run at all</summary><ul>{rows}</ul></details>"
        )
    return f'<div class="gaps">{" ".join(texts)}</div>' if texts else ""
