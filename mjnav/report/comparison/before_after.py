"""Reports on two compared folders of results: as text for a terminal, as CSV and as JSON.

The text has what changed, each cell's figures, and the seeds that ended otherwise.

For programs there are a CSV row for each figure of a cell, or one JSON document; undefined is null.
"""

import csv
import io
import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from mjnav.printable import printable
from mjnav.recording.export.csv_tables import neutral
from mjnav.report.comparison.notes import of_table, sight
from mjnav.report.comparison.shown import ALPHA
from mjnav.report.comparison.text import write_table
from mjnav.report.comparison.tidy import known, labels_document, low_high, wins_document
from mjnav.study.compare.before_after import (
    AFTER,
    BEFORE,
    BETTER,
    OTHER,
    WORSE,
    BeforeAfter,
    CellChange,
    KeyChange,
    SeedChange,
)
from mjnav.study.compare.chosen_figures import WIN_BY
from mjnav.study.compare.compare import Comparison
from mjnav.study.compare.estimates import RESAMPLES
from mjnav.study.compare.study_comparison import StudyComparison
from mjnav.study.keep import kept_log

# ------------------------------------------------------------------------------------------- terminal


MAX_KEYS = 20  # that are printed
MAX_SEEDS = 20  # of a cell and a kind
MAX_NAMED = 5  # cells in one folder only
MEANING = (
    "All is over the seeds that both folders have: success % is the goal reached without contact, in time; "
    "collision % any contact; with Wilson 95 % intervals.",
    f"Other figures are means over the seeds that succeeded, with 95 % bootstrap intervals ({RESAMPLES} resamples); in "
    "parentheses from how many seeds, where not from all n.",
    "Signed figures are after - before, over the seeds that succeeded in both (rates, clearances, distances: "
    "over all), with paired bootstrap intervals.",
    "win_ratio is the number of pairs that are better after over those that are worse: a contact is worst, then a "
    f"goal not reached in time; two successes are compared by {WIN_BY}.",
    "* p < 0.05 by a sign-flip test on the pairs (rates: McNemar's exact test; win ratios: binomial), with Holm's "
    "correction over the cells, each figure by itself.",
)


def write(found: BeforeAfter, console: Console) -> None:
    """What changed, the cells, a summary."""
    found = found.labelled
    console.print(f"before  {printable(found.before)}\nafter   {printable(found.after)}", style="bold")
    console.print()
    console.print(
        "what the rows were made with" if found.changed else "The rows were made with the same.", style="bold"
    )
    for change in found.changed[:MAX_KEYS]:
        console.print(f"  {_change(change, len(found.cells))}")
    if len(found.changed) > MAX_KEYS:
        console.print(f"  and {len(found.changed) - MAX_KEYS} more: --json has all")
    console.print()
    for cell in found.cells:
        _write_cell(found, cell, console)
    for sentence in MEANING:
        console.print(sentence, style="dim")
    for sentence in (*summary(found), *_alone(found)):
        console.print(sentence, style="bold")


def summary(found: BeforeAfter) -> Iterator[str]:
    """How much got better and worse, in sentences."""
    marked: Counter[str] = Counter()
    for cell in found.cells:
        difference = cell.after.differences["success"]
        if difference.p is not None and difference.p < ALPHA:
            marked[BETTER if difference.estimate.value > 0.0 else WORSE] += 1
    seeds = Counter(seed.kind for cell in found.cells for seed in cell.seeds)
    pairs = sum(cell.pairs for cell in found.cells)
    yield (
        f"Of {pairs} pairs {seeds[BETTER]} are better, {seeds[WORSE]} worse, {seeds[OTHER]} failed otherwise, "
        f"{sum(cell.identical for cell in found.cells)} are identical to the last bit."
    )
    yield (
        f"Success is higher in {marked[BETTER]} and lower in {marked[WORSE]} of {len(found.cells)} cells "
        f"with p < {ALPHA:g}."
    )


def _write_cell(found: BeforeAfter, cell: CellChange, console: Console) -> None:
    identical = f", {cell.identical} of them identical" if cell.identical else ""
    identical += f"; {sight(cell.people)}" if cell.people else ""
    heading = Text(f"{printable(', '.join((cell.scene, cell.setting, cell.method)))}", "bold")
    console.print(heading.append(f": {cell.pairs} pairs{identical}", "not bold"))
    if cell.identical < cell.pairs:
        write_table(*as_table(found, cell), console)
    for kind in (BETTER, WORSE, OTHER):
        for line in _seeds(found, cell.named(kind), kind):
            console.print(line)
    console.print()


def _seeds(found: BeforeAfter, seeds: Sequence[SeedChange], kind: str) -> Iterator[str]:
    """The seeds of a cell that changed in one way, by outcome before and after; then a command that shows the first."""
    if not seeds:
        return
    ways: dict[tuple[str, str], list[int]] = {}
    for seed in seeds:
        ways.setdefault((seed.before, seed.after), []).append(seed.seed)
    for (before, after), numbers in ways.items():
        word = "seed" if len(numbers) == 1 else "seeds"
        more = f" and {len(numbers) - MAX_SEEDS} more" if len(numbers) > MAX_SEEDS else ""
        yield f"  {kind:7} {word} {', '.join(map(str, numbers[:MAX_SEEDS]))}{more}: {before} -> {after}"
    for seed in seeds:
        side = (found.before, seed.before_log) if kind == BETTER else (found.after, seed.after_log)
        log = kept_log(Path(side[0]), side[1])
        if log is not None:
            yield f"          {shlex.join(['mjnav', 'report', str(log)])}"
            return


def as_table(found: BeforeAfter, cell: CellChange) -> tuple[StudyComparison, Comparison]:
    """A cell as a table with a row before and a row after, which is compared with the first."""
    table = Comparison(cell.scene, f"{cell.setting}, {cell.method}", BEFORE, (cell.before, cell.after))
    missing = {(table.scene, table.setting, row.method): 0 for row in table.rows}
    return StudyComparison(
        folder=found.after,
        study="",
        figures=found.figures,
        tables=(table,),
        num_seeds=None,
        missing=missing,
        absent=(),
        causes=Counter(),
        revisions=(),
        others=(),
        inconsistencies=(),
    ), table


def _change(change: KeyChange, cells: int) -> str:
    where = "" if change.cells == cells else f"  (in {change.cells} of {cells} cells)"
    return printable(f"{change.what}: {change.before} -> {change.after}{where}")


def _alone(found: BeforeAfter) -> Iterator[str]:
    """The cells that have no partner."""
    for which, places in ((BEFORE, found.only_before), (AFTER, found.only_after)):
        if places:
            named = "; ".join(", ".join(place) for place in places[:MAX_NAMED])
            more = f"; {len(places) - MAX_NAMED} more" if len(places) > MAX_NAMED else ""
            yield printable(f"Only {which}: {named}{more}.")
    for cell in found.cells:
        if cell.pairs < max(cell.num_before, cell.num_after):
            yield printable(
                f"{cell.scene}, {cell.setting}, {cell.method}: {cell.num_before} seeds before, {cell.num_after} after, "
                f"{cell.pairs} in both."
            )


# --------------------------------------------------------------------------------------- CSV and JSON


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
