"""One, two and three obstacles: RKHS with d = 3 against the linearised Gaussian, the same measures."""

from mjnav.paper.contrast import Cells, claim, contrasts, each
from mjnav.paper.finding import Finding, judge
from mjnav.paper.one import MEASURES

STUDIES = ("paper-one", "paper-many")
SOURCE = "the comparison with one, two and three obstacles"
SCENES = ("crossing1", "crossing2", "crossing3")


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Every measure for every number of obstacles."""
    found = []
    for figure, what, unit in MEASURES:
        for number, scene in enumerate(SCENES, start=1):
            here = each(cells, lambda cell, scene=scene: cell.scene == scene)
            text = f"With {number} obstacle{'s' * (number > 1)}, rkhs d=3 takes {what} than gaussian-linearised"
            against = contrasts(here, "rkhs d=3", "gaussian-linearised", figure)
            found.append(claim(text, SOURCE, against, -1, unit))
    return judge(found)
