"""What became of one claim of the paper, and on which evidence."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """Whether a claim survives its measurement."""

    HOLDS = "holds"
    PARTLY = "holds in some settings"
    MIXED = "holds in some settings, fails in others"
    FAILS = "does not hold"
    OPEN = "not decided"


@dataclass(frozen=True, slots=True)
class Finding:
    """One claim beside what was measured of it."""

    claim: str  # one sentence, in our words
    source: str  # where the claim is made: section or figure
    verdict: Verdict
    evidence: str  # figures with their n and 95 % intervals


def verdict(interval: tuple[float, float] | None, boundary: float = 0.0) -> Verdict:
    """Of the claim that a figure lies above the boundary, by the figure's interval; None decides nothing."""
    if interval is None or interval[0] <= boundary <= interval[1]:
        return Verdict.OPEN
    return Verdict.HOLDS if interval[0] > boundary else Verdict.FAILS
