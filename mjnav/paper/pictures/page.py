"""`index.html` of the paper: every claim with its verdict, then every item's figure, parameters, data and command.

Made of the files that `publish` left; it needs no network and no script.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from mjnav.paper import ITEMS
from mjnav.paper.by_run import LEAST_RUNS
from mjnav.paper.finding import LEAST_PAIRS, Finding, Verdict
from mjnav.paper.pictures.publish import DATA, PICTURE, PRINT, read

MARKS = {Verdict.HOLDS: "✓", Verdict.PARTLY: "◐", Verdict.MIXED: "±", Verdict.FAILS: "✗", Verdict.OPEN: "?"}

STYLE = """
:root { color-scheme: light dark; --ink: #1d1d1f; --quiet: #6b6b70; --line: #d9d9de; --page: #fff; --panel: #f6f6f8;
  --holds: #00704f; --fails: #b3441a; --partly: #8a6100; --open: #6b6b70; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e8ea; --quiet: #a0a0a8; --line: #3a3a40; --page: #17171a;
  --panel: #212126; --holds: #4cc79d; --fails: #ff9063; --partly: #e6b84a; --open: #a0a0a8; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 72rem; background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 .5rem; } h2 { font-size: 1.2rem; margin: 3rem 0 .5rem; }
p { max-width: 46rem; } a { color: inherit; } small, .quiet { color: var(--quiet); }
table { border-collapse: collapse; width: 100%; font-size: .9rem; } .wide { overflow-x: auto; }
th, td { text-align: left; vertical-align: top; padding: .35rem .75rem .35rem 0; border-bottom: 1px solid var(--line); }
.holds { color: var(--holds); } .fails { color: var(--fails); } .partly, .mixed { color: var(--partly); }
.open { color: var(--open); } td.verdict { font-weight: 600; min-width: 9rem; }
.gaps { color: var(--fails); }
img { display: block; max-width: 100%; height: auto; background: #fff; border-radius: 6px; }
pre { overflow-x: auto; background: var(--panel); padding: .75rem; border-radius: 6px; font-size: .8rem; }
details { margin: .25rem 0; } summary { cursor: pointer; }
ul { padding-left: 1.2rem; margin: .25rem 0; }
"""


def page(folder: Path, about: Mapping[str, str]) -> str:
    """The page of what is in `folder`, whose items each have a folder of their name. `about` is printed at the top."""
    found = {name: read(folder / name) for name in ITEMS}
    there = {name: entry for name, entry in found.items() if entry is not None}
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        "<title>The paper, figure by figure</title>",
        f"<style>{STYLE}</style></head><body>",
        "<h1>The paper, figure by figure</h1>",
        "<p>What the figures and comparisons of Nair et al., “Non Holonomic Collision Avoidance under Non-Parametric "
        'Uncertainty: A Hilbert Space Approach” (<a href="https://arxiv.org/abs/2112.13034">arXiv 2112.13034</a>) '
        "show, measured again: in the paper’s kinematic setting and in MuJoCo, with the paper’s direct samples and "
        "with filtered ones. Claims are worded here and tested in every setting, over the seeds that both methods have "
        f"a result for, paired by seed. Fewer than {LEAST_PAIRS} of them decide nothing, nor do fewer than "
        f"{LEAST_RUNS} runs of a measurement. The tests of an item are corrected together for their number (Holm): "
        "where nothing differs, one item in twenty says anywhere that something does. Intervals hold with 95 % each, "
        "and are not corrected. An episode that failed has no result: it counts neither as a success nor as a "
        "collision.</p>",
        _about(about),
        "<h2>Claims</h2>",
        _claims(there),
    ]
    parts += [_item(folder, name, *entry) for name, entry in there.items()]
    missing = [name for name in ITEMS if name not in there]
    if missing:
        parts.append(f'<p class="quiet">Not run: {escape(", ".join(missing))}.</p>')
    return "\n".join([*parts, "</body></html>", ""])


def _about(about: Mapping[str, str]) -> str:
    return (
        "<p><small>" + "<br>".join(f"{escape(key)}: {escape(value)}" for key, value in about.items()) + "</small></p>"
    )


def _claims(there: Mapping[str, tuple[Sequence[Finding], Any]]) -> str:
    every = [(name, finding) for name, (findings, _) in there.items() for finding in findings]
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


def _item(folder: Path, name: str, findings: Sequence[Finding], about: Mapping[str, Any]) -> str:
    item = ITEMS[name]
    claims = "".join(
        f'<details><summary><strong class="{finding.verdict.name.lower()}">{MARKS[finding.verdict]}</strong> '
        f"{escape(finding.claim)} <small>({escape(finding.source)}): {escape(finding.verdict.value)}</small></summary>"
        f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in finding.evidence.splitlines())}</ul></details>"
        for finding in findings
    )
    data = [f'<a href="{name}/{PRINT}">PDF</a>', f'<a href="{name}/{DATA}">data (CSV)</a>']
    parameters = "".join(
        f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>"
        for title, text in about.get("parameters", {}).items()
    )
    facts = "; ".join(f"{key} {value}" for key, value in about.items() if isinstance(value, str | int))
    return (
        f'<h2 id="{name}">{escape(item.title)}</h2>'
        f'<a href="{name}/{PRINT}"><img src="{name}/{PICTURE}" alt="{escape(item.title)}" loading="lazy"></a>'
        f"<p>{' · '.join(data)}<br><small>{escape(facts)}</small></p>{_gaps(about)}{claims}{parameters}"
    )


def _gaps(about: Mapping[str, Any]) -> str:
    """What of the item's episodes is not there, and whether its verdicts are of before the correction."""
    told = []
    asked, run, failed = (about.get(key, 0) for key in ("asked for", "episodes", "failed"))
    if run < asked:
        told.append(f"{run} of {asked} episodes were run.")
    if failed:
        told.append(f"{failed} episodes failed and have no result.")
    if about.get("left out"):
        told.append(f"{about['left out']} rows are left out: they are of other scenarios or seeds.")
    if "correction" not in about:
        told.append("The verdicts are of an earlier version, not corrected for their number.")
    absent = about.get("absent", [])
    if absent:
        rows = "".join(f"<li>{escape(cell)}</li>" for cell in absent)
        told.append(f"<details><summary>{len(absent)} cells were not run at all</summary><ul>{rows}</ul></details>")
    return f'<div class="gaps">{" ".join(told)}</div>' if told else ""
