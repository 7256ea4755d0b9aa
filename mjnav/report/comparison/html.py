"""Comparisons as one page: no script, nothing from the network, every figure with its value in full precision."""

from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from importlib.resources import files

from mjnav.report.comparison.html_cell import Axis, cell, plain
from mjnav.report.comparison.notes import meaning, warnings
from mjnav.report.comparison.shown import PLAIN, columns, decision, episodes, infeasible
from mjnav.report.printable import printable
from mjnav.study.compare.compare import RATES, Comparison
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
    rates, figures = columns(table, RATES), columns(table, results.figures)
    axes = {figure: Axis(figure, table) for figure in (*RATES, *results.figures)}
    titles = ["method", "n", *(column.title for column in rates), *PLAIN, *(column.title for column in figures)]
    head = "".join(f'<th scope="col">{_text(title)}</th>' for title in titles)
    reference = f"<small>differences from {_text(table.reference)}</small>" if table.reference else ""
    body = []
    for row in table.rows:
        missing = results.missing[table.scene, table.setting, row.method]
        cells = "".join(cell(column, row, axes[column.figure]) for column in rates)
        cells += plain("infeasible_share", row.infeasible_share, infeasible(row))
        cells += plain("decision_ms", row.decision_ms, decision(row))
        cells += "".join(cell(column, row, axes[column.figure]) for column in figures)
        label = f'<th scope="row">{_text(row.method)}</th><td>{_text(episodes(row, missing))}</td>'
        body.append(f"<tr>{label}{cells}</tr>")
    return (
        f'<section id="table{number}">\n<h2>{_text(_place(table))} {reference}</h2>\n<div class="wide" tabindex="0" '
        f'role="region" aria-label="{_text(_place(table))}"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(body)
        + "\n</tbody></table></div>\n</section>"
    )
