"""[layout]: which layout of a random scene a run has, and what its draws have to keep to; and what is drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any

from mjnav.config import Choice, Range, settle
from mjnav.scenarios.ranges import Seed

# What a layout is drawn for -> the remainder, modulo the number of purposes, of the whole numbers that its streams
# start from: no layout seed of one purpose is ever one of another.
PURPOSES = MappingProxyType({"reporting": 0, "training": 1})
MAX_TRIES = 10_000


@dataclass(frozen=True, slots=True)
class Layout:
    """Which layout is drawn, and what it keeps to. In a scene that draws nothing, a record of where it came from."""

    seed: Annotated[Seed | None, "of the layout alone; by default the run's"] = None
    purpose: Annotated[
        str, Choice(PURPOSES), "what the layout is for: no layout seed of one purpose is one of the other"
    ] = "reporting"
    gap: Annotated[
        Annotated[float, Range(0.0, 100.0, "m")] | None,
        "least distance of drawn furniture from all else; by default the robot's diameter and 0.4 m",
    ] = None
    tries: Annotated[int, Range(1, MAX_TRIES), "number of layouts that are drawn before the scene is refused"] = 200

    def __post_init__(self):
        settle(self)

    def root(self) -> int:
        """The whole number from which all streams of this layout start."""
        return (self.seed or 0) * len(PURPOSES) + PURPOSES[self.purpose]

    @property
    def label(self) -> str | None:
        """Purpose and seed, "reporting 7"; None where no seed is known, as nothing was drawn."""
        return None if self.seed is None else f"{self.purpose} {self.seed}"


@dataclass(frozen=True, slots=True)
class Draft:
    """The tables of a run file that draw something, as they stand there, with [layout]; by key."""

    tables: Mapping[str, Any]
