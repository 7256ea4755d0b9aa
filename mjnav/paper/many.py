"""One, two and three obstacles (figure 8): RKHS with d = 3 against the linearised Gaussian, each as it was tuned."""

from collections.abc import Iterator

from mjnav.paper import one
from mjnav.paper.bars import bars
from mjnav.paper.contrast import claim, contrasts
from mjnav.paper.episodes import TUNED, study
from mjnav.paper.item import Cells, Claim, StudyItem

OURS, THEIRS = "rkhs d=3", "gaussian-linearised"
STUDY = study("many", ["crossing2", "crossing3"], [TUNED[name] for name in ("rkhs d=1", OURS, THEIRS, "kld")])


def claims(cells: Cells) -> Iterator[Claim]:
    """Every measure for every number of obstacles."""
    for figure, what, unit in one.MEASURES:
        for number in (1, 2, 3):
            here = [cell for cell in cells if cell.scene == f"crossing{number}"]
            text = f"With {number} obstacle{'s' * (number > 1)}, {OURS} takes {what} than {THEIRS}"
            yield claim(text, "figure 8, section V-D", contrasts(here, OURS, THEIRS, figure), -1, unit)


ITEM = StudyItem(
    title="One, two and three obstacles",
    studies=(one.STUDY, STUDY),
    claims=claims,
    picture=lambda cells: bars(
        cells, (OURS, THEIRS), ["control_cost", "mean_deviation_m", "time_to_avoid_s", "collision"]
    ),
    limits=one.LIMITS,
)
