"""Global localization by scans: detects that the robot's pose is lost, and searches the free floor for poses that fit.

The search serves a start anywhere and a robot that was carried away. Poses drawn evenly over the floor are too far
apart for a likelihood that is a few centimetres wide: none of them would fit. So the likelihood is first taken as wide
as the poses are apart, and narrowed level by level while the best poses are drawn again and spread a little less each
time (annealed importance sampling: Neal 2001). Poses that fit equally well in different places stay side by side.

The particle filter uses augmented recovery: w_fast and w_slow follow the mean likelihood of a scan under the belief
(Thrun, Burgard & Fox 2005, table 8.3). Where the fast one falls behind the slow one, or is so low that no pose explains
the scan, or where beams go through what the map has (`likelihood_field.py`), poses that fit the scan are looked for all
over the floor.

The book mixes random poses into the belief at once. Among people that is not safe: a scan that shows mostly people fits
somewhere by chance, and better than where the robot is. So the poses of the search are a second belief, the rival,
which moves with the robot. It takes over when its evidence over the next scans outweighs that of the belief: people
move on, walls do not. That goes quickly only where beams went through what the map has at the belief's poses: no crowd
explains that.

A Kalman filter has one Gaussian, so it cannot wait and see which of several places is the robot's. It counts the scans
that make it doubt, and takes the place of the whole floor that fits a scan best. That place is on trial: after some
scans, from where other things are in view, the floor is searched again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.constant import Constant
from mjnav.estimation.lidar.cloud import TEMPER, Cloud, tempered
from mjnav.estimation.lidar.likelihood_field import Beams, LikelihoodField, contradictions, ways_of
from mjnav.estimation.lidar.scan import Twist, TwistSensors
from mjnav.estimation.lidar.scan_matching import MatchSettings, ScanMatch, match_scan, reach_of
from mjnav.filters.particles import systematic
from mjnav.geometry.angles import wrap
from mjnav.geometry.floor import Floor, FreeSpace
from mjnav.messages import Array
from mjnav.rng import stream

# ------------------------------------------------------------------------------ search of the floor


PER_AREA = 80.0  # [1/m^2] poses drawn first
MOST = 20_000  # poses drawn first, on large floors
KEPT = 1000  # poses of each further level
FOUND = 300  # poses that come out


@dataclass(frozen=True, slots=True)
class Level(Constant):
    """One level of the search."""

    spread: float  # [m] by which the likelihood is widened
    num_beams: int
    shift: float  # [m] std by which poses are spread for the next level
    turn: float  # [rad]
    temper: float = 1.0  # of the likelihood; the last level leaves modes as a scan of the filter does


LEVELS = (
    Level(0.3, 24, 0.15, 0.1),
    Level(0.12, 40, 0.06, 0.04, 0.5),
    Level(0.04, 60, 0.02, 0.012, 0.2),
    Level(0.02, 60, 0.01, 0.006, TEMPER),
)
KEEPS = 0.1  # of a level's poses, as effective sample size, whatever the likelihood says: so that no mode dies at once


@dataclass(frozen=True, slots=True)
class FloorSearch(Constant):
    """The free floor of a map, from which poses are drawn."""

    field: LikelihoodField
    places: Array  # (k, 2) [m] centres of the cells in which the robot may be
    cell: float  # [m]

    @classmethod
    def of(cls, field: LikelihoodField, floor: Floor, radius: float, route: Array) -> "FloorSearch":
        """The part of a floor on which a robot with this radius [m] can come to the points of its `route` (k, 2).

        All of the free floor where the map has no free place at the goal.
        """
        space = FreeSpace.of(floor, route)
        parts = space.parts(radius)
        goal = space.part_of(route[-1:], radius)[0]
        rows, columns = np.nonzero(parts == goal if goal > 0 else space.clearance >= radius)
        places = space.low + space.cell * np.column_stack([columns, rows])
        return cls(field, np.asarray(places, float), space.cell)

    def uniform(self, num: int, rng: np.random.Generator) -> Array:
        """Poses spread evenly over the floor and all headings, (num, 3)."""
        chosen = self.places[rng.integers(len(self.places), size=num)]
        chosen = chosen + self.cell * (rng.random((num, 2)) - 0.5)
        return np.column_stack([chosen, np.pi * (1.0 - 2.0 * rng.random(num))])

    def found(self, points: Array, rng: np.random.Generator) -> Array:
        """Poses at which a scan fits best, (FOUND, 3); `points` as `scan_points` gives them."""
        area = len(self.places) * self.cell**2
        poses = self.uniform(int(min(max(PER_AREA * area, KEPT), MOST)), rng)
        for level in LEVELS:
            fit = self.field.log_ratio(poses, self.field.beams(points, level.num_beams, level.spread))
            if level is LEVELS[-1]:
                fit += contradictions(poses, ways_of(points, self.field, level.num_beams), self.field)[0]
            num = FOUND if level is LEVELS[-1] else KEPT
            poses = poses[systematic(tempered(level.temper * fit, KEEPS), rng.random(), num)]
            poses = poses + rng.standard_normal(poses.shape) * (level.shift, level.shift, level.turn)
            poses[:, 2] = wrap(poses[:, 2])
        return poses


# ------------------------------------------------------------------ recovery of the particle filter


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


# ----------------------------------------------------------------- relocation of the Kalman filters


NUM_MATCHED = 20  # poses of a search
PLACE_TRIALS = (3, 6, 12, 24, 48)  # scans after the start at a place that was found


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
        self._since = PLACE_TRIALS[-1]  # scans since the start at a place that was found
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
        if self._since in PLACE_TRIALS:
            found, ratio = self._best(points, std, [match])
            return self._start(found) if ratio >= self._doubt.likelier else None
        return None

    def _here(self, match: ScanMatch) -> ScanMatch:
        """The prediction was wrong, as of wheels that slip, or the match is: so it is on trial, if none goes on."""
        self._slips = 0
        if self._since >= PLACE_TRIALS[-1]:
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
