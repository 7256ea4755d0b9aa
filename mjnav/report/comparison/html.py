"""Comparisons of methods as one HTML page: charts, sortable tables and the study's background; it loads nothing else.

Every figure is there in full precision: what is printed is rounded; `data-` attributes bear the values themselves. A
table cell has one figure of one method: its numbers, and its difference from the reference.

The background is what the page says of a study beside its tables: how it was made, with which parameters, and its worst
episodes.
"""

import json
import os
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from math import inf, isfinite
from pathlib import Path
from urllib.parse import quote

from mjnav.printable import printable
from mjnav.report.comparison.forest import forests
from mjnav.report.comparison.shown import Cell, Column, ShownTable, about, meaning, shown_tables, warnings
from mjnav.report.figure_text import Shown
from mjnav.report.look.document import frame
from mjnav.study.compare.cell_rows import CellPlace
from mjnav.study.compare.study_comparison import Comparison, StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed, run_commands, worst_seeds
from mjnav.study.keep import kept_log
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile

# --------------------------------------------------------------------------------------------- tables


def _table(heads: Iterable[str], rows: Iterable[tuple[str, str]], kind: str, label: str = "") -> str:
    """A table in a box that scrolls; a row has its head as text, and its cells as HTML. Nothing without rows."""
    body = "\n".join(f'<tr><th scope="row">{_text(head)}</th>{cells}</tr>' for head, cells in rows)
    region = f' tabindex="0" role="region" aria-label="{_text(label)}"' if label else ""
    head = f"<thead><tr>{''.join(heads)}</tr></thead>"
    table = f'<table class="{kind}">\n{head}\n<tbody>\n{body}\n</tbody></table>'
    return f'<div class="wide"{region}>{table}</div>\n' if body else ""


def _head(words: str, unit: str = "", title: str = "") -> str:
    title = f' title="{_text(title)}"' if title else ""
    return f'<th scope="col"{title}>{_text(words)}{f" <span>[{_text(unit)}]</span>" if unit else ""}</th>'


def _shown(shown: ShownTable, label: str) -> str:
    """A table of figures: headings with words, units, definitions and the names that `--figure` takes."""
    heads = [_head("method"), *(_head(*column.name, column.about) for column in shown.columns)]
    rows = ((method, "".join(map(_cell, shown.columns, cells))) for method, cells in shown.rows)
    return _table(heads, rows, "sorted", label)


def _cell(column: Column, cell: Cell) -> str:
    own = _numbers("strong", cell.own, "marked" * cell.own.marked)
    below = "" if cell.below is None else _numbers("b", cell.below, "difference" + " marked" * cell.below.marked)
    return f'<td data-figure="{_text(column.figure)}">{own}{below}</td>'


def _numbers(element: str, shown: Shown, kind: str) -> str:
    """The printed numbers, and in attributes the values themselves."""
    e = shown.estimate
    low, high = (None, None) if e is None else e.interval or (None, None)
    values = {"value": e and e.value, "low": low, "high": high, "n": e and e.num, "p": shown.p}
    data = "".join(f' data-{name}="{_raw(value)}"' for name, value in values.items())
    rest = " ".join(part for part in (shown.interval, shown.count) if part)
    text = f"<{element}>{shown.value}{' *' * shown.marked}</{element}>{f' <span>{rest}</span>' if rest else ''}"
    return f'<div class="{kind}"{data}>{text.replace("-", "−")}</div>'


def _raw(value: float | None) -> str:
    if value == inf:
        return "Infinity"
    return repr(value) if value is not None and isfinite(value) else ""


def _text(text: str) -> str:
    return escape(printable(text))


# ---------------------------------------------------------------------------- background of the study


@dataclass(frozen=True, slots=True)
class Background:
    """Facts about a folder of results."""

    folder: Path  # of the results
    page: Path  # the page's own path, from which links count
    made: str  # when the page was made, and by which version
    study_text: str  # the study file; "" without a study
    parameters: Mapping[str, tuple[str, ...]]  # of the controller by method, as JSON; several where cells differ
    worst: Mapping[CellPlace, tuple[WorstSeed, ...]]
    commands: Mapping[CellPlace, str]  # that repeat an episode, but for its seed


def background(store: Store, study: StudyFile | None, results: StudyComparison, *, page: Path, made: str) -> Background:
    """What the store and the study file say. Raises MjnavError as `Store.rows` does."""
    parameters: dict[str, tuple[str, ...]] = {}
    for name, method, control in sorted(store.count_by(["study", "method", "control"]), key=str):
        if name == results.study and method is not None and control is not None:
            parameters[method] = (*parameters.get(method, ()), control)
    return Background(
        folder=store.folder,
        page=page,
        made=made,
        study_text=store.study(),
        parameters=parameters,
        worst=worst_seeds(store, results.study),
        commands=run_commands(study, store.study()) if study is not None else {},
    )


def _parameters(results: StudyComparison, facts: Background) -> str:
    """The parameters of every method, and the study file."""
    labels = {row.method: row.label for _, row in results.rows}
    rows = (
        (labels.get(method, method), f"<td>{'<br>'.join(_text(_listed(text)) for text in texts)}</td>")
        for method, texts in facts.parameters.items()
    )
    table = _table([_head("method"), _head("parameters, with defaults")], rows, "seeds")
    lines = "\n".join(map(printable, facts.study_text.split("\n")))
    study = f"<details><summary>Study file</summary><pre>{escape(lines)}</pre></details>" if lines else ""
    return f"<h2>Parameters</h2><details><summary>Parameters of the methods</summary>{table}</details>{study}"


def _listed(text: str) -> str:
    """The values of a JSON object, name by name."""
    try:
        document = json.loads(text)
    except ValueError:
        document = None
    if not isinstance(document, dict):
        return text
    return ", ".join(f"{name} = {json.dumps(value)}" for name, value in document.items())


def _worst(facts: Background, table: Comparison) -> str:
    """The worst seeds of every method of a table, each with its report or the command that makes one."""
    rows = []
    for row in table.rows:
        cell = (table.scene, table.setting, row.method)
        for seed in facts.worst.get(cell, ()):
            number = f'<td data-value="{seed.seed}">{seed.seed}</td>'
            rows.append((row.label, f"{number}<td>{_text(seed.why)}</td><td>{_way(facts, cell, seed)}</td>"))
    heads = map(_head, ("method", "seed", "what happened", "look at it"))
    shown = _table(heads, rows, "seeds sorted")
    return f"<details><summary>Worst seeds of every method</summary>{shown}</details>" if rows else ""


def _way(facts: Background, cell: CellPlace, seed: WorstSeed) -> str:
    """A link to the report beside the log, or the commands that lead to one."""
    log = kept_log(facts.folder, seed.log)
    if log is not None and (report := log.with_suffix(".html")).is_file():
        address = quote(os.path.relpath(report, facts.page.parent))
        return f'<a href="./{escape(address)}">report</a>'
    if log is not None:
        return f"<code>mjnav report {_text(shlex.quote(str(log)))}</code>"
    if cell in facts.commands:
        return f"<code>{_text(facts.commands[cell])} --seed {seed.seed} --log seed{seed.seed}.mcap</code>"
    return ""


# ----------------------------------------------------------------------------------------------- page


REVISION = re.compile(r"\b([0-9a-f]{10})[0-9a-f]{30}\b")  # of git, of which the first digits are enough
CHARTS = (
    "Charts: points are values, lines their 95 % intervals; filled points are differences that have a *. A heading of "
    "a table sorts its rows."
)


def html(results: StudyComparison, facts: Background | None = None) -> str:
    """The page; with its background, also how it was made and where the worst episodes can be seen."""
    own = frame("mjnav compare", "mjnav.report.comparison", ["page.css"], ["sort.js"])
    tables = "table" if len(results.tables) == 1 else "tables"
    made = f"Episodes run with mjnav {', '.join(results.revisions)}." + (f" Page made {facts.made}." if facts else "")
    made = REVISION.sub(r"\1", made)
    links = [f'<li><a href="#table{i}">{_text(table.title)}</a></li>' for i, table in enumerate(results.tables)]
    parts = [
        '<!doctype html>\n<html lang="en">',
        own.head(printable(f"{results.study}: comparison")),
        f"<body>\n<h1>{_text(results.study)}</h1>",
        f'<p class="about">{results.num_episodes} episodes, {len(results.tables)} {tables}</p>',
        f'<p class="about">{_text(made)}</p>',
        _sentences("notices", warnings(results)),
        f'<nav aria-label="Tables"><ul>{"".join(links)}</ul></nav>' if len(links) > 1 else "",
        *(_section(f"table{i}", results, table, facts) for i, table in enumerate(results.tables)),
        f"<h2>How to read it</h2>{_sentences('about', [*meaning(results), CHARTS])}",
        _parameters(results, facts) if facts else "",
        f"<footer>Made by <code>mjnav compare</code>.</footer>\n{own.script_elements}\n</body>\n</html>\n",
    ]
    return "\n".join(part for part in parts if part)


def _sentences(kind: str, texts: Iterable[str]) -> str:
    """A list of sentences, of a class of the page."""
    items = "".join(f"<li><p>{_text(sentence)}</p></li>" for sentence in texts)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _section(anchor: str, results: StudyComparison, table: Comparison, facts: Background | None) -> str:
    reference = [f"differences from {table.reference_label}"] if table.reference else []
    heading = f"{_text(table.title)} <small>{_text('; '.join([*about(table), *reference]))}</small>"
    charts = "".join(forests(table))
    tables = ""
    for shown in shown_tables(table, ratios=results.ratios):
        tables += f"<h3>{_text(shown.title)}</h3>" if shown.title else ""
        tables += _shown(shown, f"{table.title}: {shown.title}" if shown.title else table.title)
    worst = _worst(facts, table) if facts else ""
    return f'<section id="{anchor}">\n<h2>{heading}</h2>\n<div class="charts">{charts}</div>{tables}{worst}</section>'
