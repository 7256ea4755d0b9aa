"""Whether the robot is where it believes to be: augmented recovery, on trial before it takes the belief's place.

w_fast and w_slow follow the mean likelihood of a scan under the belief (Thrun, Burgard & Fox 2005, table 8.3). Where
the fast one falls behind the slow one, or is so low that no pose explains the scan, or where beams go through what the
map has (`contradictions.py`), poses that fit the scan are looked for all over the floor (`floor_search.py`).

The book mixes random poses into the belief at once. Among people that is not safe: a scan that shows mostly people fits
somewhere by chance, and better than where the robot is. So the poses found are a second belief, the rival, which moves
with the robot. It takes over when its evidence over the next scans outweighs that of the belief: people move on, walls
do not. That goes quickly only where beams went through what the map has at the belief's poses: no crowd explains that.
"""

import numpy as np

from mjnav.estimation.lidar.cloud import TEMPER, Cloud
from mjnav.estimation.lidar.contradictions import contradictions, ways_of
from mjnav.estimation.lidar.floor_search import FOUND, FloorSearch
from mjnav.estimation.lidar.likelihood_field import Beams, LikelihoodField
from mjnav.estimation.lidar.twist import Twist, TwistSensors
from mjnav.messages import Array
from mjnav.rng import stream

SLOW, FAST = 0.02, 0.3  # rates of w_slow and w_fast, a scan
BEHIND = 0.5  # share of w_slow by which w_fast is less where the search begins
LOST = 3.0  # w_fast below which no pose explains the scan: mean ratio of a return's density to that without a map
PATIENCE, MOST_PATIENCE = 3, 40  # scans between two searches; twice as many after each that has found nothing better
# Log of the odds that one scan adds at most, so that no single scan decides. Returns from before the surfaces may be
# people; beams that went through surfaces refute a pose, where they are more than a share of all and the others are not
# explained either: the map may have what is not there.
MOST_ODDS, REFUTED_ODDS, REFUTED = 0.07, 1.0, 0.1
TAKES_OVER, GIVES_UP = 4.0, -2.0  # log of the odds
YOUNG, TRIALS = 60, (3, 8, 16, 32)  # scans after a search in which its result is on trial; then others are looked for
TRIAL = 70  # scans after which a rival that has not taken over is dropped
COMPARED, WATCHED = 100, 10  # particles of a belief that are followed along the beams, beside a rival and always


class Recovery:
    """Watches a belief, and keeps the rival while there is one."""

    def __init__(self, field: LikelihoodField, search: FloorSearch, twists: TwistSensors, seed: int):
        self._field, self._search, self._twists, self._seed = field, search, twists, seed
        self._searching = stream(seed, "estimation.search")
        self._slow = self._fast = 0.0  # 0 before the first scan
        self._refuted = 0.0  # share of beams that went through surfaces, followed as w_fast
        self._age = YOUNG + 1  # scans since the belief came from a search; more than that where it did not
        self._since, self._patience = 0, PATIENCE  # scans since the last search, and until the next one
        self._rival: Cloud | None = None
        self._odds = 0.0  # log of those of the rival
        self._num_rivals = 0

    def predict(self, twist: Twist) -> None:
        """Moves the rival with the robot."""
        if self._rival is not None:
            self._rival.predict(twist)

    def rival(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> Array | None:
        """Poses (FOUND, 3) that take the belief's place, or None. `fit` (n,) is that of the belief's particles.

        The belief is the one before the correction by this scan.
        """
        self._since, self._age = self._since + 1, self._age + 1
        doubtful = self._doubts(points, beams, belief, fit)
        if self._rival is None:
            if (doubtful and self._since >= self._patience) or self._age in TRIALS:
                self._begin(points)
            elif not doubtful:
                self._patience = PATIENCE
            return None
        self._compare(points, beams, belief, fit)
        if self._odds >= TAKES_OVER:
            self.restart()
            return self._end()
        if self._odds <= GIVES_UP or self._since > TRIAL:
            self._patience = min(2 * self._patience, MOST_PATIENCE)
            self._end()
        return None

    def restart(self) -> None:
        """The belief is new, from a search: others that fit nearly as well are tried beside it for a while."""
        self._slow, self._age = 0.0, 0

    def _doubts(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> bool:
        """Whether the scans of late are not what the belief lets one expect."""
        quality = float(belief.weights @ np.exp(fit / beams.num))
        few = slice(None, None, max(len(belief.particles) // WATCHED, 1))
        weights = belief.weights[few]
        _, shares = contradictions(belief.particles[few], ways_of(points, self._field, beams.num), self._field)
        refuted = float(weights @ shares / weights.sum())
        if self._slow == 0.0:
            self._slow = self._fast = quality
            self._refuted = refuted
        self._slow += SLOW * (quality - self._slow)
        self._fast += FAST * (quality - self._fast)
        self._refuted += FAST * (refuted - self._refuted)
        return self._fast < self._least or self._refuted > REFUTED

    @property
    def _least(self) -> float:
        """Below it w_fast says that the scans are explained no more."""
        return max((1.0 - BEHIND) * self._slow, LOST)

    def _begin(self, points: Array) -> None:
        found = self._search.found(points, self._searching)
        self._rival = Cloud(found, self._twists, self._seed, f"estimation.rival{self._num_rivals}")
        self._num_rivals += 1
        self._odds, self._since = 0.0, 0

    def _end(self) -> Array | None:
        found, self._rival, self._since = self._rival, None, 0
        return None if found is None else found.particles

    def _compare(self, points: Array, beams: Beams, belief: Cloud, fit: Array) -> None:
        """Adds what one scan says to the odds."""
        rival = self._rival
        assert rival is not None
        ways = ways_of(points, self._field, beams.num)
        own = self._field.log_ratio(rival.particles, beams)
        own += contradictions(rival.particles, ways, self._field)[0]
        step = max(len(belief.particles) // COMPARED, 1)
        against, shares = contradictions(belief.particles[::step], ways, self._field)
        against, weights = TEMPER * (fit[::step] + against), belief.weights[::step]
        highest = float(against.max())
        evidence = rival.correct(own) - highest - float(np.log(weights @ np.exp(against - highest) / weights.sum()))
        refuted = weights @ shares > REFUTED * weights.sum() and self._fast < self._least
        most = REFUTED_ODDS if refuted or self._age <= YOUNG else MOST_ODDS
        self._odds += float(np.clip(evidence, -1.0, most))
        _, covariance, size = rival.moments()
        rival.resample(covariance, size, FOUND)
