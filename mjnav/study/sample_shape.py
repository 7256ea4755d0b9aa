"""How far the controller's samples are from Gaussian, and what share of them its decisions avoid."""

from math import nan, sqrt

import numpy as np

from mjnav.messages import Array, TickRecord
from mjnav.metrics.consistency import skew_and_kurtosis


class SampleShape:
    """Watches a run: skew and kurtosis of the samples' x and y, means over ticks, axes and people.

    With the moments' g1 and g2 + 3 of n samples, these are the estimates that are unbiased for Gaussians of any n:

        G1 = sqrt(n (n - 1)) / (n - 2) g1,   G2 = (n - 1) / ((n - 2) (n - 3)) ((n + 1) g2 + 6),   kurtosis G2 + 3.

    Of few samples of a heavy tail both are too small. Source: Joanes & Gill, The Statistician 47 (1998) 183.

    Also the share of the closest obstacle's samples that the chosen control avoids, where the run computes `cones`.
    """

    def __init__(self):
        self._robot: list[Array] = []  # (N, 2) each
        self._people: list[Array] = []
        self._safe_shares: list[float] = []

    def __call__(self, record: TickRecord) -> None:
        """One more tick."""
        observation = record.seen
        self._robot.append(observation.robot_pose[:, :2])
        self._people += [person.position for person in observation.obstacles[: len(record.tracks)]]
        if record.cone is not None:
            self._safe_shares.append(record.cone.safe_share)

    def figures(self) -> dict[str, float | None]:
        """The figures by column of a row; None where all samples are equal, or too few."""
        shares = self._safe_shares
        found: dict[str, float | None] = {
            "min_safe_share": min(shares, default=None),
            "mean_safe_share": sum(shares) / len(shares) if shares else None,
        }
        for name, samples in (("robot", self._robot), ("people", self._people)):
            skew, kurtosis = _unbiased(np.stack(samples, axis=1)) if samples else (nan, nan)
            found[f"{name}_skew"] = skew if np.isfinite(skew) else None
            found[f"{name}_kurtosis"] = kurtosis if np.isfinite(kurtosis) else None
        return found


def _unbiased(samples: Array) -> tuple[float, float]:
    """Means of G1 and G2 + 3 over the columns of (n, ...) that are not constant; NaN where all are."""
    n = len(samples)
    g1, kurtosis = skew_and_kurtosis(samples)
    usable = np.isfinite(g1) & np.isfinite(kurtosis)
    if n < 4 or not usable.any():
        return nan, nan
    g2 = kurtosis[usable].mean() - 3.0
    skew = sqrt(n * (n - 1)) / (n - 2) * g1[usable].mean()
    return float(skew), float((n - 1) / ((n - 2) * (n - 3)) * ((n + 1) * g2 + 6.0) + 3.0)
