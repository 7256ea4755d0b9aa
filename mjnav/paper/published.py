"""What an item leaves in its folder: its figure, its data and its findings, from which the page is made."""

import csv
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from mjnav.errors import InputError
from mjnav.loop.provenance import revision
from mjnav.paper.episodes import ItemRows
from mjnav.paper.item import Finding, Verdict
from mjnav.paper.style import DPI, style
from mjnav.recording.export.csv_tables import neutral

FINDINGS, DATA, PICTURE, PRINT = "findings.json", "data.csv", "figure.png", "figure.pdf"
CORRECTION = "Holm"  # of the verdicts, for the number of an item's tests


@dataclass(frozen=True, slots=True)
class Basis:
    """What an item's findings rest on: the numbers are of episodes, 0 of a measurement."""

    command: str
    parameters: Mapping[str, str] = field(default_factory=dict)  # texts by title
    revision: str = field(default_factory=revision)
    asked_for: int = 0
    episodes: int = 0
    failed: int = 0
    left_out: int = 0  # rows of other scenarios or seeds
    absent: Sequence[str] = ()  # cells without any episode

    @classmethod
    def of_episodes(cls, command: str, rows: ItemRows) -> "Basis":
        """Of an item that is judged by episodes."""
        parameters = {study.file.name: study.text for study in rows.studies}
        missing = {"failed": rows.num_failed, "left_out": rows.left_out, "absent": rows.absent}
        return cls(command, parameters, asked_for=rows.asked, episodes=rows.num, **missing)


@dataclass(frozen=True, slots=True)
class Published:
    """What an item's folder says."""

    findings: tuple[Finding, ...]
    basis: Basis
    corrected: bool  # folders of earlier versions have verdicts that were not


def publish(
    folder: Path, figure: Figure, rows: Sequence[Mapping[str, Any]], findings: Sequence[Finding], basis: Basis
) -> None:
    """Writes an item's folder, its findings last: where they are, all is there."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        figure.savefig(folder / PICTURE, dpi=DPI, metadata={"Software": None})
        figure.savefig(folder / PRINT, metadata={"CreationDate": None})
    with open(folder / DATA, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows({key: neutral(cell) for key, cell in row.items()} for row in rows)
    parts = [asdict(finding) for finding in findings]
    document = {**asdict(basis), "correction": CORRECTION, "findings": parts}
    temporary = folder / f"{FINDINGS}.tmp"
    temporary.write_text(json.dumps(document, indent=1), encoding="utf-8")
    os.replace(temporary, folder / FINDINGS)


def read(folder: Path) -> Published | None:
    """What an item's folder says; None where it has no findings. Raises InputError where they cannot be read."""
    path = folder / FINDINGS
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        findings = tuple(Finding(**{**part, "verdict": Verdict(part["verdict"])}) for part in document.pop("findings"))
        corrected = document.pop("correction", None) is not None
        basis = Basis(**{key.replace(" ", "_"): value for key, value in document.items()})  # once "asked for"
        return Published(findings, basis, corrected)
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no findings of an item ({error}); `mjnav paper` makes them again") from None
