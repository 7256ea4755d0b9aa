"""What became of one claim of the paper, and on which evidence."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """Whether a claim survives its measurement."""

    HOLDS = "holds"
    FAILS = "does not hold"
    OPEN = "not decided"


@dataclass(frozen=True, slots=True)
class Finding:
    """One claim beside what was measured of it."""

    claim: str  # one sentence, in our words
    source: str  # where the claim is made: section or figure
    verdict: Verdict
    evidence: str  # figures with their n and 95 % intervals
