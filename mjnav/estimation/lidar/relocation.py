"""When a Kalman filter by scans doubts where it is, and which place of the whole floor fits a scan best.

A filter of one Gaussian cannot wait and see which of several places it is. So a place that was found by a search is on
trial: after some scans, from where other things are in view, the floor is searched again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.constant import Constant
from mjnav.estimation.lidar.contradictions import contradictions, ways_of
from mjnav.estimation.lidar.floor_search import FOUND, FloorSearch
from mjnav.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.estimation.lidar.scan_matching import MatchSettings, ScanMatch, match_scan, reach_of
from mjnav.messages import Array
from mjnav.rng import stream

NUM_MATCHED = 20  # poses of a search
TRIALS = (3, 6, 12, 24, 48)  # scans after the start at a place that was found


@dataclass(frozen=True, slots=True)
class DoubtSettings(Constant):
    """When to look elsewhere, and what is a better place.

    doubtful   mean weight of a scan's points below which the place may be wrong altogether; 0.6 to 0.8 is common
    patience   doubtful scans in a row before the floor is searched; after a search in vain twice as many
    slips      matches in a row that explain the scan and are not taken, before the filter starts again from one
    better     by which the mean weight is greater at a better place
    likelier   log of the likelihood ratio by which a place is better than one on trial
    """

    doubtful: float = 0.45
    patience: int = 5
    slips: int = 3
    better: float = 0.15
    likelier: float = 6.0


class Relocation:
    """Counts doubts, and searches the floor."""

    def __init__(
        self,
        field: LikelihoodField,
        search: FloorSearch,
        seed: int,
        match: MatchSettings,
        doubt: DoubtSettings | None = None,
    ):
        self._field, self._search, self._match = field, search, match
        self._reach = reach_of(field.lidar, field.noise)
        self._doubt = doubt or DoubtSettings()
        self._doubts, self._patience = 0, self._doubt.patience  # scans in a row; until the next search
        self._slips = 0  # matches in a row that explain the scan and were not taken
        self._since = TRIALS[-1]  # scans since the start at a place that was found
        self._stream = stream(seed, "estimation.search")

    def anywhere(self, points: Array, std: Array) -> ScanMatch:
        """The best place for a scan, as `match_scan` takes it."""
        self._since = 0
        return self._best(points, std, [])[0]

    def elsewhere(self, points: Array, std: Array, match: ScanMatch, taken: bool) -> ScanMatch | None:
        """A place to start again from, if there is one, after a scan that led to a `match`, whether it was `taken`."""
        doubtful = match.explained < self._doubt.doubtful
        self._since += 1
        self._doubts = self._doubts + 1 if doubtful else 0
        self._slips = 0 if taken or doubtful else self._slips + 1
        if self._slips >= self._doubt.slips:
            return self._here(match)
        if not doubtful:
            self._patience = self._doubt.patience
        if self._doubts >= self._patience:
            self._doubts, self._patience = 0, 2 * self._patience
            found, _ = self._best(points, std, [match])
            if found.explained >= match.explained + self._doubt.better:
                return self._start(found)
            return None if taken else self._here(match)
        if self._since in TRIALS:
            found, ratio = self._best(points, std, [match])
            return self._start(found) if ratio >= self._doubt.likelier else None
        return None

    def _here(self, match: ScanMatch) -> ScanMatch:
        """The prediction was wrong, as of wheels that slip, or the match is: so it is on trial, if none goes on."""
        self._slips = 0
        if self._since >= TRIALS[-1]:
            self._since = 0
        return match

    def _start(self, found: ScanMatch) -> ScanMatch:
        self._since, self._patience = 0, self._doubt.patience
        return found

    def _best(self, points: Array, std: Array, others: Sequence[ScanMatch]) -> tuple[ScanMatch, float]:
        """The place that makes a scan the likeliest, of those all over the floor and of others.

        Also the log of the ratio of its likelihood to that of the first of the others.
        """
        guesses = self._search.found(points, self._stream)[:: FOUND // NUM_MATCHED]
        places = (match_scan(self._field.field, points, std, guess, self._match, self._reach) for guess in guesses)
        matches = [*others, *places]
        poses, beams = np.array([match.pose for match in matches]), self._field.beams(points)
        likelihood = self._field.log_ratio(poses, beams)
        likelihood += contradictions(poses, ways_of(points, self._field, beams.num), self._field)[0]
        best = int(np.argmax(likelihood))
        return matches[best], float(likelihood[best] - likelihood[0])
