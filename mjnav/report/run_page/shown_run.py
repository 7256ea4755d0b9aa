"""One run of a page: what was found in its log, its place among the page's runs, and what it is called."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

from mjnav.recording.encode.json_messages import dumps
from mjnav.report.inspection import Inspection
from mjnav.report.run_page.page_figures import flatten
from mjnav.report.run_page.playback import Playback

_OUTCOMES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "goal": ("good", "✓ goal reached"),
        "collision": ("bad", "✕ collision"),
        "timeout": ("fair", "■ out of time"),
        "aborted": ("fair", "■ aborted"),
    }
)
_UNFINISHED = ("fair", "■ the run did not end")


@dataclass(frozen=True, slots=True)
class ShownRun:
    """A run and its number on the page, from 0."""

    number: int
    letter: str  # "" for the only run
    inspection: Inspection
    document: dict[str, Any]  # what `mjnav inspect --json` prints
    figures: dict[str, Any]  # the document's leaves by dotted key
    playback: Playback

    @property
    def scene(self) -> str:
        """The name of the scene."""
        return str((self.inspection.run or {}).get("scene", "unknown scene"))

    @property
    def driver(self) -> str:
        """Controller and seed, in words."""
        run = self.inspection.run or {}
        return f"{run.get('controller', 'unknown controller')}, seed {run.get('seed', 'unknown')}"

    @property
    def heading(self) -> str:
        """Letter, scene, controller and seed, in HTML."""
        return f"{self.mark}{' ' * bool(self.letter)}{escape(f'{self.scene}, {self.driver}')}"

    @property
    def mark(self) -> str:
        """The letter in the run's colour, in HTML; nothing for the only run."""
        return f'<b class="letter run-{self.number}">{self.letter}</b>' if self.letter else ""

    @property
    def badge(self) -> str:
        """How the run ended, in HTML: a sign, a word and a colour."""
        outcome = self.inspection.outcome
        kind, text = _UNFINISHED if outcome is None else _OUTCOMES.get(outcome, ("fair", outcome))
        return f'<span class="badge {kind}" data-outcome="{self.number}">{escape(text)}</span>'


def shown_run(number: int, letter: str, inspection: Inspection, playback: Playback) -> ShownRun:
    """A run of a page, from what `inspect` and `playback` say of it."""
    document = json.loads(dumps(inspection.document()))
    return ShownRun(number, letter, inspection, document, flatten(document), playback)
