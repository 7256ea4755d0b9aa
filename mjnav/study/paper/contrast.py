"""One method against another in every setting of a study: the evidence for or against a claim."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.study.compare import CellRows, Estimate, difference, estimate
from mjnav.study.paper.finding import Verdict, verdict

LEAST_PAIRS = 20  # below, an interval says too little to decide anything

Cells = Sequence[CellRows]


@dataclass(frozen=True, slots=True)
class Contrast:
    """A difference in one scene and setting."""

    where: str
    estimate: Estimate

    def judged(self, sign: int) -> Verdict:
        """Of the claim that the difference has this sign."""
        e = self.estimate
        if e.num < LEAST_PAIRS or e.interval is None:
            return Verdict.OPEN
        low, high = sorted(sign * end for end in e.interval)
        return verdict((low, high))


def contrasts(cells: Cells, method: str, reference: str, figure: str) -> list[Contrast]:
    """`figure` of method - reference on common seeds, in every scene and setting that has both."""
    found = []
    for where, base in by_place(cells, reference).items():
        cell = by_place(cells, method).get(where)
        if cell is not None:
            found.append(Contrast(where, difference(cell, base, figure).estimate))
    return found


def by_place(cells: Cells, method: str) -> dict[str, CellRows]:
    """The cells of a method by scene and setting."""
    return {place(cell.scene, cell.setting): cell for cell in cells if cell.method == method}


def place(scene: str, setting: str) -> str:
    """A scene and setting in a few words."""
    return f"{scene}, {short(setting)}"


def short(setting: str) -> str:
    """A setting without the names of the keys: direct, kinematic pearson."""
    return " ".join(word.rpartition("=")[2] for word in setting.split(" "))


def values(cells: Cells, method: str, figure: str) -> dict[str, Estimate]:
    """The method's own figure in every scene and setting."""
    return {where: estimate(cell, figure) for where, cell in by_place(cells, method).items()}


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """Of a claim about all settings: partly where it holds in some and is not decided in the others."""
    found = set(verdicts)
    if found == {Verdict.HOLDS}:
        return Verdict.HOLDS
    if Verdict.HOLDS in found:
        return Verdict.MIXED if Verdict.FAILS in found else Verdict.PARTLY
    return Verdict.FAILS if Verdict.FAILS in found else Verdict.OPEN


def summary(found: Sequence[Contrast], sign: int, unit: str = "") -> tuple[Verdict, str]:
    """What the contrasts say of the claim that their differences have this sign, and the figures that say it."""
    verdicts = [contrast.judged(sign) for contrast in found]
    lines = [f"{contrast.where}: {shown(contrast.estimate, unit, signed=True)}" for contrast in found]
    count = f"{verdicts.count(Verdict.HOLDS)} of {len(verdicts)} settings for it"
    against = verdicts.count(Verdict.FAILS)
    return overall(verdicts), "\n".join([f"{count}, {against} against", *lines])


def shown(e: Estimate, unit: str = "", *, signed: bool = False, digits: int = 3) -> str:
    """A figure with its interval and number of seeds."""
    sign = "+" if signed else ""
    if not np.isfinite(e.value):
        return f"undefined (n = {e.num})"
    text = f"{e.value:{sign}.{digits}g}{unit and ' ' + unit}"
    if e.interval is not None:
        text += f" [{e.interval[0]:{sign}.{digits}g}, {e.interval[1]:{sign}.{digits}g}]"
    return f"{text} (n = {e.num})"


def each(cells: Cells, judge: Callable[[CellRows], bool]) -> list[CellRows]:
    """The cells for which `judge` is true."""
    return [cell for cell in cells if judge(cell)]
