"""Comparisons for programs: one row a figure, or one JSON document; full precision, undefined is empty or null."""

import csv
import io
from collections.abc import Iterator
from math import isfinite, nan
from typing import Any

from mjnav.recording.export.csv_tables import neutral
from mjnav.report.comparison.notes import of_table
from mjnav.report.figure_names import unit
from mjnav.study.cells import Labels
from mjnav.study.compare.compare import Comparison, MethodRow
from mjnav.study.compare.estimates import Estimate, WinRatio
from mjnav.study.compare.study_comparison import StudyComparison

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
    file = io.StringIO(newline="")
    writer = csv.DictWriter(file, HEADER, restval="", lineterminator="\n")
    writer.writeheader()
    for table in results.tables:
        for row in table.rows:
            writer.writerows({key: neutral(cell) for key, cell in line.items()} for line in _lines(results, table, row))
    return file.getvalue()


def _lines(results: StudyComparison, table: Comparison, row: MethodRow) -> Iterator[dict[str, Any]]:
    place: dict[str, Any] = {"scene": table.scene, "setting": table.setting, "method": row.method}
    place |= {"episodes": row.num, "failed": row.num_failed, "missing": _missing(results, table, row)}
    place |= {"people_see_robot": of_table(table.people), "layouts": row.num_layouts}
    place |= labels_document(results.labels, table.setting, row.method)
    for figure, e in row.figures.items():
        low, high = e.interval or (None, None)
        line = {**place, "figure": figure, "value": known(e.value), "low": low, "high": high, "n": e.num}
        line |= {"unit": unit(figure)}
        if figure in row.differences:
            found = row.differences[figure]
            low, high = found.estimate.interval or (None, None)
            line |= {"reference": table.reference, "difference": known(found.estimate.value)}
            line |= {"diff_low": low, "diff_high": high, "pairs": found.estimate.num, "p_holm": found.p}
            if found.ratio is not None:
                ratio = _estimate(found.ratio)
                line |= {"ratio": ratio["value"], "ratio_low": ratio["low"], "ratio_high": ratio["high"]}
        yield line
    for figure in ("infeasible_share", "decision_ms", "decision_p99_ms"):
        yield {**place, "figure": figure, "value": known(getattr(row, figure)), "unit": unit(figure)}
    if row.wins is not None:
        yield {**place, "figure": "win_ratio", "reference": table.reference, **_wins_cells(row.wins)}
    for rivals in table.rivals:
        if row.method in (rivals.method, rivals.other):
            first = row.method == rivals.method
            line = {**place, "figure": RIVAL_WIN_RATIO, "reference": rivals.other if first else rivals.method}
            yield line | _wins_cells(rivals.ratio if first else rivals.ratio.inverse)


def labels_document(labels: Labels, setting: str, method: str) -> dict[str, str]:
    """What people read in the place of two names."""
    _, setting, method = labels.place(("", setting, method))
    return {"setting_label": setting, "method_label": method}


def _wins_cells(wins: WinRatio) -> dict[str, Any]:
    found = wins_document(wins)
    keys = ("value", "low", "high", "pairs", "p_holm", "wins", "losses", "ties", "win_share")
    return {key: found[key] for key in keys}


def document(results: StudyComparison) -> dict[str, Any]:
    """The same as what `mjnav compare --json` prints."""
    return {
        "schema": 1,
        "study": results.study,
        "folder": results.folder,
        "episodes": results.num_episodes,
        "missing": results.num_missing if results.num_seeds is not None else None,
        "failed": sum(results.causes.values()),
        "causes": dict(results.causes.most_common()),
        "revisions": list(results.revisions),
        "made_with": [
            {"what": inconsistency.what, "rows": dict(inconsistency.rows)} for inconsistency in results.inconsistencies
        ],
        "tables": [
            {
                "scene": table.scene,
                "setting": table.setting,
                "setting_label": results.labels.settings.get(table.setting, table.setting),
                "reference": table.reference or None,
                "people_see_robot": of_table(table.people),
                "layouts": table.num_layouts,
                "win_by": table.win_by,
                "methods": [_method(results, table, row) for row in table.rows],
                "rivals": [
                    {"method": one.method, "other": one.other, "win_ratio": wins_document(one.ratio)}
                    for one in table.rivals
                ],
            }
            for table in results.tables
        ],
    }


def _method(results: StudyComparison, table: Comparison, row: MethodRow) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    for figure, e in row.figures.items():
        figures[figure] = {**_estimate(e), "n": e.num, "difference": None, "ratio": None}
        if figure in row.differences:
            found = row.differences[figure]
            figures[figure]["difference"] = {
                **_estimate(found.estimate),
                "pairs": found.estimate.num,
                "p_holm": found.p,
            }
            if found.ratio is not None:
                figures[figure]["ratio"] = {**_estimate(found.ratio), "pairs": found.ratio.num}
    return {
        "method": row.method,
        "method_label": results.labels.methods.get(row.method, row.method),
        "episodes": row.num,
        "failed": row.num_failed,
        "layouts": row.num_layouts,
        "units": row.num_units,
        "missing": _missing(results, table, row),
        "figures": figures,
        "infeasible_share": known(row.infeasible_share),
        "decision_ms": known(row.decision_ms),
        "decision_p99_ms": known(row.decision_p99_ms),
        "win_ratio": None if row.wins is None else wins_document(row.wins),
    }


def wins_document(wins: WinRatio) -> dict[str, Any]:
    """A win ratio with its counts; what is infinite is None."""
    low, high = wins.interval or (nan, nan)
    return {
        "value": known(wins.value),
        "low": known(low),
        "high": known(high),
        "win_share": known(wins.share),
        "wins": wins.wins,
        "losses": wins.losses,
        "ties": wins.ties,
        "pairs": wins.pairs,
        "p_holm": wins.p,
    }


def _estimate(e: Estimate) -> dict[str, Any]:
    return {"value": known(e.value), **low_high(e)}


def low_high(e: Estimate) -> dict[str, float | None]:
    """The ends of an estimate's interval."""
    low, high = e.interval or (None, None)
    return {"low": low, "high": high}


def _missing(results: StudyComparison, table: Comparison, row: MethodRow) -> int | None:
    """How many seeds of the study the method lacks; None where no study says."""
    return results.missing[table.scene, table.setting, row.method] if results.num_seeds is not None else None


def known(value: float) -> float | None:
    """A figure, None where it is undefined."""
    return value if isfinite(value) else None
