"""What became of the claims of an item, and on which evidence.

A claim is tested once in every setting. The tests of all claims of an item are corrected together for their number
(Holm): where nothing differs, the chance that the item says anywhere that something does is at most `LEVEL`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from mjnav.metrics.intervals import holm

LEVEL = 0.05
LEAST_PAIRS = 20  # seeds in a setting, below which it decides nothing


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

    favours: bool  # what was measured is on the claim's side
    p: float | None  # that it is so by chance, before correction; None where there is too little to judge by
    line: str = ""  # what was measured


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the paper and its tests; `heading` comes before their lines in place of their count."""

    text: str  # one sentence, in our words
    source: str  # where the claim is made: section or figure
    tests: Sequence[Measured]
    heading: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """One claim beside what was measured of it."""

    claim: str
    source: str
    verdict: Verdict
    evidence: str  # figures with their n and 95 % intervals


def judge(claims: Sequence[Claim]) -> tuple[Finding, ...]:
    """The verdicts on all claims of an item, corrected for the number of their tests."""
    adjusted = iter(holm([test.p for claim in claims for test in claim.tests if test.p is not None]))
    found = []
    for claim in claims:
        p_values = [None if test.p is None else next(adjusted) for test in claim.tests]
        verdicts = [_verdict(test, p) for test, p in zip(claim.tests, p_values, strict=True)]
        lines = [
            f"{test.line}; {'too few to judge by' if p is None else f'p = {p:.2g}'}"
            for test, p in zip(claim.tests, p_values, strict=True)
            if test.line
        ]
        evidence = "\n".join([claim.heading or _count(verdicts), *lines])
        found.append(Finding(claim.text, claim.source, overall(verdicts), evidence))
    return tuple(found)


def overall(verdicts: Iterable[Verdict]) -> Verdict:
    """Of a claim about all settings: partly where it holds in some and is not decided in the others."""
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
    count = f"{verdicts.count(Verdict.HOLDS)} of {len(verdicts)} settings for it"
    return f"{count}, {verdicts.count(Verdict.FAILS)} against"
