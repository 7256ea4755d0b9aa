"""What the paper does not vary: the cone's form, the preview, the prediction of the delay, apart from the RKHS.

The effect of each factor is the mean over the other two of the difference between its levels, seed by seed.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from types import MappingProxyType

import numpy as np

from mjnav.messages import Array
from mjnav.paper.bars import bars
from mjnav.paper.contrast import Contrast, claim, undefined
from mjnav.paper.episodes import DIRECT, study
from mjnav.paper.item import Cells, Claim, StudyItem
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import paired
from mjnav.study.study_file import MethodEntry, SettingEntry

SOURCE = "what the paper does not vary"
# name -> its level in the paper and here, as a setting's label has them
FACTORS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "The segment form of the cone in place of the line form": ("form=line", "form=segment"),
        "A preview of 0.4 s in place of one period": ("preview=0.1", "preview=0.4"),
        "Prediction of the delay": ("prediction=false", "prediction=true"),
    }
)
LEVELS = tuple(product(*FACTORS.values()))  # every combination
ENGINES = ("kinematic", "mujoco")
METHODS = ("rkhs", "saa", "mean")
RIVALS: Mapping[str, str] = MappingProxyType(
    {"mean": "constraints at the mean (mean)", "saa": "a bound on the share of samples that collide (saa)"}
)
FIGURES = (("collision", "avoids collisions", ""), ("control_cost", "saves control", "m²/s³"))

Pair = tuple[CellRows | None, CellRows | None]  # after and before


def setting(engine: str, levels: Sequence[str]) -> str:
    """The label of a combination of levels."""
    return f"{engine}, {' '.join(levels)}"


def claims(cells: Cells) -> Iterator[Claim]:
    """Each factor's effect on collisions and cost for each method, and the method's own."""
    at = {(cell.method, cell.setting): cell for cell in cells}
    for figure, what, unit in FIGURES:
        for name, (before, after) in FACTORS.items():
            effects = []
            for method, engine in product(METHODS, ENGINES):
                places = [setting(engine, levels) for levels in LEVELS if after in levels]
                pairs = [(at.get((method, place)), at.get((method, place.replace(after, before)))) for place in places]
                effects.append(_mean_difference(f"{method}, {engine}", pairs, figure))
            yield claim(f"{name} {what}", SOURCE, effects, -1, unit)
        for rival in RIVALS:
            effects = []
            for engine in ENGINES:
                places = [setting(engine, levels) for levels in LEVELS]
                pairs = [(at.get(("rkhs", place)), at.get((rival, place))) for place in places]
                effects.append(_mean_difference(engine, pairs, figure))
            text = f"Matching by a weight (rkhs) {what}, against {RIVALS[rival]}, the factors being equal"
            yield claim(text, SOURCE, effects, -1, unit)


def _mean_difference(where: str, pairs: Sequence[Pair], figure: str) -> Contrast:
    """The mean over the pairs whose cells are both there of after - before, by seed."""
    there = [(after, before) for after, before in pairs if after is not None and before is not None]
    if len(there) < len(pairs):
        where = f"{where}, over {len(there)} of {len(pairs)} combinations"
    if not there:
        return undefined(where)
    seeds = sorted(set.intersection(*(set(cell.seeds.tolist()) for pair in there for cell in pair)))

    def at(cell: CellRows) -> Array:
        return cell.values(figure)[np.isin(cell.seeds, seeds)]

    changes = np.array([at(after) - at(before) for after, before in there])
    known = np.isfinite(changes)
    sums = np.where(known, changes, 0.0).sum(0)
    return Contrast(where, paired(np.divide(sums, known.sum(0), out=np.full(len(seeds), np.nan), where=known.any(0))))


ITEM = StudyItem(
    title="Cone form, preview, prediction of the delay",
    studies=(
        study(
            "factors",
            ["crossing3"],
            [MethodEntry("rkhs", set={"weight": 1.0}), MethodEntry("mean"), MethodEntry("saa", set={"eta": 0.9})],
            settings=tuple(SettingEntry(engine, {"physics.engine": engine}) for engine in ENGINES),
            grid={
                "control.form": ["line", "segment"],
                "control.preview": [0.1, 0.4],
                "control.prediction": [False, True],
            },
            common=DIRECT,
        ),
    ),
    claims=claims,
    picture=lambda cells: bars(cells, METHODS, ["collision", "control_cost", "mean_deviation_m", "min_clearance_m"]),
    limits=(
        "The claim that matching takes less control than saa is withdrawn: rkhs weighs its risk against the goal, saa "
        "forbids what exceeds a bound, so the difference is one of a soft against a hard constraint as much as of "
        "matching. What is left is that this rkhs, at this weight, differs from this saa, at this bound."
    ),
)
