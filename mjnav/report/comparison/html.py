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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import inf, isfinite
from pathlib import Path
from urllib.parse import quote

from mjnav.printable import printable
from mjnav.report.comparison.forest import forest_svg, forests
from mjnav.report.comparison.notes import layouts, meaning, sight, warnings
from mjnav.report.comparison.shown import Shown, ShownCell, ShownTable, of_wins, shown_table
from mjnav.report.comparison.text import ABOUT, shown_between, win_ratio_between
from mjnav.report.figure_names import definition, figure_name
from mjnav.report.look.document import frame
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.estimates import Estimate, WinRatio
from mjnav.study.compare.study_comparison import CellPlace, StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed, run_commands, worst_seeds
from mjnav.study.keep import kept_log
from mjnav.study.store.store import Store
from mjnav.study.study_file import StudyFile

# ---------------------------------------------------------------------------------------- table cells


def html_cell(cell: ShownCell) -> str:
    """The table cell."""
    e, below, found = cell.estimate, cell.below, cell.difference
    if e is None:
        return f'<td data-figure="{cell.figure}" data-value="{_raw(cell.value)}">{cell.own.value}</td>'
    inner = f'<div data-n="{e.num}"{_data(e)}>{_numbers("strong", cell.own)}</div>'
    if below is not None and found is not None:
        kind = "difference marked" if below.marked else "difference"
        e = found.ratio if cell.as_ratio and found.ratio is not None else found.estimate
        data = f'data-pairs="{e.num}" data-p="{_raw(found.p)}"{_data(e)}'
        inner += f'<div class="{kind}" {data}>{_numbers("b", below)}</div>'
    return f'<td data-figure="{cell.figure}">{inner}</td>'


def wins_cell(wins: WinRatio | None, shown: Shown) -> str:
    """The table cell of a win ratio; empty of a method against itself."""
    if wins is None:
        return '<td data-value=""></td>'
    kind = ' class="marked"' if shown.marked else ""
    data = f'data-wins="{wins.wins}" data-losses="{wins.losses}" data-ties="{wins.ties}" data-p="{_raw(wins.p)}"'
    return f"<td><div{kind} {data}{_data(of_wins(wins))}>{_numbers('strong', shown)}</div></td>"


def _data(e: Estimate) -> str:
    low, high = e.interval or (None, None)
    return f' data-value="{_raw(e.value)}" data-low="{_raw(low)}" data-high="{_raw(high)}"'


def _raw(value: float | None) -> str:
    if value == inf:
        return "Infinity"
    return repr(value) if value is not None and isfinite(value) else ""


def _numbers(element: str, shown: Shown) -> str:
    mark = " *" * shown.marked
    rest = " ".join(part for part in (shown.interval, shown.count) if part)
    tail = f" <span>{rest}</span>" if rest else ""
    return f"<{element}>{shown.value}{mark}</{element}>{tail}".replace("-", "−")


# ---------------------------------------------------------------------------- background of the study


@dataclass(frozen=True, slots=True)
class Background:
    """Facts about a folder of results; cells and methods stand under their labels."""

    folder: Path  # of the results
    page: Path  # the page's own path, from which links count
    made: str  # when the page was made, and by which version
    study_text: str  # the study file; "" without a study
    parameters: Mapping[str, tuple[str, ...]]  # of the controller by method, as JSON; several where cells differ
    worst: Mapping[CellPlace, tuple[WorstSeed, ...]]
    commands: Mapping[CellPlace, str]  # that repeat an episode, but for its seed


def background(store: Store, study: StudyFile | None, results: StudyComparison, *, page: Path, made: str) -> Background:
    """What the store and the study file say. Raises MjnavError as `Store.rows` does."""
    text, labels = store.study(), results.labels
    parameters: dict[str, tuple[str, ...]] = {}
    for name, method, control in sorted(store.count_by(["study", "method", "control"]), key=str):
        if name == results.study and method is not None and control is not None:
            method = labels.methods.get(method, method)
            parameters[method] = (*parameters.get(method, ()), control)
    return Background(
        folder=store.folder,
        page=page,
        made=made,
        study_text=text,
        parameters=parameters,
        worst={labels.place(cell): seeds for cell, seeds in worst_seeds(store, results.study).items()},
        commands={labels.place(cell): c for cell, c in run_commands(study, text).items()} if study is not None else {},
    )


def parameters_html(found: Background) -> str:
    """The parameters of every method, and the study file."""
    rows = "".join(
        f'<tr><th scope="row">{_text(method)}</th><td>{"<br>".join(_text(_listed(text)) for text in texts)}</td></tr>'
        for method, texts in found.parameters.items()
    )
    head = '<thead><tr><th scope="col">method</th><th scope="col">parameters, with defaults</th></tr></thead>'
    table = f'<div class="wide"><table class="seeds">{head}<tbody>{rows}</tbody></table></div>' if rows else ""
    lines = "\n".join(map(printable, found.study_text.split("\n")))
    study = f"<details><summary>Study file</summary><pre>{escape(lines)}</pre></details>" if lines else ""
    return f"<details><summary>Parameters of the methods</summary>{table}</details>{study}"


def worst_html(found: Background, table: Comparison) -> str:
    """The worst seeds of every method of a table, each with its report or the command that makes one."""
    rows = "".join(
        f'<tr><th scope="row">{_text(row.method)}</th><td data-value="{seed.seed}">{seed.seed}</td>'
        f"<td>{_text(seed.why)}</td><td>{_way(found, (table.scene, table.setting, row.method), seed)}</td></tr>"
        for row in table.rows
        for seed in found.worst.get((table.scene, table.setting, row.method), ())
    )
    names = ("method", "seed", "what happened", "look at it")
    head = "".join(f'<th scope="col">{name}</th>' for name in names)
    return (
        '<details><summary>Worst seeds of every method</summary><div class="wide"><table class="seeds sorted">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></details>"
        if rows
        else ""
    )


def _way(found: Background, cell: CellPlace, seed: WorstSeed) -> str:
    """A link to the report beside the log, or the commands that lead to one."""
    log = kept_log(found.folder, seed.log)
    if log is not None and (report := log.with_suffix(".html")).is_file():
        address = quote(os.path.relpath(report, found.page.parent))
        return f'<a href="./{escape(address)}">report</a>'
    if log is not None:
        return f"<code>mjnav report {_text(shlex.quote(str(log)))}</code>"
    if cell in found.commands:
        return f"<code>{_text(found.commands[cell])} --seed {seed.seed} --log seed{seed.seed}.mcap</code>"
    return ""


def _listed(text: str) -> str:
    """The values of a JSON object, name by name."""
    return ", ".join(_parts(text))


def _parts(text: str) -> Iterator[str]:
    try:
        document = json.loads(text)
    except ValueError:
        document = None
    if not isinstance(document, dict):
        yield text
        return
    yield from (f"{name} = {json.dumps(value)}" for name, value in document.items())


def _text(text: str) -> str:
    return escape(printable(text))


# ----------------------------------------------------------------------------------------------- page


REVISION = re.compile(r"\b([0-9a-f]{10})[0-9a-f]{30}\b")  # of git, of which the first digits are enough
CHARTS = (
    "Charts: points are values, lines their 95 % intervals; filled points are differences that have a *. A heading of "
    "a table sorts its rows."
)


def html(results: StudyComparison, found: Background | None = None) -> str:
    """The page; with its background, also how it was made and where the worst episodes can be seen."""
    results = results.labelled
    own = frame("mjnav compare", "mjnav.report.comparison", ["page.css"], ["sort.js"])
    count = (
        f"{results.num_episodes} episodes, {len(results.tables)} {'table' if len(results.tables) == 1 else 'tables'}"
    )
    made = f"Episodes run with mjnav {', '.join(results.revisions)}." + (f" Page made {found.made}." if found else "")
    made = REVISION.sub(r"\1", made)
    parts = [
        '<!doctype html>\n<html lang="en">',
        own.head(printable(f"{results.study}: comparison")),
        f'<body>\n<h1>{_text(results.study)}</h1>\n<p class="about">{count}</p>\n<p class="about">{_text(made)}</p>',
        sentences("notices", warnings(results)),
        _contents(results.tables),
        *(_section(i, results, table, found) for i, table in enumerate(results.tables)),
        f"<h2>How to read it</h2>{sentences('about', [*meaning(results), CHARTS])}",
        f"<h2>Parameters</h2>{parameters_html(found)}" if found else "",
        f"<footer>Made by <code>mjnav compare</code>.</footer>\n{own.script_elements}\n</body>\n</html>\n",
    ]
    return "\n".join(part for part in parts if part)


def sentences(kind: str, texts: Sequence[str]) -> str:
    """A list of sentences, of a class of the page."""
    items = "".join(f"<li><p>{_text(sentence)}</p></li>" for sentence in texts)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _contents(tables: Sequence[Comparison]) -> str:
    if len(tables) < 2:
        return ""
    links = (f'<li><a href="#table{i}">{_text(_place(table))}</a></li>' for i, table in enumerate(tables))
    return f'<nav aria-label="Tables"><ul>{"".join(links)}</ul></nav>'


def _place(table: Comparison) -> str:
    return f"{table.scene}, {table.setting}"


def _section(number: int, results: StudyComparison, table: Comparison, found: Background | None) -> str:
    shown = shown_table(results, table)
    reference = f"differences from {table.reference}" if table.reference else ""
    about = "; ".join(filter(None, (layouts(table.num_layouts), sight(table.people), reference)))
    body = "\n".join(
        f'<tr><th scope="row">{_text(row.method)}</th><td data-value="{table.rows[i].num}">{_text(row.episodes)}</td>'
        f"{''.join(map(html_cell, row.cells))}</tr>"
        for i, row in enumerate(shown.rows)
    )
    charts = "".join(map(forest_svg, forests(table, results.figures)))
    return (
        f'<section id="table{number}">\n<h2>{_text(_place(table))} <small>{_text(about)}</small></h2>\n'
        f'<div class="charts">{charts}</div>'
        f'<div class="wide" tabindex="0" role="region" aria-label="{_text(_place(table))}"><table class="sorted">\n'
        f"<thead><tr>{_head(shown)}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>\n"
        f"{_rivals(table)}{worst_html(found, table) if found else ''}</section>"
    )


def _rivals(table: Comparison) -> str:
    """The win ratio of every two methods, where they were asked for."""
    if not table.rivals:
        return ""
    methods = [row.method for row in table.rows]
    head = "".join(_heading(*one) for one in (("method", "", ""), *((f"against {one}", "", "") for one in methods)))
    rows = "".join(
        f'<tr><th scope="row">{_text(method)}</th>'
        + "".join(
            wins_cell(win_ratio_between(table, method, other), shown_between(table, method, other)) for other in methods
        )
        + "</tr>"
        for method in methods
    )
    about = _text(f"{_place(table)}: {ABOUT}")
    return (
        f"<h3>{_text(ABOUT.capitalize())}</h3>"
        f'<div class="wide" tabindex="0" role="region" aria-label="{about}"><table class="sorted">'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _head(shown: ShownTable) -> str:
    """The headings: words and units, with the definition and the name that `--figure` takes."""
    fixed = (("method", "", ""), ("episodes", "", "rows, and of how many where some are missing or failed"))
    named = [(*figure_name(figure), f"{figure}: {definition(figure)}") for figure in shown.figures]
    return "".join(_heading(*one) for one in (*fixed, *named))


def _heading(words: str, unit: str, text: str) -> str:
    title = f' title="{_text(text)}"' if text else ""
    return f'<th scope="col"{title}>{_text(words)}{f" <span>[{_text(unit)}]</span>" if unit else ""}</th>'
