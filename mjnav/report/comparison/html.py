"""Comparisons as one page: charts, tables whose columns sort, every figure in full precision, nothing from outside."""

import re
from collections.abc import Sequence
from html import escape

from mjnav.printable import printable
from mjnav.report.comparison.background import Background, parameters_html, worst_html
from mjnav.report.comparison.forest import forest_svg, forests
from mjnav.report.comparison.html_cell import html_cell, wins_cell
from mjnav.report.comparison.layouts import layouts
from mjnav.report.comparison.notes import meaning, warnings
from mjnav.report.comparison.rivals import ABOUT, shown_between, win_ratio_between
from mjnav.report.comparison.shown import ShownTable, shown_table
from mjnav.report.comparison.sight import sight
from mjnav.report.figure_names import definition, figure_name
from mjnav.report.look.document import frame
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.study_comparison import StudyComparison

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


def _text(text: str) -> str:
    return escape(printable(text))


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
