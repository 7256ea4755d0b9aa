"""Comparisons for programs: one JSON document, one CSV row a figure, or LaTeX tables for \\input.

JSON and CSV have full precision; what is undefined is null or empty. LaTeX tables are no wider than the line, with
booktabs and every label escaped.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

from mjnav.log.export.export import neutral
from mjnav.printable import printable
from mjnav.report.comparison.shown import ShownTable, about, meaning, shown_tables, warnings
from mjnav.report.figure_text import ALPHA, NEVER, Shown, unit
from mjnav.study.compare.before_after import AFTER, BEFORE, BeforeAfter, CellChange
from mjnav.study.compare.cell_rows import WIN_BY, CellPlace
from mjnav.study.compare.estimates import Difference, Estimate, WinRatio
from mjnav.study.compare.study_comparison import Comparison, MethodRow, StudyComparison

Document = dict[str, Any]

# ----------------------------------------------------------------------------------------- one figure


def _defined(value: float) -> float | None:
    """A figure, None where it is undefined."""
    return value if isfinite(value) else None


def _estimate(e: Estimate | None, num: str) -> Document | None:
    if e is None:
        return None
    low, high = e.interval or (None, None)
    return {"value": _defined(e.value), "low": low, "high": high, num: e.num}


def _difference(change: Difference | None) -> Document | None:
    return change and {**(_estimate(change.estimate, "pairs") or {}), "p_holm": change.p}


def _wins(wins: WinRatio | None) -> Document | None:
    """A win ratio with its counts; what is infinite is None."""
    if wins is None:
        return None
    low, high = map(_defined, wins.interval) if wins.interval is not None else (None, None)
    counts = {"wins": wins.wins, "losses": wins.losses, "ties": wins.ties, "pairs": wins.pairs}
    share = {"win_share": _defined(wins.share)}
    return {"value": _defined(wins.value), "low": low, "high": high, **share, **counts, "p_holm": wins.p}


def _people(table: Comparison) -> str | None:
    """How many people see the robot: "all", "none", "3 of 5", or several with commas; None where there are none."""
    return ", ".join(table.people) or None


def _csv(header: Sequence[str], lines: Iterable[Mapping[str, object]]) -> str:
    file = io.StringIO(newline="")
    writer = csv.DictWriter(file, header, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: neutral(value) for key, value in line.items()} for line in lines)
    return file.getvalue()


def _columns(values: Document | None, name: str, prefix: str) -> Document:
    """An estimate as columns of a CSV file: its value, with a prefix the ends of its interval, and the counts."""
    if values is None:
        return {}
    prefixes = {"low": prefix, "high": prefix, "n": "", "pairs": "", "p_holm": ""}
    others = {f"{prefixes[key]}{key}": value for key, value in values.items() if key in prefixes}
    return {name: values["value"], **others}


# -------------------------------------------------------------------------------------------- a study


def document(results: StudyComparison) -> Document:
    """What `mjnav compare --json` prints."""
    return {
        "schema": 1,
        "study": results.study,
        "folder": results.folder,
        "episodes": results.num_episodes,
        "missing": results.num_missing if results.num_seeds is not None else None,
        "failed": results.causes.total(),
        "causes": dict(results.causes.most_common()),
        "revisions": list(results.revisions),
        "made_with": [asdict(inconsistency) for inconsistency in results.inconsistencies],
        "tables": [
            {
                "scene": table.scene,
                "setting": table.setting,
                "setting_label": table.setting_label,
                "reference": table.reference or None,
                "people_see_robot": _people(table),
                "layouts": table.num_layouts,
                "win_by": WIN_BY,
                "methods": [_method(results, row) for row in table.rows],
                "rivals": [
                    {"method": pair.method, "other": pair.other, "win_ratio": _wins(pair.ratio)}
                    for pair in table.rivals
                ],
            }
            for table in results.tables
        ],
    }


def _method(results: StudyComparison, row: MethodRow) -> Document:
    changes = {figure: row.differences.get(figure) for figure in row.figures}
    return {
        "method": row.method,
        "method_label": row.label,
        "episodes": row.num,
        "failed": row.num_failed,
        "layouts": row.num_layouts,
        "units": row.num_units,
        "missing": row.num_missing if results.num_seeds is not None else None,
        "figures": {
            figure: {
                **(_estimate(e, "n") or {}),
                "difference": _difference(changes[figure]),
                "ratio": _estimate(change.ratio if (change := changes[figure]) is not None else None, "pairs"),
            }
            for figure, e in row.figures.items()
        },
        **{figure: _defined(value) for figure, value in row.plain.items()},
        "win_ratio": _wins(row.wins),
    }


HEADER = (
    *("scene", "setting", "method", "episodes", "failed", "missing"),
    *("figure", "value", "low", "high", "n"),
    *("reference", "difference", "diff_low", "diff_high", "pairs", "p_holm", "people_see_robot", "layouts", "unit"),
    *("ratio", "ratio_low", "ratio_high", "wins", "losses", "ties", "win_share"),
    *("setting_label", "method_label"),
)
RIVAL_WIN_RATIO = "rival_win_ratio"  # the figure of lines of two methods, whose Holm correction is over all such pairs


def csv_text(results: StudyComparison) -> str:
    """A line for every figure of every method in every scene and setting."""
    return _csv(HEADER, (line for table, row in results.rows for line in _lines(results, table, row)))


def _lines(results: StudyComparison, table: Comparison, row: MethodRow) -> Iterator[Document]:
    of_row = _method(results, row)
    place = {key: of_row[key] for key in ("method", "episodes", "failed", "missing", "layouts", "method_label")}
    place |= {"scene": table.scene, "setting": table.setting, "setting_label": table.setting_label}
    place |= {"people_see_robot": _people(table)}
    for figure, values in of_row["figures"].items():
        line = {**place, "figure": figure, "unit": unit(figure), **_columns(values, "value", "")}
        if values["difference"] is not None:
            line |= {"reference": table.reference, **_columns(values["difference"], "difference", "diff_")}
        yield line | _columns(values["ratio"], "ratio", "ratio_")
    for figure in row.plain:
        yield {**place, "figure": figure, "value": of_row[figure], "unit": unit(figure)}
    if row.wins is not None:
        yield {**place, "figure": "win_ratio", "reference": table.reference, **(_wins(row.wins) or {})}
    for other, wins in table.rivals_of(row.method):
        yield {**place, "figure": RIVAL_WIN_RATIO, "reference": other, **(_wins(wins) or {})}


# ---------------------------------------------------------------------------------------- two folders


def changes_document(results: BeforeAfter) -> Document:
    """What `mjnav compare BEFORE AFTER --json` prints."""
    return {
        "schema": 1,
        "before": results.before,
        "after": results.after,
        "changed": [asdict(change) for change in results.changed],
        "cells": [
            {
                **_place(cell.place),
                "setting_label": cell.labels[1],
                "method_label": cell.labels[2],
                "pairs": cell.pairs,
                "identical": cell.identical,
                "people_see_robot": _people(cell.table),
                "episodes_before": cell.num_before,
                "episodes_after": cell.num_after,
                "win_ratio": _wins(cell.after.wins),
                "seeds": [asdict(seed) for seed in cell.seeds],
                "figures": _changes(cell),
            }
            for cell in results.cells
        ],
        "only_before": [_place(place) for place in results.only_before],
        "only_after": [_place(place) for place in results.only_after],
    }


def _place(place: CellPlace) -> Document:
    return dict(zip(("scene", "setting", "method"), place, strict=True))


def _changes(cell: CellChange) -> dict[str, Document]:
    return {
        figure: {
            BEFORE: _estimate(cell.before.figures[figure], "n"),
            AFTER: _estimate(cell.after.figures[figure], "n"),
            "difference": _difference(change),
        }
        for figure, change in cell.after.differences.items()
    }


# ---------------------------------------------------------------------------------------------- LaTeX


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
