"""How many particles a belief needs: as many as its spread asks for.

D. Fox, "Adapting the sample size in particle filters through KLD-sampling" (International Journal of Robotics Research,
2003): with n draws from a distribution over k bins, the Kullback-Leibler distance between the draws' shares and the
distribution stays below epsilon with probability 1 - delta for n = X / (2 epsilon), X the 1 - delta quantile of
chi-square with k - 1 degrees of freedom.
"""

from math import ceil, sqrt

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Matrix

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
