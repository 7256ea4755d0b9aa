"""Birth, confirmation and death of a track.

Its score is the log-odds that it stands for a body (Sittler 1964; Musicki, Evans & Stankovic 1994). It begins even, and

    a detection z that belongs to it     adds log(DETECTED p(z) / clutter)
    a scan without one                   adds log(1 - P_D)

with P_D the share of its belief that the scan could see, times DETECTED. So a track that stands behind something, out
of range, or before a lidar that is silent, loses nothing: it coasts, until nobody knows any more where it is.
"""

from dataclasses import dataclass
from math import log, log1p

DETECTED = 0.85  # probability that a body in full view is detected: two that touch may be one cluster
CLUTTER = 0.002  # [1/m^2] density of false detections in a scan; with new bodies among them
CONFIRMED = 3  # detections that confirm a track, whose score has never been so low that it died
DEAD = -3.0  # score, 5 % in probability
SUREST = 8.0  # score; a track in full view dies after six scans in a row without a detection
COASTING = 5.0  # [s] without a detection, at most
SPREAD = 1.5  # [m] std of the position in its widest direction, at most


@dataclass(slots=True)
class Life:
    """What decides how long a track lives."""

    born: float  # [s]
    seen: float  # [s] when a detection last belonged to it
    detections: int = 1
    score: float = 0.0

    def detected(self, time: float, log_density: float) -> None:
        """A detection belongs to it, of that log of density under its belief [1/m^2]."""
        self.seen, self.detections = time, self.detections + 1
        self.score = min(self.score + log(DETECTED / CLUTTER) + log_density, SUREST)

    def missed(self, detectable: float) -> None:
        """No detection of a scan belongs to it."""
        self.score += log1p(-detectable)

    @property
    def confirmed(self) -> bool:
        """Whether it counts as a body."""
        return self.detections >= CONFIRMED

    def over(self, time: float, spread: float) -> bool:
        """Whether it ends at `time` [s], `spread` [m] being the largest std of its position."""
        return self.score < DEAD or spread > SPREAD or time - self.seen > COASTING
