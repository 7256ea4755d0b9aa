"""An item of the paper: what it claims, what it is judged by, and what became of the claims.

A claim is tested once in every setting. The tests of all claims of an item are corrected together for their number
(Holm): where nothing differs, the chance that the item reports any difference is at most `LEVEL`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from mjnav.metrics.intervals import holm
from mjnav.scenarios.spec import Scenario
from mjnav.study.compare.cell_rows import CellRows
from mjnav.study.study_file import StudyFile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.05
TOO_FEW = "too few to judge by"  # ends the line of a setting that decides nothing
LEAST_PAIRS = 20  # seeds in a setting; with fewer, it decides nothing

Cells = Sequence[CellRows]
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


class Measurement(Protocol):
    """What a measured item is judged by."""

    def rows(self) -> list[dict[str, Any]]:
        """The figures behind the picture, as a table."""
        ...


Data = TypeVar("Data", bound=Measurement)


@dataclass(frozen=True, slots=True)
class StudyItem:
    """An item that is judged by the episodes of studies."""

    title: str
    studies: tuple[StudyFile, ...]
    claims: Callable[[Cells], Iterable[Claim]]
    picture: Callable[[Cells], "Figure"]
    limits: str = ""  # what the comparison cannot say, for the page


@dataclass(frozen=True, slots=True)
class MeasuredItem(Generic[Data]):
    """An item that is judged by a measurement of its own."""

    title: str
    scenes: tuple[str, ...]
    overrides: tuple[str, ...]  # of the scenes, as `--set` takes them
    measure: Callable[[Sequence[Scenario], bool, Progress], Data]  # of scenarios; whether quick; progress
    claims: Callable[[Data], Iterable[Claim]]
    picture: Callable[[Data], "Figure"]
    limits: str = ""  # what the measurement cannot say, for the page


Item = StudyItem | MeasuredItem[Any]


def judge(claims: Iterable[Claim]) -> tuple[Finding, ...]:
    """The verdicts on all claims of an item, corrected for the number of their tests."""
    claims = tuple(claims)
    adjusted = iter(holm([test.p for claim in claims for test in claim.tests if test.p is not None]))
    found = []
    for claim in claims:
        p_values = [None if test.p is None else next(adjusted) for test in claim.tests]
        verdicts = [_verdict(test, p) for test, p in zip(claim.tests, p_values, strict=True)]
        lines = [
            f"{test.line}; {TOO_FEW if p is None else f'p = {p:.2g}'}"
            for test, p in zip(claim.tests, p_values, strict=True)
            if test.line
        ]
        evidence = "\n".join([claim.heading or _count(verdicts), *lines])
        found.append(Finding(claim.text, claim.source, overall(verdicts), evidence))
    return tuple(found)


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """The verdict on a claim about all settings: PARTLY where it holds in some and is not decided in the others."""
    found = set(verdicts)
    if found == {Verdict.HOLDS}:
        return Verdict.HOLDS
    if Verdict.HOLDS in found:
        return Verdict.MIXED if Verdict.FAILS in found else Verdict.PARTLY
    return Verdict.FAILS if Verdict.FAILS in found else Verdict.OPEN


def _verdict(test: Measured, p: float | None) -> Verdict:
    if p is None or p >= LEVEL:
        return Verdict.OPEN
    return Verdict.HOLDS if test.favours else Verdict.FAILS


def _count(verdicts: Sequence[Verdict]) -> str:
    if not verdicts:
        return "no setting was run"
    count = Counter(verdicts)
    return f"settings: {count[Verdict.HOLDS]} for it, {count[Verdict.FAILS]} against, {count[Verdict.OPEN]} open"
