"""What is owed to the cone's form, to the preview and to foreseeing the delay, before anything is owed to the RKHS.

The effect of each factor is the mean over the other two of the difference between its levels, seed by seed.
"""

from collections.abc import Callable, Iterator
from itertools import product
from types import MappingProxyType

import numpy as np

from mjnav.messages import Array
from mjnav.paper.contrast import Cells, Contrast, claim
from mjnav.paper.finding import Finding, judge
from mjnav.study.compare.compare import CellRows, paired

STUDIES = ("paper-factors",)
SOURCE = "what the paper does not vary"
# factor -> its level in the paper and here, as a setting's label has them
FACTORS = MappingProxyType(
    {
        "form": ("form=line", "form=segment"),
        "preview": ("preview=0.1", "preview=0.4"),
        "prediction": ("prediction=false", "prediction=true"),
    }
)
NAMES = MappingProxyType(
    {
        "form": "The segment form of the cone in place of the line form",
        "preview": "A preview of 0.4 s in place of one period",
        "prediction": "Foreseeing the delay",
    }
)
ENGINES = ("kinematic", "mujoco")
METHODS = ("rkhs", "saa", "mean")


def findings(cells: Cells) -> tuple[Finding, ...]:
    """Each factor's effect on collisions and cost for each method, and the method's own."""
    found = []
    for figure, what, unit in (("collision", "avoids collisions", ""), ("control_cost", "saves control", "m²/s³")):
        for factor in FACTORS:
            effects = [effect for method in METHODS for effect in _effects(cells, method, factor, figure)]
            found.append(claim(f"{NAMES[factor]} {what}", SOURCE, effects, -1, unit))
        for rival in ("mean", "saa"):
            text = f"Matching distributions {what}, against {rival}, the factors being equal"
            found.append(claim(text, SOURCE, list(_method_effects(cells, rival, figure)), -1, unit))
    return judge(found)


def levels() -> Iterator[tuple[str, ...]]:
    """Every combination of the factors' levels."""
    return product(*FACTORS.values())


def cell_of(cells: Cells, engine: str, chosen: tuple[str, ...], method: str) -> CellRows | None:
    """The cell of a combination of levels."""
    for cell in cells:
        words = cell.setting.replace(",", "").split(" ")
        if cell.method == method and words[0] == engine and all(level in words for level in chosen):
            return cell
    return None


def _effects(cells: Cells, method: str, factor: str, figure: str) -> Iterator[Contrast]:
    before, after = FACTORS[factor]
    place = list(FACTORS).index(factor)
    for engine in ENGINES:
        pairs = [
            (cell_of(cells, engine, chosen, method), cell_of(cells, engine, _with(chosen, place, before), method))
            for chosen in levels()
            if chosen[place] == after
        ]
        yield from _mean_difference(f"{method}, {engine}", pairs, lambda cell: cell.values(figure))


def _method_effects(cells: Cells, rival: str, figure: str) -> Iterator[Contrast]:
    for engine in ENGINES:
        pairs = [(cell_of(cells, engine, chosen, "rkhs"), cell_of(cells, engine, chosen, rival)) for chosen in levels()]
        yield from _mean_difference(engine, pairs, lambda cell: cell.values(figure))


def _with(chosen: tuple[str, ...], place: int, level: str) -> tuple[str, ...]:
    return (*chosen[:place], level, *chosen[place + 1 :])


def _mean_difference(
    where: str, pairs: list[tuple[CellRows | None, CellRows | None]], values: Callable[[CellRows], Array]
) -> Iterator[Contrast]:
    """Of after - before, the mean over the pairs of cells that are there, by seed."""
    there = [(after, before) for after, before in pairs if after is not None and before is not None]
    if len(there) < len(pairs):
        where = f"{where}, over {len(there)} of {len(pairs)} combinations"
    if not there:
        yield Contrast(where, paired(np.empty(0)))
        return
    seeds = sorted(set.intersection(*(set(cell.seeds.tolist()) for pair in there for cell in pair)))
    changes = np.array(
        [_at(values(after), after, seeds) - _at(values(before), before, seeds) for after, before in there]
    )
    known = np.isfinite(changes)
    sums = np.where(known, changes, 0.0).sum(0)
    mean = np.divide(sums, known.sum(0), out=np.full(len(seeds), np.nan), where=known.any(0))
    yield Contrast(where, paired(mean))


def _at(values: Array, cell: CellRows, seeds: list[int]) -> Array:
    return values[np.isin(cell.seeds, seeds)]
