"""Comparisons for a terminal: columns that do not fit side by side go below one another, under the same methods.

Of a study, its tables and the worst seeds of each cell; of two folders of results, what changed, each cell's figures,
and the seeds that ended otherwise.
"""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mjnav.printable import printable
from mjnav.report.comparison.shown import Cell, ShownTable, about, meaning, meaning_of_changes, shown_tables, warnings
from mjnav.report.figure_text import ALPHA, is_marked
from mjnav.study.compare.before_after import AFTER, BEFORE, BETTER, KINDS, BeforeAfter, CellChange
from mjnav.study.compare.cell_rows import CellPlace
from mjnav.study.compare.study_comparison import StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed
from mjnav.study.keep import kept_log

# ----------------------------------------------------------------------------------------- one table


GAP = 2  # [characters] between columns
MAX_LABEL = 0.4  # of the width; longer labels are folded


def write_table(shown: ShownTable, console: Console) -> None:
    """In bands of as many columns as fit beside the methods."""
    methods = [Text(printable(method)) for method in shown.methods]
    label = min(_width("method", methods), max(int(MAX_LABEL * console.width), len("method")))
    bands: list[list[tuple[str, list[Text], int]]] = []
    free = 0
    for column in shown.columns:
        title, cells = printable(column.title), list(map(_text, column.cells))
        width = _width(title, cells)
        if not bands or free < GAP + width:
            bands.append([])
            free = console.width - label
        bands[-1].append((title, cells, width))
        free -= GAP + width
    for band in bands:
        table = Table(box=None, padding=(0, GAP, 0, 0), pad_edge=False, header_style="underline")
        table.add_column("method", overflow="fold", max_width=label)
        for title, _, width in band:
            table.add_column(title, no_wrap=True, overflow="ignore", min_width=width)
        for row in zip(methods, *(cells for _, cells, _ in band), strict=True):
            table.add_row(*row)
        console.print(table)


def _width(title: str, cells: Sequence[Text]) -> int:
    return max(cell_len(line) for text in (title, *map(str, cells)) for line in text.split("\n"))


def _text(cell: Cell) -> Text:
    """A method's own figure, and below it the difference."""
    text = Text().append(str(cell.own), "bold" if cell.own.marked else "")
    if cell.below is not None:
        text.append(f"\n{cell.below}", "bold" if cell.below.marked else "dim")
    return text


# --------------------------------------------------------------------------------------------- a study


MAX_CELLS = 10  # whose worst seeds are printed; a page has all


def write(results: StudyComparison, console: Console) -> None:
    """All tables, then what they mean and what is missing."""
    for table in results.tables:
        parts = [*about(table), *([f"reference {table.reference_label}"] if table.reference else [])]
        heading = Text(printable(table.title), "bold")
        console.print(heading.append("".join(f"; {printable(part)}" for part in parts), "not bold"))
        for shown in shown_tables(table, ratios=results.ratios):
            if shown.title:
                console.print(f"\n{shown.title}", style="bold")
            write_table(shown, console)
        console.print()
    for sentence in meaning(results):
        console.print(sentence, style="dim")
    for sentence in warnings(results):
        console.print(sentence, style="bold")


def write_worst(
    results: StudyComparison,
    worst: Mapping[CellPlace, Sequence[WorstSeed]],
    commands: Mapping[CellPlace, str],
    console: Console,
) -> None:
    """A line for each cell with failures, and below it the command that shows its worst seed."""
    num = 0
    for table, row in results.rows:
        place = (table.scene, table.setting, row.method)
        seeds = [seed for seed in worst.get(place, ()) if not seed.succeeded]
        num += bool(seeds)
        if not seeds or num > MAX_CELLS:
            continue
        if num == 1:
            console.print("\nworst seeds", style="bold")
        seen = "; ".join(f"seed {seed.seed} {seed.why}" for seed in seeds)
        console.print(printable(f"  {table.title}, {row.label}: {seen}"))
        command = _report(results.folder, [seed.log for seed in seeds])
        if command is None and place in commands:
            log_name = f"seed{seeds[0].seed}.mcap"
            command = f"{commands[place]} --seed {seeds[0].seed} --log {log_name}; mjnav report {log_name}"
        if command is not None:
            console.print(printable(f"    {command}"), style="dim", soft_wrap=True)  # to be copied: one line
    if num > MAX_CELLS:
        console.print(f"  and in {num - MAX_CELLS} more cells: -o FILE.html has all")


def _report(folder: str, logs: Sequence[str | None]) -> str | None:
    """The command that shows the first of the logs that was kept."""
    kept = (log for name in logs if (log := kept_log(Path(folder), name)) is not None)
    return next((shlex.join(["mjnav", "report", str(log)]) for log in kept), None)


# ---------------------------------------------------------------------------------------- two folders


MAX_KEYS = 20  # that are printed
MAX_SEEDS = 20  # of a cell and a kind
MAX_NAMED = 5  # cells in one folder only


def write_changes(results: BeforeAfter, console: Console) -> None:
    """What changed between two folders, the cells, a summary."""
    console.print(f"before  {printable(results.before)}\nafter   {printable(results.after)}\n", style="bold")
    made_with = "what the rows were made with" if results.changed else "The rows were made with the same."
    console.print(made_with, style="bold")
    for change in results.changed[:MAX_KEYS]:
        num = len(results.cells)
        where = "" if change.cells == num else f"  (in {change.cells} of {num} cells)"
        console.print(printable(f"  {change.what}: {change.before} -> {change.after}{where}"))
    if len(results.changed) > MAX_KEYS:
        console.print(f"  and {len(results.changed) - MAX_KEYS} more: --json has all")
    console.print()
    for cell in results.cells:
        identical = [f"{cell.pairs} pairs", *([f"{cell.identical} of them identical"] if cell.identical else [])]
        heading = Text(printable(", ".join(cell.labels)), "bold")
        console.print(heading.append(f": {'; '.join([', '.join(identical), *about(cell.table)[1:]])}", "not bold"))
        if cell.identical < cell.pairs:
            write_table(next(shown_tables(cell.table)), console)
        for kind in KINDS:
            for line in _seeds(results, cell, kind):
                console.print(line)
        console.print()
    for sentence in meaning_of_changes(results):
        console.print(sentence, style="dim")
    for sentence in summary(results):
        console.print(printable(sentence), style="bold")


def summary(results: BeforeAfter) -> Iterator[str]:
    """How much got better and worse, and what has no partner, in sentences."""
    better, worse, other = map(results.num_seeds, KINDS)
    pairs, identical = sum(cell.pairs for cell in results.cells), sum(cell.identical for cell in results.cells)
    yield (
        f"Of {pairs} pairs {better} are better, {worse} worse, {other} failed otherwise, "
        f"{identical} are identical to the last bit."
    )
    changes = [cell.after.differences["success"] for cell in results.cells]
    gains = [change.estimate.value > 0.0 for change in changes if is_marked(change.p)]
    yield (
        f"Success is higher in {gains.count(True)} and lower in {gains.count(False)} of {len(changes)} cells "
        f"with p < {ALPHA:g}."
    )
    for which, places in ((BEFORE, results.only_before), (AFTER, results.only_after)):
        if places:
            names = "; ".join(", ".join(results.labels.place(place)) for place in places[:MAX_NAMED])
            more = f"; {len(places) - MAX_NAMED} more" if len(places) > MAX_NAMED else ""
            yield f"Only {which}: {names}{more}."
    for cell in results.cells:
        if cell.pairs < max(cell.num_before, cell.num_after):
            seeds = f"{cell.num_before} seeds before, {cell.num_after} after, {cell.pairs} in both"
            yield f"{', '.join(cell.labels)}: {seeds}."


def _seeds(results: BeforeAfter, cell: CellChange, kind: str) -> Iterator[str]:
    """The seeds of a cell that changed in one way, by outcome before and after; then the command that shows one."""
    seeds = cell.seeds_of(kind)
    ways: dict[tuple[str, str], list[int]] = {}
    for seed in seeds:
        ways.setdefault((seed.before, seed.after), []).append(seed.seed)
    for (before, after), numbers in ways.items():
        word = "seed" if len(numbers) == 1 else "seeds"
        more = f" and {len(numbers) - MAX_SEEDS} more" if len(numbers) > MAX_SEEDS else ""
        yield f"  {kind:7} {word} {', '.join(map(str, numbers[:MAX_SEEDS]))}{more}: {before} -> {after}"
    if kind == BETTER:
        command = _report(results.before, [seed.before_log for seed in seeds])
    else:
        command = _report(results.after, [seed.after_log for seed in seeds])
    if command is not None:
        yield f"          {command}"
