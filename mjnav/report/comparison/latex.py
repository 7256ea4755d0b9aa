"""Comparisons as LaTeX tables for \\input: booktabs, every label escaped, no wider than the line."""

from collections.abc import Iterable, Iterator

from mjnav.printable import printable
from mjnav.report.comparison.shown import ShownTable, about, meaning, shown_tables, warnings
from mjnav.report.figure_text import ALPHA, NEVER, Shown
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
_TABLE = r"""
\begin{table}
\centering
\caption{%s}
\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{\begin{tabular}{@{}l%s@{}}
\toprule
%s
\midrule
%s
\bottomrule
\end{tabular}}
\end{table}"""


def latex(results: StudyComparison) -> str:
    """A table for every scene and setting. It needs \\usepackage{booktabs,graphicx} and \\usepackage[T1]{fontenc}."""
    lines = [
        f"% {printable(f'mjnav compare: {results.study}', '?')}",
        r"% \usepackage{booktabs,graphicx} \usepackage[T1]{fontenc}",
        *(f"% {printable(sentence, '?')}" for sentence in (*meaning(results), *warnings(results))),
    ]
    kind = "paired differences from (of costs: ratios to)" if results.ratios else "paired differences from"
    for table in results.tables:
        place = "; ".join([table.title, *about(table)])
        below = rf"; below, {kind} {table.reference_label}" if table.reference else ""
        for shown in shown_tables(table, ratios=results.ratios):
            what = f"{place}: {shown.title or 'rates and means'} with 95 % intervals{below * (not shown.title)}"
            caption = rf"{escaped(what)}; $^*$ where $p < {ALPHA:g}$ (Holm)."
            head = _row(escaped(text) for text in ("method", *(str(column.name) for column in shown.columns)))
            lines.append(_TABLE % (caption, "r" * len(shown.columns), head, "\n".join(_rows(shown))))
    return "\n".join([*lines, ""])


def escaped(text: str) -> str:
    """Text that LaTeX prints as it is."""
    return printable(text, "?").translate(_ESCAPES)


def _rows(shown: ShownTable) -> Iterator[str]:
    for method, cells in shown.rows:
        yield _row([escaped(method), *(_cell(cell.own) for cell in cells)])
        if any(cell.below is not None for cell in cells):
            below = [rf"\footnotesize {_cell(cell.below)}" if cell.below is not None else "" for cell in cells]
            yield _row(["", *below])


def _row(cells: Iterable[str]) -> str:
    # Braces: what begins with [ or * would be read as an option of the row before.
    return " & ".join(f"{{{cell}}}" if cell else "" for cell in cells) + r" \\"


def _cell(shown: Shown) -> str:
    text = " ".join(part for part in (shown.value, shown.interval, shown.count) if part).replace("-", "$-$")
    return text.replace("×", r"$\times$").replace(NEVER, r"$\infty$") + "$^*$" * shown.marked
