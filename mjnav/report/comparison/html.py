"""Comparisons of methods as one HTML page: sortable tables and the study's background; it loads nothing else.

Every figure is there in full precision: what is printed is rounded; `data-` attributes bear the values themselves. A
table cell has one figure of one method: its numbers, its difference from the reference, and below each its interval on
an axis that the column shares.

The background is what the page says of a study beside its tables: how it was made, with which parameters, and its worst
episodes.
"""

import os
import re
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from math import inf, isfinite
from pathlib import Path
from urllib.parse import quote

from mjnav.printable import printable
from mjnav.report.comparison.shown import Cell, Column, ShownTable, about, meaning, shown_tables, warnings
from mjnav.report.document import frame
from mjnav.report.figure_text import Shown
from mjnav.study.compare.cell_rows import CellPlace
from mjnav.study.compare.study_comparison import Comparison, StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed, run_commands, worst_seeds
from mjnav.study.keep import kept_log
from mjnav.study.store import Store
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
    own, below = [other.own for other in column.cells], [other.below for other in column.cells if other.below]
    text = _numbers("strong", cell.own, "marked" * cell.own.marked, own)
    if cell.below is not None:
        text += _numbers("b", cell.below, "difference" + " marked" * cell.below.marked, below)
    return f'<td data-figure="{_text(column.figure)}">{text}</td>'


def _numbers(element: str, shown: Shown, kind: str, column: Sequence[Shown]) -> str:
    """The printed numbers, in attributes the values themselves, and a drawing of the interval."""
    e = shown.estimate
    low, high = (None, None) if e is None else e.interval or (None, None)
    values = {"value": e and e.value, "low": low, "high": high, "n": e and e.num, "p": shown.p}
    data = "".join(f' data-{name}="{_raw(value)}"' for name, value in values.items())
    rest = " ".join(part for part in (shown.interval, shown.count) if part)
    text = f"<{element}>{shown.value}{' *' * shown.marked}</{element}>{f' <span>{rest}</span>' if rest else ''}"
    return f'<div class="{kind}"{data}>{text.replace("-", "−")}{_drawn(shown, column)}</div>'


def _drawn(shown: Shown, column: Sequence[Shown]) -> str:
    """The value and its interval on an axis from the least to the greatest end in a column."""
    intervals = [part.estimate.interval for part in column if part.estimate is not None and part.estimate.interval]
    ends = [end for interval in intervals for end in interval if isfinite(end)]
    e = shown.estimate
    if e is None or e.interval is None or not isfinite(sum(e.interval)) or min(ends) == max(ends):
        return ""
    low, value, high = (
        100.0 * (x - min(ends)) / (max(ends) - min(ends)) for x in (e.interval[0], e.value, e.interval[1])
    )
    line = f'<line x1="{low:.1f}" x2="{high:.1f}" y1="3" y2="3"/><circle cx="{value:.1f}" cy="3" r="2.5"/>'
    return f'<svg viewBox="-3 0 106 6" aria-hidden="true">{line}</svg>'


def _raw(value: float | None) -> str:
    if value == inf:
        return "Infinity"
    return repr(value) if value is not None and isfinite(value) else ""


def _text(text: str) -> str:
    return escape(printable(text))


# ---------------------------------------------------------------------------- background of the study


Way = Callable[[CellPlace, WorstSeed], str]  # how an episode of a cell can be looked at, as HTML


def _parameters(store: Store, results: StudyComparison) -> str:
    """The parameters of every method, and the study file."""
    labels = {row.method: row.label for _, row in results.rows}
    parameters: dict[str, list[str]] = {}  # as JSON; several where cells differ
    for name, method, control in sorted(store.count_by(["study", "method", "control"]), key=str):
        if name == results.study and method is not None and control is not None:
            parameters.setdefault(method, []).append(control)
    rows = (
        (labels.get(method, method), f"<td>{'<br>'.join(map(_text, texts))}</td>")
        for method, texts in parameters.items()
    )
    table = _table([_head("method"), _head("parameters, with defaults")], rows, "seeds")
    lines = "\n".join(map(printable, store.study().split("\n")))
    study = f"<details><summary>Study file</summary><pre>{escape(lines)}</pre></details>" if lines else ""
    return f"<h2>Parameters</h2><details><summary>Parameters of the methods</summary>{table}</details>{study}"


def _worst(table: Comparison, worst: Mapping[CellPlace, Sequence[WorstSeed]], way: Way) -> str:
    """The worst seeds of every method of a table, each with its report or the command that makes one."""
    rows = []
    for row in table.rows:
        cell = (table.scene, table.setting, row.method)
        for seed in worst.get(cell, ()):
            number = f'<td data-value="{seed.seed}">{seed.seed}</td>'
            rows.append((row.label, f"{number}<td>{_text(seed.why)}</td><td>{way(cell, seed)}</td>"))
    shown = _table(map(_head, ("method", "seed", "what happened", "look at it")), rows, "seeds sorted")
    return f"<details><summary>Worst seeds of every method</summary>{shown}</details>" if rows else ""


def _way(folder: Path, commands: Mapping[CellPlace, str], page: Path) -> Way:
    """A link to the report beside an episode's log, or the commands that lead to one; links count from the page."""

    def way(cell: CellPlace, seed: WorstSeed) -> str:
        log = kept_log(folder, seed.log)
        if log is not None and (report := log.with_suffix(".html")).is_file():
            return f'<a href="./{escape(quote(os.path.relpath(report, page.parent)))}">report</a>'
        if log is not None:
            return f"<code>mjnav report {_text(shlex.quote(str(log)))}</code>"
        if cell in commands:
            return f"<code>{_text(commands[cell])} --seed {seed.seed} --log seed{seed.seed}.mcap</code>"
        return ""

    return way


# ----------------------------------------------------------------------------------------------- page


REVISION = re.compile(r"\b([0-9a-f]{10})[0-9a-f]{30}\b")  # of git, of which the first digits are enough
DRAWN = (
    "Lines below figures are their 95 % intervals, those of a column on one axis. A heading of a table sorts its rows."
)


def html(
    results: StudyComparison, study: StudyFile | None = None, *, page: Path = Path("compare.html"), made: str = ""
) -> str:
    """The page, which will be at `page`, with how the study was made and where its worst episodes can be seen.

    `made` says when the page was made, and by which version.

    Raises MjnavError as `Store.rows` does.
    """
    store = Store(results.folder)
    worst = worst_seeds(store, results.study)
    way = _way(store.folder, run_commands(study, store) if study is not None else {}, page)
    own = frame("mjnav compare", "mjnav.report.comparison", ["page.css"], ["sort.js"])
    tables = "table" if len(results.tables) == 1 else "tables"
    made = f"Episodes run with mjnav {', '.join(results.revisions)}. {made}"
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
        *(_section(f"table{i}", results, table, worst, way) for i, table in enumerate(results.tables)),
        f"<h2>How to read it</h2>{_sentences('about', [*meaning(results), DRAWN])}",
        _parameters(store, results),
        f"<footer>Made by <code>mjnav compare</code>.</footer>\n{own.script_elements}\n</body>\n</html>\n",
    ]
    return "\n".join(part for part in parts if part)


def _sentences(kind: str, texts: Iterable[str]) -> str:
    """A list of sentences, of a class of the page."""
    items = "".join(f"<li><p>{_text(sentence)}</p></li>" for sentence in texts)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _section(
    anchor: str,
    results: StudyComparison,
    table: Comparison,
    worst: Mapping[CellPlace, Sequence[WorstSeed]],
    way: Way,
) -> str:
    reference = [f"differences from {table.reference_label}"] if table.reference else []
    heading = f"{_text(table.title)} <small>{_text('; '.join([*about(table), *reference]))}</small>"
    tables = ""
    for shown in shown_tables(table, ratios=results.ratios):
        tables += f"<h3>{_text(shown.title)}</h3>" if shown.title else ""
        tables += _shown(shown, f"{table.title}: {shown.title}" if shown.title else table.title)
    return f'<section id="{anchor}">\n<h2>{heading}</h2>\n{tables}{_worst(table, worst, way)}</section>'
