"""Matching by MMD takes less control and less time than by KL divergence: a claim of Poonganam et al., RA-L 2020."""

from collections.abc import Iterator

from mjnav.paper import many, one
from mjnav.paper.bars import bars
from mjnav.paper.contrast import claim, contrasts
from mjnav.paper.item import Cells, Claim, StudyItem

METHODS = ("rkhs d=1", "rkhs d=3")
SCENES = ("crossing1", "crossing3")
CLAIMS = (
    ("control_cost", "less control cost", "m²/s³"),
    ("mean_deviation_m", "less deviation from the way", "m"),
    ("compute_ms_control_p50", "less time to decide", "ms"),
    ("collision", "fewer collisions", ""),
)


def claims(cells: Cells) -> Iterator[Claim]:
    """rkhs against kld with one and with three obstacles."""
    for figure, what, unit in CLAIMS:
        for method in METHODS:
            found = contrasts(_here(cells), method, "kld", figure)
            yield claim(f"{method} takes {what} than kld", "Poonganam et al., RA-L 2020", found, -1, unit)


def _here(cells: Cells) -> Cells:
    return [cell for cell in cells if cell.scene in SCENES]


ITEM = StudyItem(
    title="Matching by MMD against matching by KL divergence",
    studies=(one.STUDY, many.STUDY),
    claims=claims,
    picture=lambda cells: bars(_here(cells), (*METHODS, "kld"), [figure for figure, *_ in CLAIMS]),
)
