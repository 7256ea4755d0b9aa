"""Kernel herding: few of many samples, chosen so that their embedding is close to that of all.

Of N samples with the Gram matrix K, one after another is chosen,

    i_{t+1} = argmax_{i not chosen}  (1/N) sum_j K_ij  -  1/(t+1) sum_{j chosen} K_ij,

near to all and far from what is chosen already. As every K_ii is the same, each choice is the one after which the
chosen, of equal weights, have the least MMD from all N (Chen, Welling & Smola 2010, "Super-Samples from Kernel
Herding"; there a sample may be chosen again, here not, as each is to stand for a distinct future). Then chosen samples
are exchanged against others, in turn, as long as one exchange makes the MMD smaller and at most `rounds` times for
each: herding's first choices were made without knowledge of its last.
"""

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.geometry.compiled import Flags, Indices, Matrix, Vector, kernel
from mjnav.messages import Array
from mjnav.rkhs.joint_gram import joint_gram


def herded(samples: Array, num: int, *, bandwidth: float = 1.0, rounds: int = 1) -> Indices:
    """Which `num` of the joint samples (N, D) stand for all of them: different indices, ascending, (num,).

    Coordinates may have any units, and `bandwidth` is a multiple of the median distance, as in `joint_gram`. The same
    samples give the same indices; of equal choices the first is taken. Raises InvalidValue unless 1 <= num <= N.
    """
    if not 1 <= num <= len(samples):
        raise InvalidValue("num", num, f"a whole number from 1 to {len(samples)}, the number of samples")
    gram = joint_gram(samples, bandwidth)
    chosen, taken, near = np.empty(num, np.int64), np.zeros(len(gram), np.bool_), np.zeros(len(gram))
    mean = gram.mean(axis=1)
    _herd(chosen, taken, near, gram, mean)
    _exchange(chosen, taken, near, gram, mean, rounds)
    return np.sort(chosen)


@kernel
def _herd(chosen: Indices, taken: Flags, near: Vector, gram: Matrix, mean: Vector):
    """`near` ends as sum_{j chosen} K_ij of every i."""
    for t in range(chosen.size):
        best, most = -1, -np.inf
        for i in range(mean.size):
            gain = mean[i] - near[i] / (t + 1)
            if not taken[i] and gain > most:
                best, most = i, gain
        chosen[t], taken[best] = best, True
        for i in range(mean.size):
            near[i] += gram[best, i]


@kernel
def _exchange(chosen: Indices, taken: Flags, near: Vector, gram: Matrix, mean: Vector, rounds: int):
    """Each chosen sample in turn is given back, and the best one is chosen in its place."""
    num = chosen.size
    for _ in range(rounds):
        changed = False
        for t in range(num):
            old = chosen[t]
            best, most = old, mean[old] - (near[old] - gram[old, old]) / num + 1e-12
            for i in range(mean.size):
                gain = mean[i] - (near[i] - gram[old, i]) / num
                if not taken[i] and gain > most:
                    best, most = i, gain
            if best != old:
                chosen[t], taken[old], taken[best], changed = best, False, True, True
                for i in range(mean.size):
                    near[i] += gram[best, i] - gram[old, i]
        if not changed:
            return
