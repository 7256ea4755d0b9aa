"""One, two and three obstacles: RKHS with d = 3 against the linearised Gaussian, the same measures."""

from mjnav.study.paper.contrast import Cells, contrasts, each, summary
from mjnav.study.paper.finding import Finding
from mjnav.study.paper.one import MEASURES

STUDIES = ("paper-one", "paper-many")
SOURCE = "the comparison with one, two and three obstacles"
SCENES = ("crossing1", "crossing2", "crossing3")


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Every measure for every number of obstacles."""
    found = []
    for figure, claim, unit in MEASURES:
        for number, scene in enumerate(SCENES, start=1):
            here = each(cells, lambda cell, scene=scene: cell.scene == scene)
            verdict, evidence = summary(contrasts(here, "rkhs d=3", "gaussian-linearised", figure), -1, unit)
            text = f"With {number} obstacle{'s' * (number > 1)}, rkhs d=3 takes {claim} than gaussian-linearised"
            found.append(Finding(text, SOURCE, verdict, evidence))
    return tuple(found)
