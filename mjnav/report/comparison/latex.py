"""Comparisons as LaTeX tables for \\input: booktabs, every label escaped, no wider than the line."""

from collections.abc import Iterable, Iterator

from mjnav.report.comparison.notes import meaning, warnings
from mjnav.report.comparison.shown import ALPHA, PLAIN, Column, Shown, columns, decision, episodes, infeasible
from mjnav.report.printable import printable
from mjnav.study.compare.compare import RATES, Comparison, MethodRow
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
        **{c: f"\\{c}" for c in "{}$&#_%"},
    }
)

_SCALED_DOWN = r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}"  # what is wider than the line


def latex(results: StudyComparison) -> str:
    """A table for every scene and setting. It needs \\usepackage{booktabs,graphicx} and \\usepackage[T1]{fontenc}."""
    lines = [
        f"% {printable(f'mjnav compare: {results.study}', '?')}",
        r"% \usepackage{booktabs,graphicx} \usepackage[T1]{fontenc}",
        *(f"% {printable(sentence, '?')}" for sentence in (*meaning(results), *warnings(results))),
    ]
    for table in results.tables:
        lines += ["", *_table(results, table)]
    return "\n".join([*lines, ""])


def escaped(text: str) -> str:
    """Text that LaTeX prints as it is."""
    return printable(text, "?").translate(_ESCAPES)


def _table(results: StudyComparison, table: Comparison) -> Iterator[str]:
    rates, figures = columns(table, RATES), columns(table, results.figures)
    titles = ["method", "n", *(column.title for column in rates), *PLAIN, *(column.title for column in figures)]
    below = ""
    if table.reference:
        below = rf"; below, paired differences from {escaped(table.reference)}, $^*$ where $p < {ALPHA:g}$ (Holm)"
    yield r"\begin{table}"
    yield r"\centering"
    yield rf"\caption{{{escaped(f'{table.scene}, {table.setting}')}: rates and means with 95\,\% intervals{below}.}}"
    yield _SCALED_DOWN + rf"{{\begin{{tabular}}{{@{{}}l{'r' * (len(titles) - 1)}@{{}}}}"
    yield r"\toprule"
    yield _row(map(escaped, titles))
    yield r"\midrule"
    for row in table.rows:
        missing = results.missing[table.scene, table.setting, row.method]
        own = [[_cell(column.own(row)) for column in group] for group in (rates, figures)]
        plain = [infeasible(row), decision(row)]
        yield _row([escaped(row.method), escaped(episodes(row, missing)), *own[0], *plain, *own[1]])
        if row.differences:
            under = [[_difference(column, row) for column in group] for group in (rates, figures)]
            yield _row(["", "", *under[0], *("" for _ in plain), *under[1]])
    yield r"\bottomrule"
    yield r"\end{tabular}}"
    yield r"\end{table}"


def _row(cells: Iterable[str]) -> str:
    # Braces: what begins with [ or * would be read as an option of the row before.
    return " & ".join(f"{{{cell}}}" if cell else "" for cell in cells) + r" \\"


def _cell(shown: Shown) -> str:
    parts = (shown.value, shown.interval, shown.count)
    return " ".join(part for part in parts if part).replace("-", "$-$") + "$^*$" * shown.marked


def _difference(column: Column, row: MethodRow) -> str:
    shown = column.difference(row)
    return rf"\footnotesize {_cell(shown)}" if shown is not None else ""
