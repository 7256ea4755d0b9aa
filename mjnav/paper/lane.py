"""The lane: does the robot stay farther from the boundary with a higher degree?"""

from mjnav.paper.contrast import Cells, claim, contrasts
from mjnav.paper.finding import Finding, judge

STUDIES = ("paper-lane",)
SOURCE = "the lane figure"


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Degrees 2 and 3 against 1, at one weight and at matched weights; distances are means over time."""
    found = []
    for method in ("d=2", "d=3", "d=2 matched", "d=3 matched"):
        how = "at matched weights of the mean's term" if "matched" in method else "at one weight"
        text = f"Degree {method[2]} stays farther from the lane's boundary than degree 1, {how}"
        against = contrasts(cells, method, "d=1", "mean_lane_clearance_m")
        found.append(claim(text, SOURCE, against, +1, "m"))
    return judge(found)
