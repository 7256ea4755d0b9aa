"""The premise (section I): noise is not Gaussian, and the method uses its shape. Does it?

Samples have the noise's own skew, the skew mirrored, or are Gaussian of the same covariance.
"""

from collections.abc import Iterator
from types import MappingProxyType

from mjnav.paper.bars import bars
from mjnav.paper.contrast import Contrast, by_place, claim
from mjnav.paper.episodes import DIRECT, TUNED, study
from mjnav.paper.item import Cells, Claim, StudyItem
from mjnav.study.compare.estimates import difference
from mjnav.study.study_file import SettingEntry

METHODS = ("rkhs d=1", "rkhs d=3", "kld", "saa", "gaussian-moments")
NOISES = ("pearson", "bimodal")
ASSUMED = (("true", ""), ("mirrored", "{}-mirrored"), ("gaussian", "gaussian"))  # shape of samples, their profile
SETTINGS = tuple(
    SettingEntry(
        f"{noise}, {shape}",
        {"noise.profile": noise} | ({"estimation.assumed_profile": profile.format(noise)} if profile else {}),
    )
    for noise in NOISES
    for shape, profile in ASSUMED
)


def claims(cells: Cells) -> Iterator[Claim]:
    """The right shape against the wrong ones, by method."""
    for method in METHODS:
        for wrong in ("mirrored", "gaussian"):
            for figure, what, unit in (
                ("collision", "fewer collisions", ""),
                ("control_cost", "less control cost", "m²/s³"),
            ):
                text = f"{method} gives {what} with samples of the noise's own shape than with {wrong} ones"
                yield claim(text, "the premise, section I", list(_contrasts(cells, method, wrong, figure)), -1, unit)


def _contrasts(cells: Cells, method: str, wrong: str, figure: str) -> Iterator[Contrast]:
    found = {cell.setting: cell for cell in by_place(cells, method).values()}
    for noise in NOISES:
        true, false = found.get(f"{noise}, true"), found.get(f"{noise}, {wrong}")
        if true is not None and false is not None:
            yield Contrast(noise, difference(true, false, figure))


ITEM = StudyItem(
    title="Does the method use the shape of the noise?",
    studies=(
        study(
            "shape",
            ["crossing3"],
            [TUNED[name] for name in METHODS],
            settings=SETTINGS,
            grid=MappingProxyType({}),
            common={"physics.engine": "kinematic", **DIRECT},
        ),
    ),
    claims=claims,
    picture=lambda cells: bars(cells, METHODS, ["collision", "min_clearance_m", "control_cost", "mean_deviation_m"]),
)
