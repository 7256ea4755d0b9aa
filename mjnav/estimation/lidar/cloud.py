"""Weighted particles of a pose: moved by twists, weighed by scans, resampled; their number follows the belief's spread.

The number is that of D. Fox, "Adapting the sample size in particle filters through KLD-sampling" (International Journal
of Robotics Research, 2003): with n draws from a distribution over k bins, the Kullback-Leibler distance between the
draws' shares and the distribution stays below epsilon with probability 1 - delta for n = X / (2 epsilon), X the
1 - delta quantile of chi-square with k - 1 degrees of freedom.
"""

from math import ceil, sqrt

import numpy as np

from mjnav.estimation.base import HEADING
from mjnav.estimation.lidar.scan import TWIST_CHANNELS, Twist, TwistSensors
from mjnav.filters.particles import ess, resample, weighted_moments
from mjnav.geometry.angles import wrap
from mjnav.geometry.compiled import Matrix, exact
from mjnav.messages import Array
from mjnav.motion.unicycle import integrate_rows
from mjnav.rng import stream

# ------------------------------------------------------------------------------ number of particles


EPSILON = 0.05  # of the distance, Fox's own
QUANTILE = 2.3263478740408408  # z of 1 - delta for delta = 0.01
BIN = (0.05, 0.05, 0.05)  # [m], [m], [rad]: the width of a bin


def kld_bound(num_bins: int, epsilon: float = EPSILON, quantile: float = QUANTILE) -> int:
    """The number of particles for `num_bins` occupied bins, by Wilson and Hilferty's chi-square quantile (eq. 7).

    n = (k - 1)/(2 epsilon) (1 - 2/(9 (k - 1)) + sqrt(2/(9 (k - 1))) z)^3; 1 for a single bin.
    """
    if num_bins <= 1:
        return 1
    share = 2.0 / (9.0 * (num_bins - 1.0))
    return ceil((num_bins - 1.0) / (2.0 * epsilon) * (1.0 - share + sqrt(share) * quantile) ** 3)


@exact
def occupied_bins(particles: Matrix, width: tuple[float, float, float]):
    """The number of bins of a regular grid that hold at least one of the poses (n, 3)."""
    codes = np.empty(len(particles), np.int64)
    for i in range(len(particles)):
        code = 0
        for axis in range(3):  # 21 bits each: a million bins to either side
            code = code * 2097152 + np.int64(np.floor(particles[i, axis] / width[axis])) + 1048576
        codes[i] = code
    codes.sort()
    count = 1 if len(codes) else 0
    for i in range(1, len(codes)):
        count += codes[i] != codes[i - 1]
    return count


# ------------------------------------------------------------------------------- weighted particles


RESAMPLE_BELOW = 0.5  # share of the particles, as effective sample size
ROUGHENING = 1.5  # K of `filters.particles.roughen`
JITTER = (0.05, 0.05, 0.05)  # [m], [m], [rad]: std that roughening takes a wider spread for: modes stay apart
SLIP_EVERY = 8  # particles one is moved by what wheels and gyro do not see: slipping, being pushed
SLIP_STD = (0.05, 0.05, 0.03)  # [m], [m], [rad] of that, in each scan
LEAST_ESS = 0.05  # share of the particles that one scan leaves at least, as effective sample size
TEMPER = 0.75  # t, the weight of a scan's likelihood; see `localizer.py`
FEWEST = 200  # particles, whatever the bound on the Kullback-Leibler distance says
COUNTED = 0.1  # of the mean weight: particles below do not count among those whose spread asks for particles
BISECTIONS = 12


class Cloud:
    """Particles (n, 3) and their weights (n,)."""

    def __init__(self, particles: Array, twists: TwistSensors, seed: int, purpose: str):
        """Equally weighted particles; the draws are from streams of `purpose`."""
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self._twists = twists
        self._motion = {channel: stream(seed, f"{purpose}.motion.{channel}") for channel in TWIST_CHANNELS}
        self._resampling = stream(seed, f"{purpose}.resampling")
        self._roughening = stream(seed, f"{purpose}.roughening")
        self._slipping = stream(seed, f"{purpose}.slip")
        self._turning = stream(seed, f"{purpose}.turn")
        self._blind = (0, 0)  # intervals since v and omega were measured, or a scan corrected

    def predict(self, twist: Twist) -> None:
        """Moves each particle by a draw of the twist."""
        v, omega = self._twists.sample(twist, len(self.particles), self._motion, self._blind)
        self.particles = integrate_rows(self.particles, v, omega, twist.interval)
        known = (twist.knows_v, twist.knows_omega)
        self._blind = (0 if known[0] else self._blind[0] + 1, 0 if known[1] else self._blind[1] + 1)

    def slip(self) -> None:
        """Moves every few of the particles as if the wheels had slipped: before a scan, which says whether they had."""
        moved = self.particles.copy()
        slipped = moved[::SLIP_EVERY]
        slipped += self._slipping.standard_normal(slipped.shape) * SLIP_STD
        slipped[:, HEADING] = wrap(slipped[:, HEADING])
        self.particles = moved

    def correct(self, fit: Array) -> float:
        """Weighs by log-likelihoods (n,) of a scan; the log of their mean over the belief, exp(t fit) each."""
        prior, weighted = self.weights, TEMPER * fit
        self.weights = tempered(weighted, LEAST_ESS, prior)
        self._blind = (0, 0)
        highest = float(weighted.max())
        return highest + float(np.log(prior @ np.exp(weighted - highest)))

    def blur(self, lag: float, twist: Twist) -> None:
        """Spreads the particles by what wheels and gyro may have missed in the `lag` [s] since a scan's beams.

        The scan says where the robot was when its beams were taken. Its points were carried on to the reading by the
        twists, whose errors, independent from interval to interval, are std sqrt(lag interval) each by then.
        """
        far, turned = self._turning.standard_normal((2, len(self.particles))) * sqrt(lag * twist.interval)
        moved = self.particles.copy()
        moved[:, 0] += twist.std[0] * far * np.cos(moved[:, HEADING])
        moved[:, 1] += twist.std[0] * far * np.sin(moved[:, HEADING])
        moved[:, HEADING] = wrap(moved[:, HEADING] + twist.std[1] * turned)
        self.particles = moved

    def moments(self) -> tuple[Array, Array, float]:
        """Mean (3,), covariance (3, 3) and effective sample size."""
        (mean,), (covariance,) = weighted_moments(self.particles[None], self.weights[None], HEADING)
        return mean, covariance, float(ess(self.weights[None])[0])

    def resample(self, covariance: Array, size: float, most: int) -> None:
        """Draws by the weights as many as the spread asks for, at most `most`; nothing where all is well.

        Leaves the arrays as they are and makes new ones: they may be part of a belief.
        """
        present = len(self.particles)
        offset = self._resampling.random()
        counted = self.particles[self.weights * present > COUNTED]
        num = max(min(kld_bound(occupied_bins(counted, BIN)), most), min(FEWEST, most))
        if size >= RESAMPLE_BELOW * present and present <= most and num <= 1.5 * present:
            return
        capped = np.diag(np.minimum(np.diagonal(covariance), np.square(JITTER)))
        normal = self._roughening.standard_normal((num, 3))
        self.particles = resample(self.particles, self.weights, offset, capped, ROUGHENING, normal)
        self.particles[:, HEADING] = wrap(self.particles[:, HEADING])
        self.weights = np.full(num, 1.0 / num)


def tempered(log_likelihood: Array, least: float, prior: Array | None = None) -> Array:
    """Weights prior_i exp(t l_i) / sum, (n,), with the largest t <= 1 that leaves an ESS of `least` n.

    Where the prior's own ESS is less than twice that, it leaves half of it. The prior is uniform by default.
    """
    num = len(log_likelihood)
    prior = np.full(num, 1.0 / num) if prior is None else prior
    shifted = np.minimum(log_likelihood - log_likelihood[prior > 0.0].max(), 0.0)
    target = min(least * num, 0.5 / float(prior @ prior))

    def at(exponent: float) -> Array:
        weights = prior * np.exp(exponent * shifted)
        return weights / weights.sum()

    weights, low, high = at(1.0), 0.0, 1.0
    if weights @ weights * target <= 1.0:
        return weights
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        weights = at(middle)
        low, high = (middle, high) if weights @ weights * target <= 1.0 else (low, middle)
    return at(low)
