"""Which tables of a run file draw something."""

from collections.abc import Iterator, Mapping
from typing import Any

from mjnav.scenarios.layout.entries import KINDS
from mjnav.scenarios.layout.entry import Entry
from mjnav.scenarios.layout.robot import DrawnPlaces
from mjnav.scenarios.random_scene import Draft


def draft_of(document: Mapping[str, Any]) -> Draft | None:
    """The tables of a run file that draw something; None where none does."""
    entries = [entry for entry in entries_of(document) if entry.is_drawn]
    drawn = {entry.key.partition(".")[0] for entry in entries}
    robot = document.get("robot")
    if isinstance(robot, Mapping) and DrawnPlaces(robot).is_drawn:
        drawn.add("robot")
    if not drawn:
        return None
    return Draft({key: value for key, value in document.items() if key in drawn or key == "layout"})


def entries_of(document: Mapping[str, Any]) -> Iterator[Entry]:
    """The entries of all arrays; what is no table in an array is left to the reader."""
    for name, kind in KINDS.items():
        items = document.get(name)
        for i, item in enumerate(items if isinstance(items, list) else ()):
            if isinstance(item, Mapping):
                yield Entry(kind, f"{name}.{i}", item)
