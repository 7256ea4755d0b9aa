"""Which features a learned policy sees."""

from dataclasses import dataclass
from typing import Annotated

from mjnav.config import Choice, Length, Range, settle

BLOCKS = ("robot", "people", "scan", "grid")

Block = Annotated[str, Choice(BLOCKS)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Features:
    """The blocks that a policy sees, and their sizes. `mjnav.control.policy.blocks` says what stands in each.

    Raises InvalidValue for a block that does not exist and a size that is not allowed.
    """

    blocks: Annotated[tuple[Block, ...], Length(1, len(BLOCKS))] = ("robot", "people")
    sight: Annotated[float, Range(0.5, 1000.0, "m"), "distances are clipped to it; people beyond it are not seen"] = (
        10.0
    )
    max_people: Annotated[int, Range(1, 500), "rows of `people`, nearest first"] = 5
    beams: Annotated[int, Range(1, 10_000), "sectors of `scan`"] = 36
    cells: Annotated[int, Range(2, 512), "of `grid` to a side"] = 32
    resolution: Annotated[float, Range(0.01, 10.0, "m"), "side of a cell of `grid`"] = 0.25

    def __post_init__(self):
        settle(self)
