"""An item of the paper: what it claims, what its claims are tested by, and their verdicts.

A claim is tested once in every setting. The tests of all claims of an item are corrected together for their number
(Holm): where nothing differs, the chance that the item reports any difference is at most `LEVEL`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array
from mjnav.metrics.intervals import SharedBootstrap, holm
from mjnav.report.figure_text import unit
from mjnav.rng import stream
from mjnav.scene.spec import Scenario
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.compare.estimates import Difference, Estimate, difference, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.05
TOO_FEW = "too few to judge by"  # ends the line of a setting that decides nothing
LEAST_PAIRS = 20  # seeds in a setting; with fewer, it decides nothing
LEAST_RUNS = 5  # of a measurement; fewer make no interval

Cells = Sequence[CellRows]
Pair = tuple[CellRows | None, CellRows | None]  # of a method and of its reference
Progress = Callable[[int, int], None]  # parts done, of how many


class Verdict(StrEnum):
    """Whether a claim survives its measurement."""

    HOLDS = "holds"
    PARTLY = "holds in some settings"
    MIXED = "holds in some settings, fails in others"
    FAILS = "does not hold"
    OPEN = "not decided"


@dataclass(frozen=True, slots=True)
class Measured:
    """A claim in one setting."""

    favours: bool  # whether the measured sign is the claimed one
    p: float | None  # that it arose by chance, before correction; None where the data are too few to judge
    line: str = ""  # what was measured


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the paper and its tests."""

    text: str  # one sentence, in our words
    source: str  # where the claim is made: figure and section
    tests: Sequence[Measured]
    heading: str = ""  # the first line of the evidence; by default, the number of settings for and against


@dataclass(frozen=True, slots=True)
class Finding:
    """One claim and what was measured of it."""

    claim: str
    source: str
    verdict: Verdict
    evidence: str  # figures with their n and 95 % intervals


@dataclass(frozen=True, slots=True)
class StudyItem:
    """An item that is judged by the episodes of shipped studies."""

    title: str
    studies: tuple[str, ...]
    claims: Callable[[Cells], Iterable[Claim]]
    picture: Callable[[Cells], "Figure"]
    limits: str = ""  # what the comparison cannot say, for the page


@dataclass(frozen=True, slots=True)
class MeasuredItem:
    """An item that is judged by a measurement of its own, whose data have `rows()`: the table behind the picture."""

    title: str
    scenes: tuple[str, ...]
    overrides: tuple[str, ...]  # of the scenes, as `--set` takes them
    measure: Callable[[Sequence[Scenario], bool, Progress], Any]  # of scenarios; whether quick; progress
    claims: Callable[[Any], Iterable[Claim]]
    picture: Callable[[Any], "Figure"]
    limits: str = ""


Item = StudyItem | MeasuredItem


# ------------------------------------------------------------------------------------------- verdicts


def judge(claims: Iterable[Claim]) -> tuple[Finding, ...]:
    """The verdicts on all claims of an item, corrected for the number of their tests."""
    claims = tuple(claims)
    adjusted = iter(holm([test.p for claim in claims for test in claim.tests if test.p is not None]))
    findings = []
    for claim in claims:
        tests = [(test, None if test.p is None else next(adjusted)) for test in claim.tests]
        verdicts = [_verdict(test, p) for test, p in tests]
        lines = [f"{test.line}; {TOO_FEW if p is None else f'p = {p:.2g}'}" for test, p in tests if test.line]
        evidence = "\n".join([claim.heading or _count(verdicts), *lines])
        findings.append(Finding(claim.text, claim.source, overall(verdicts), evidence))
    return tuple(findings)


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """The verdict on a claim about all settings: PARTLY where it holds in some and is not decided in the others."""
    distinct = set(verdicts)
    if distinct == {Verdict.HOLDS}:
        return Verdict.HOLDS
    if Verdict.HOLDS in distinct:
        return Verdict.MIXED if Verdict.FAILS in distinct else Verdict.PARTLY
    return Verdict.FAILS if Verdict.FAILS in distinct else Verdict.OPEN


def _verdict(test: Measured, p: float | None) -> Verdict:
    if p is None or p >= LEVEL:
        return Verdict.OPEN
    return Verdict.HOLDS if test.favours else Verdict.FAILS


def _count(verdicts: Sequence[Verdict]) -> str:
    if not verdicts:
        return "no setting was run"
    count = Counter(verdicts)
    return f"settings: {count[Verdict.HOLDS]} for it, {count[Verdict.FAILS]} against, {count[Verdict.OPEN]} open"


# ------------------------------------------------------------------------------- tests on rows of studies


def measured(where: str, change: Difference, sign: int, in_unit: str = "") -> Measured:
    """That a difference has this sign; fewer than LEAST_PAIRS pairs decide nothing."""
    e = change.estimate
    line = f"{where}: {shown(e, in_unit, signed=True)}"
    return Measured(sign * e.value > 0.0, change.p if e.num >= LEAST_PAIRS else None, line)


def contrasts(cells: Cells, method: str, reference: str, figure: str, sign: int) -> list[Measured]:
    """That `figure` of method - reference has this sign, in every scene and setting that has either."""
    ours, theirs = by_place(cells, method), by_place(cells, reference)
    places = dict.fromkeys((*theirs, *ours))
    return [effect(place, [(ours.get(place), theirs.get(place))], figure, sign) for place in places]


def effect(where: str, pairs: Sequence[Pair], figure: str, sign: int) -> Measured:
    """That the mean over the pairs of `figure` of method - reference, on common seeds, has this sign.

    Pairs of which a cell is missing are left out.
    """
    run = [(ours, theirs) for ours, theirs in pairs if ours is not None and theirs is not None]
    if len(run) < len(pairs) > 1:
        where = f"{where}, over {len(run)} of {len(pairs)} combinations"
    if not run:
        return measured(where, paired(np.empty(0)), sign)
    if len(pairs) == 1:
        return measured(where, difference(*run[0], figure), sign, unit(figure))
    seeds = sorted(set.intersection(*(set(cell.seeds.tolist()) for pair in run for cell in pair)))
    changes = np.array([at_seeds(ours, seeds, figure) - at_seeds(theirs, seeds, figure) for ours, theirs in run])
    known = np.isfinite(changes)
    sums = np.where(known, changes, 0.0).sum(axis=0)
    means = np.divide(sums, known.sum(axis=0), out=np.full(len(seeds), np.nan), where=known.any(axis=0))
    return measured(where, paired(means), sign, unit(figure))


def at_seeds(cell: CellRows, seeds: Sequence[int], figure: str) -> Array:
    """A figure at those of its seeds, ascending."""
    return cell.values(figure)[np.isin(cell.seeds, seeds)]


def by_place(cells: Cells, method: str) -> dict[str, CellRows]:
    """The cells of a method by scene and setting."""
    return {place(cell.scene, cell.setting): cell for cell in cells if cell.method == method}


def place(scene: str, setting: str) -> str:
    """A scene and setting in a few words."""
    return f"{scene}, {short(setting)}"


def short(setting: str) -> str:
    """A setting without the names of the keys: direct, kinematic pearson."""
    return " ".join(word.rpartition("=")[2] for word in setting.split(" "))


def shown(e: Estimate, in_unit: str = "", *, signed: bool = False) -> str:
    """A figure with its interval and number of seeds."""
    sign = "+" if signed else ""
    if not np.isfinite(e.value):
        return f"undefined (n = {e.num})"
    interval = f" [{e.interval[0]:{sign}.3g}, {e.interval[1]:{sign}.3g}]" if e.interval is not None else ""
    return f"{e.value:{sign}.3g}{in_unit and ' ' + in_unit}{interval} (n = {e.num})"


# ----------------------------------------------------------------------------- tests on measurements


def mean_by_run(run: ArrayLike, values: ArrayLike, seed: int, use: str, *, boundary: float = 0.0) -> Difference:
    """The mean over runs of each run's mean of `values` (n,), of runs `run` (n,), with its 95 % interval.

    Decisions of one run resemble one another, so whole runs are resampled. The p-value, of sign flips, is that of the
    mean being the boundary; below LEAST_RUNS runs there is none. The seed and the use determine the draws.
    """
    run, values = np.asarray(run), np.asarray(values, float)
    means = np.array([values[run == which].mean() for which in np.unique(run)])
    interval, p = None, None
    if len(means) >= LEAST_RUNS:
        shared = SharedBootstrap(len(means), stream(seed, f"paper.{use}.bootstrap"))
        interval, (p,) = shared.interval(means), shared.p_values((means - boundary)[None])
    return Difference(Estimate(float(means.mean()), interval, len(means)), p)
