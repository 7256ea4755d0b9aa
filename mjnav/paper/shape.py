"""Does a method use the shape of the noise? Samples with the right shape, with its mirror image, and Gaussian ones."""

from collections.abc import Iterator

from mjnav.paper.contrast import Cells, Contrast, by_place, claim
from mjnav.paper.finding import Finding, judge
from mjnav.study.compare.compare import CellRows, difference

STUDIES = ("paper-shape",)
SOURCE = "the premise: noise is not Gaussian, and the method uses its samples"
METHODS = ("rkhs d=1", "rkhs d=3", "kld", "saa", "gaussian-moments")
FIGURES = (("collision", "fewer collisions", -1, ""), ("control_cost", "less control cost", -1, "m²/s³"))


def findings(cells: Cells) -> tuple[Finding, ...]:
    """The right shape against the wrong ones, by method."""
    found = []
    for method in METHODS:
        for wrong in ("mirrored", "gaussian"):
            for figure, what, sign, unit in FIGURES:
                text = f"{method} gives {what} with samples of the noise's own shape than with {wrong} ones"
                found.append(claim(text, SOURCE, list(_contrasts(cells, method, wrong, figure)), sign, unit))
    return judge(found)


def _contrasts(cells: Cells, method: str, wrong: str, figure: str) -> Iterator[Contrast]:
    found: dict[str, CellRows] = by_place(cells, method)
    for noise in ("pearson", "bimodal"):
        true, false = (
            next((cell for cell in found.values() if cell.setting == f"{noise}, {shape}"), None)
            for shape in ("true", wrong)
        )
        if true is not None and false is not None:
            yield Contrast(noise, difference(true, false, figure))
