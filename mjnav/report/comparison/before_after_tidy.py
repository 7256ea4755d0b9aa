"""Two folders of results for programs: a CSV row a figure of a cell, or one JSON document; undefined is null."""

import csv
import io
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from mjnav.recording.export.csv_cells import neutral
from mjnav.report.comparison.sight import of_table
from mjnav.report.comparison.tidy import known, labels_document, low_high, wins_document
from mjnav.study.compare.before_after import BETTER, OTHER, WORSE, BeforeAfter, CellChange

HEADER = (
    *("scene", "setting", "method", "pairs", "identical", BETTER, WORSE, OTHER, "figure"),
    *("before", "before_low", "before_high", "before_n", "after", "after_low", "after_high", "after_n"),
    *("difference", "diff_low", "diff_high", "diff_pairs", "p_holm", "people_see_robot"),
    *("setting_label", "method_label"),
)


def csv_text(found: BeforeAfter) -> str:
    """A line for every figure of every cell."""
    file = io.StringIO(newline="")
    writer = csv.DictWriter(file, HEADER, lineterminator="\n")
    writer.writeheader()
    for cell in found.cells:
        writer.writerows({key: neutral(value) for key, value in line.items()} for line in _lines(found, cell))
    return file.getvalue()


def _lines(found: BeforeAfter, cell: CellChange) -> Iterator[dict[str, Any]]:
    counts = {kind: len(cell.named(kind)) for kind in (BETTER, WORSE, OTHER)}
    place = {"scene": cell.scene, "setting": cell.setting, "method": cell.method}
    place |= labels_document(found.labels, cell.setting, cell.method)
    seen = of_table(cell.people)
    for figure, values in _figures(cell).items():
        line: dict[str, Any] = {**place, "pairs": cell.pairs, "identical": cell.identical, **counts, "figure": figure}
        for side in ("before", "after"):
            own = values[side]
            line |= {side: own["value"], **{f"{side}_{key}": own[key] for key in ("low", "high", "n")}}
        own = values["difference"]
        line |= {"difference": own["value"], "diff_low": own["low"], "diff_high": own["high"]}
        yield line | {"diff_pairs": own["pairs"], "p_holm": own["p_holm"], "people_see_robot": seen}


def document(found: BeforeAfter) -> dict[str, Any]:
    """What `mjnav compare BEFORE AFTER --json` prints."""
    keys = ("scene", "setting", "method")
    return {
        "schema": 1,
        "before": found.before,
        "after": found.after,
        "changed": [asdict(change) for change in found.changed],
        "cells": [
            {
                **{key: getattr(cell, key) for key in keys},
                **labels_document(found.labels, cell.setting, cell.method),
                "episodes_before": cell.num_before,
                "episodes_after": cell.num_after,
                "pairs": cell.pairs,
                "identical": cell.identical,
                "people_see_robot": of_table(cell.people),
                "win_ratio": None if cell.after.wins is None else wins_document(cell.after.wins),
                "seeds": [asdict(seed) for seed in cell.seeds],
                "figures": _figures(cell),
            }
            for cell in found.cells
        ],
        "only_before": [dict(zip(keys, place, strict=True)) for place in found.only_before],
        "only_after": [dict(zip(keys, place, strict=True)) for place in found.only_after],
    }


def _figures(cell: CellChange) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for figure, change in cell.after.differences.items():
        sides = {"before": cell.before.figures[figure], "after": cell.after.figures[figure]}
        found[figure] = {side: {"value": known(e.value), **low_high(e), "n": e.num} for side, e in sides.items()}
        e = change.estimate
        found[figure]["difference"] = {"value": known(e.value), **low_high(e), "pairs": e.num, "p_holm": change.p}
    return found
