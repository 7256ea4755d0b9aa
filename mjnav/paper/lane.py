"""The lane (figure 6c, d): does the robot stay farther from the boundary with a higher degree?

The goal is close to the left boundary. Distances are those of the robot's edge from the nearer boundary.
"""

from collections.abc import Iterator

from mjnav.paper.bars import bars
from mjnav.paper.contrast import claim, contrasts
from mjnav.paper.degree import HOW, VARIANTS
from mjnav.paper.episodes import ROBOT_DIRECT, study
from mjnav.paper.item import Cells, Claim, StudyItem
from mjnav.study.study_file import MethodEntry, SettingEntry

LANE_WEIGHT = 10.0  # of the scene, on either side
METHODS = [
    MethodEntry("rkhs", name, {"degree": d} | ({} if share == 1.0 else {"lane_weights": [LANE_WEIGHT / d] * 2}))
    for name, (d, share) in VARIANTS.items()
]
SETTINGS = (SettingEntry("direct", ROBOT_DIRECT), SettingEntry("filtered"))


def claims(cells: Cells) -> Iterator[Claim]:
    """Degrees 2 and 3 against 1, at one weight and at matched weights; distances are means over time."""
    for suffix, how in HOW.items():
        for d in (2, 3):
            text = f"Degree {d} stays farther from the lane's boundary than degree 1, {how}"
            found = contrasts(cells, f"d={d}{suffix}", "d=1", "mean_lane_clearance_m")
            yield claim(text, "figure 6c, d, section V-B", found, +1, "m")


ITEM = StudyItem(
    title="The lane: distance from its boundary",
    studies=(study("lane", ["lane"], METHODS, settings=SETTINGS),),
    claims=claims,
    picture=lambda cells: bars(
        cells, tuple(VARIANTS), ["mean_lane_clearance_m", "min_lane_clearance_m", "mean_deviation_m"]
    ),
)
