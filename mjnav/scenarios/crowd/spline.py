"""Tracks between their frames: a cubic spline through every recorded position.

Each piece is p(t) = c0 (t - t_k)^3 + c1 (t - t_k)^2 + c2 (t - t_k) + c3 on [t_k, t_k+1], with continuous velocity and
acceleration ("not a knot" at both ends; de Boor, A Practical Guide to Splines, 1978). Two positions give a line.
"""

from collections.abc import Sequence

import numpy as np

from mjnav.messages import Array

_ROUNDING = 1e-9  # [s] of clocks that count steps


class TrackSplines:
    """The splines of n tracks, evaluated together; before its first and after its last frame a person stands there."""

    def __init__(self, tracks: Sequence[Array]):
        """Each track (k, 3): time [s], strictly ascending, x and y [m]; k is at least 2."""
        from scipy.interpolate import CubicSpline

        splines = [CubicSpline(track[:, 0], track[:, 1:]) for track in tracks]
        self._first = np.array([track[0, 0] for track in tracks])  # (n,)
        self._last = np.array([track[-1, 0] for track in tracks])
        pieces = [len(track) - 1 for track in tracks]
        self._ends = np.cumsum(pieces) - 1  # (n,) last piece of each
        self._starts = self._ends - np.array(pieces, int) + 1
        self._knots = np.concatenate([track[:-1, 0] for track in tracks])  # (K,) where each piece starts
        self._coefficients = np.concatenate([spline.c.transpose(1, 0, 2) for spline in splines])  # (K, 4, 2)
        # One sorted array finds the piece of every person at once: each has a stretch of time of their own.
        span = float(self._last.max() - self._first.min()) + 1.0
        self._shift = span * np.arange(len(tracks))
        self._shifted = self._knots + np.repeat(self._shift, pieces)

    def positions(self, time: float) -> Array:
        """Where all are at `time` [s]: (n, 2) [m]."""
        return self._evaluated(np.clip(time, self._first, self._last))

    def velocities(self, time: float, duration: float, ahead: float = 0.0) -> Array:
        """Mean velocities, (n, 2) [m/s], over `duration` [s] from `ahead` [s] after `time` on; 0 outside of a track.

        Within `ahead` and `duration` of its end a track goes on as its last piece does.
        """
        begin = np.clip(time, self._first, self._last) + ahead
        mean = (self._evaluated(begin + duration) - self._evaluated(begin)) / duration
        return np.where(((time > self._first - _ROUNDING) & (time < self._last))[:, None], mean, 0.0)

    def _evaluated(self, times: Array) -> Array:
        """At a time (n,) for each track, with the nearest piece beyond its ends: (n, 2)."""
        piece = np.searchsorted(self._shifted, times + self._shift, side="right") - 1
        piece = np.clip(piece, self._starts, self._ends)
        c, h = self._coefficients[piece], (times - self._knots[piece])[:, None]
        return ((c[:, 0] * h + c[:, 1]) * h + c[:, 2]) * h + c[:, 3]
