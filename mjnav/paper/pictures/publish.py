"""What an item leaves in its folder: the figure as PNG and PDF, the figures behind it as CSV, the findings as JSON.

The page is made of these files alone, so that it can be made again without running anything.
"""

import csv
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from mjnav.paper.finding import Finding, Verdict
from mjnav.paper.pictures.style import DPI, style
from mjnav.recording.export.csv_cells import neutral
from mjnav.study.compare.compare import CellRows, estimate
from mjnav.study.store.row import COLUMNS

FINDINGS, DATA, PICTURE, PRINT = "findings.json", "data.csv", "figure.png", "figure.pdf"
CORRECTION = "Holm"  # of the verdicts, for the number of an item's tests; items of before have none


def publish(
    folder: Path,
    figure: Figure,
    rows: Iterable[Mapping[str, Any]],
    findings: Sequence[Finding],
    about: Mapping[str, Any],
) -> None:
    """Writes an item's folder, its findings last: where they are, all is there. `about` is kept beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figure.savefig(folder / PICTURE, dpi=DPI, metadata={"Software": None})
        figure.savefig(folder / PRINT, metadata={"CreationDate": None})
    rows = list(rows)
    with open(folder / DATA, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows({key: neutral(cell) for key, cell in row.items()} for row in rows)
    document = {**about, "correction": CORRECTION, "findings": [asdict(finding) for finding in findings]}
    temporary = folder / f"{FINDINGS}.tmp"
    temporary.write_text(json.dumps(document, indent=1), encoding="utf-8")
    os.replace(temporary, folder / FINDINGS)


def read(folder: Path) -> tuple[tuple[Finding, ...], dict[str, Any]] | None:
    """The findings of an item's folder and what was kept beside them; None where it has none."""
    try:
        document = json.loads((folder / FINDINGS).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    findings = tuple(Finding(**{**part, "verdict": Verdict(part["verdict"])}) for part in document.pop("findings"))
    return findings, document


def cell_table(cells: Sequence[CellRows]) -> list[dict[str, Any]]:
    """Every numeric figure of every cell with its interval and number of seeds, one a row."""
    names = ["collision", *(name for name, column in COLUMNS.items() if column.type != "string" and name != "seed")]
    table = []
    for cell in cells:
        for name in names:
            e = estimate(cell, name)
            if e.num:
                low, high = e.interval or (None, None)
                place = {"scene": cell.scene, "setting": cell.setting, "method": cell.method}
                table.append({**place, "figure": name, "mean": e.value, "low": low, "high": high, "seeds": e.num})
    return table
