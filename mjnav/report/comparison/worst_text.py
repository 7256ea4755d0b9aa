"""The failures of every cell for a terminal: which seeds, and the command that shows one."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rich.console import Console

from mjnav.printable import printable
from mjnav.study.compare.study_comparison import CellPlace, StudyComparison
from mjnav.study.compare.worst_seeds import WorstSeed
from mjnav.study.keep import kept_log

MAX_CELLS = 10  # that are printed; a page has all


def write(
    results: StudyComparison,
    worst: Mapping[CellPlace, Sequence[WorstSeed]],
    commands: Mapping[CellPlace, str],
    console: Console,
) -> None:
    """A line for each cell with failures, and below it the command that shows its worst seed."""
    failures = [
        (place, failed)
        for table in results.tables
        for row in table.rows
        for place in [(table.scene, table.setting, row.method)]
        if (failed := [seed for seed in worst.get(place, ()) if not seed.succeeded])
    ]
    if not failures:
        return
    console.print("\nworst seeds", style="bold")
    for place, seeds in failures[:MAX_CELLS]:
        said = "; ".join(f"seed {seed.seed} {seed.why}" for seed in seeds)
        console.print(printable(f"  {', '.join(results.labels.place(place))}: {said}"))
        for command in _ways(Path(results.folder), seeds, commands.get(place)):
            console.print(printable(f"    {command}"), style="dim", soft_wrap=True)  # to be copied: one line
    if len(failures) > MAX_CELLS:
        console.print(f"  and in {len(failures) - MAX_CELLS} more cells: -o FILE.html has all")


def _ways(folder: Path, seeds: Sequence[WorstSeed], command: str | None) -> Iterator[str]:
    """How to see one: the report of the first log that was kept, or else the run that writes it."""
    for seed in seeds:
        log = kept_log(folder, seed.log)
        if log is not None:
            yield shlex.join(["mjnav", "report", str(log)])
            return
    if command is not None:
        log_name = f"seed{seeds[0].seed}.mcap"
        yield f"{command} --seed {seeds[0].seed} --log {log_name}; mjnav report {log_name}"
