"""Comparisons as one page: no script, nothing from the network, every figure with its value in full precision."""

from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from importlib.resources import files

from mjnav.printable import printable
from mjnav.report.comparison.html_cell import Axis, html_cell
from mjnav.report.comparison.notes import meaning, warnings
from mjnav.report.comparison.shown import shown_table
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.study_comparison import StudyComparison


def html(results: StudyComparison) -> str:
    """The page."""
    style = (files("mjnav.report.comparison") / "comparison.css").read_text(encoding="utf-8")
    digest = b64encode(sha256(style.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'sha256-{digest}'; img-src data:; base-uri 'none'; form-action 'none'"
    title = _text(f"{results.study}: comparison")
    count = (
        f"{results.num_episodes} episodes, {len(results.tables)} {'table' if len(results.tables) == 1 else 'tables'}"
    )
    parts = [
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        '<meta name="generator" content="mjnav compare">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<title>{title}</title>\n<link rel="icon" href="data:,">\n<style>{style}</style>\n</head>\n<body>',
        f'<h1>{_text(results.study)}</h1>\n<p class="about">{count}</p>',
        _sentences("warnings", warnings(results)),
        _contents(results.tables),
        *(_section(i, results, table) for i, table in enumerate(results.tables)),
        f"<h2>How to read it</h2>{_sentences('meaning', meaning(results))}",
        "<footer>Made by <code>mjnav compare</code>.</footer>\n</body>\n</html>\n",
    ]
    return "\n".join(part for part in parts if part)


def _text(text: str) -> str:
    return escape(printable(text))


def _sentences(kind: str, sentences: Sequence[str]) -> str:
    items = "".join(f"<li><p>{_text(sentence)}</p></li>" for sentence in sentences)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _contents(tables: Sequence[Comparison]) -> str:
    if len(tables) < 2:
        return ""
    links = (f'<li><a href="#table{i}">{_text(_place(table))}</a></li>' for i, table in enumerate(tables))
    return f'<nav aria-label="Tables"><ul>{"".join(links)}</ul></nav>'


def _place(table: Comparison) -> str:
    return f"{table.scene}, {table.setting}"


def _section(number: int, results: StudyComparison, table: Comparison) -> str:
    shown = shown_table(results, table)
    axes = [Axis([row.cells[i] for row in shown.rows]) for i in range(len(shown.titles))]
    head = "".join(f'<th scope="col">{_text(title)}</th>' for title in ("method", "n", *shown.titles))
    reference = f"<small>differences from {_text(table.reference)}</small>" if table.reference else ""
    body = "\n".join(
        f'<tr><th scope="row">{_text(row.method)}</th><td>{_text(row.episodes)}</td>'
        f"{''.join(map(html_cell, row.cells, axes))}</tr>"
        for row in shown.rows
    )
    return (
        f'<section id="table{number}">\n<h2>{_text(_place(table))} {reference}</h2>\n<div class="wide" tabindex="0" '
        f'role="region" aria-label="{_text(_place(table))}"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n'
        f"{body}\n</tbody></table></div>\n</section>"
    )
