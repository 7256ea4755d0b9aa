"""The ablation of the kernel's degree: does a higher one avoid more of the samples, and is that the degree's doing?

The moment form says that degree d multiplies the weight of the mean's term by d (offset 1). So degrees are compared at
one weight, as in the paper, and at weights that make the mean's term weigh alike.
"""

from types import MappingProxyType

from mjnav.paper.contrast import Cells, claim, contrasts
from mjnav.paper.finding import Finding, judge

STUDIES = ("paper-degree",)
SOURCE = "the ablation of d, one obstacle"
# figure -> what a higher degree is said to do to it, the claim's sign and the figure's unit
CLAIMS = MappingProxyType(
    {
        "mean_safe_share": ("avoids a larger share of the samples (eta)", +1, ""),
        "min_clearance_m": ("keeps a larger distance from the obstacle", +1, "m"),
        "mean_deviation_m": ("leaves the way farther", +1, "m"),
        "control_cost": ("costs more control", +1, "m²/s³"),
    }
)


def findings(cells: Cells) -> tuple[Finding, ...]:
    """d = 3 against d = 1, at one weight and at matched weights."""
    found = []
    for figure, (what, sign, unit) in CLAIMS.items():
        for method, how in (("d=3", "at one weight"), ("d=3 matched", "at matched weights of the mean's term")):
            text = f"Degree 3 {what} than degree 1, {how}"
            found.append(claim(text, SOURCE, contrasts(cells, method, "d=1", figure), sign, unit))
    return judge(found)
