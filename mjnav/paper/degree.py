"""The ablation of the kernel's degree (figure 5): does a higher one avoid more samples, and is that the degree's doing?

Degree 1 is the squared difference of two means: of the samples' and of the desired ones', after both are clipped.

The moment form says that degree d multiplies the weight of the mean's term by d (offset 1). So degrees are compared at
one weight, as in the paper, and at weights that make the mean's term weigh alike.
"""

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from mjnav.paper.bars import bars
from mjnav.paper.contrast import claim, contrasts
from mjnav.paper.episodes import study
from mjnav.paper.item import Cells, Claim, StudyItem
from mjnav.study.study_file import MethodEntry

# label -> degree and weight
VARIANTS: Mapping[str, tuple[int, float]] = MappingProxyType(
    {"d=1": (1, 1.0), "d=2": (2, 1.0), "d=3": (3, 1.0), "d=2 matched": (2, 1.0 / 2.0), "d=3 matched": (3, 1.0 / 3.0)}
)
HOW: Mapping[str, str] = MappingProxyType({"": "at one weight", " matched": "at matched weights of the mean's term"})
METHODS = [MethodEntry("rkhs", name, {"degree": d, "weight": weight}) for name, (d, weight) in VARIANTS.items()]
# figure, what a higher degree is said to do to it, the claim's sign, the figure's unit
CLAIMS = (
    ("mean_safe_share", "avoids a larger share of the samples (eta)", +1, ""),
    ("min_clearance_m", "keeps a larger distance from the obstacle", +1, "m"),
    ("mean_deviation_m", "leaves the way farther", +1, "m"),
    ("control_cost", "costs more control", +1, "m²/s³"),
)


def claims(cells: Cells) -> Iterator[Claim]:
    """d = 3 against d = 1, at one weight and at matched weights."""
    for figure, what, sign, unit in CLAIMS:
        for suffix, how in HOW.items():
            found = contrasts(cells, f"d=3{suffix}", "d=1", figure)
            yield claim(f"Degree 3 {what} than degree 1, {how}", "figure 5, section V-C", found, sign, unit)


ITEM = StudyItem(
    title="The degree of the kernel, against one obstacle",
    studies=(study("degree", ["crossing1"], METHODS),),
    claims=claims,
    picture=lambda cells: bars(cells, tuple(VARIANTS), [figure for figure, *_ in CLAIMS]),
    limits=(
        "Degree 1 is the squared difference of the two means, after the samples are clipped: it sees no other moment "
        "of the distributions."
    ),
)
