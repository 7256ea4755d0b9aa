"""Comparisons as LaTeX tables for \\input: booktabs, every label escaped, no wider than the line."""

from collections.abc import Iterable, Iterator, Sequence

from mjnav.printable import printable
from mjnav.report.comparison.notes import layouts, meaning, sight, warnings
from mjnav.report.comparison.shown import ALPHA, NEVER, Shown, shown_table
from mjnav.report.comparison.text import ABOUT, shown_between
from mjnav.report.figure_names import figure_name
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.study_comparison import StudyComparison

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "|": r"\textbar{}",
        '"': r"\textquotedbl{}",
        "×": r"$\times$",
        "²": r"$^2$",
        "³": r"$^3$",
        **{c: f"\\{c}" for c in "{}$&#_%"},
    }
)

_SCALED_DOWN = r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}"  # what is wider than the line

_MARK = rf"$^*$ where $p < {ALPHA:g}$ (Holm)"


def latex(results: StudyComparison) -> str:
    """A table for every scene and setting. It needs \\usepackage{booktabs,graphicx} and \\usepackage[T1]{fontenc}."""
    results = results.labelled
    lines = [
        f"% {printable(f'mjnav compare: {results.study}', '?')}",
        r"% \usepackage{booktabs,graphicx} \usepackage[T1]{fontenc}",
        *(f"% {printable(sentence, '?')}" for sentence in (*meaning(results), *warnings(results))),
    ]
    for table in results.tables:
        lines += ["", *_table(results, table)]
        if table.rivals:
            lines += ["", *_rivals(table)]
    return "\n".join([*lines, ""])


def escaped(text: str) -> str:
    """Text that LaTeX prints as it is."""
    return printable(text, "?").translate(_ESCAPES)


def _table(results: StudyComparison, table: Comparison) -> Iterator[str]:
    shown = shown_table(results, table)
    below = ""
    if table.reference:
        kind = "paired differences from (of costs: ratios to)" if results.ratios else "paired differences from"
        below = rf"; below, {kind} {escaped(table.reference)}, {_MARK}"
    rows = []
    for row in shown.rows:
        rows.append(_row([escaped(row.method), escaped(row.episodes), *(_cell(cell.own) for cell in row.cells)]))
        if any(cell.below is not None for cell in row.cells):
            under = [rf"\footnotesize {_cell(cell.below)}" if cell.below is not None else "" for cell in row.cells]
            rows.append(_row(["", "", *under]))
    caption = rf"{_place(table)}: rates and means with 95\,\% intervals{below}."
    yield from _tabular(caption, ("method", "n", *map(str, map(figure_name, shown.figures))), rows)


def _rivals(table: Comparison) -> Iterator[str]:
    """The win ratio of every two methods."""
    methods = [row.method for row in table.rows]
    rows = [_row([escaped(one), *(_cell(shown_between(table, one, other)) for other in methods)]) for one in methods]
    caption = rf"{_place(table)}: {ABOUT}, with 95\,\% intervals, {_MARK}."
    yield from _tabular(caption, ("method", *methods), rows)


def _place(table: Comparison) -> str:
    known = filter(None, (f"{table.scene}, {table.setting}", layouts(table.num_layouts), sight(table.people)))
    return escaped("; ".join(known))


def _tabular(caption: str, heads: Sequence[str], rows: Iterable[str]) -> Iterator[str]:
    yield r"\begin{table}"
    yield r"\centering"
    yield rf"\caption{{{caption}}}"
    yield _SCALED_DOWN + rf"{{\begin{{tabular}}{{@{{}}l{'r' * (len(heads) - 1)}@{{}}}}"
    yield r"\toprule"
    yield _row(map(escaped, heads))
    yield r"\midrule"
    yield from rows
    yield r"\bottomrule"
    yield r"\end{tabular}}"
    yield r"\end{table}"


def _row(cells: Iterable[str]) -> str:
    # Braces: what begins with [ or * would be read as an option of the row before.
    return " & ".join(f"{{{cell}}}" if cell else "" for cell in cells) + r" \\"


def _cell(shown: Shown) -> str:
    parts = (shown.value, shown.interval, shown.count)
    text = " ".join(part for part in parts if part).replace("-", "$-$")
    return text.replace("×", r"$\times$").replace(NEVER, r"$\infty$") + "$^*$" * shown.marked
