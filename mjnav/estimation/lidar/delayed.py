"""A Gaussian of the robot's pose whose measurements belong to a moment that has passed.

A lidar takes a turn before it hands it over, and the motion since is known with errors that also moved the prediction.
So the filter stands at the moment of its latest measurement; what is believed now is carried there from it.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mjnav.estimation.pose_filter import PoseFilter
from mjnav.messages import Array

SAME = 1e-9  # [s] below which two moments are one


@dataclass(frozen=True, slots=True)
class Motion:
    """A twist from `begin` to `end` [s], of which any part may be undone.

    Its error is taken for white noise within: the way of a part of length s has the covariance density s.
    """

    begin: float
    end: float
    twist: Array  # (2,) v [m/s], omega [rad/s]
    density: Array  # (2, 2), covariance of the mean twist times the interval

    def move(self, pose: PoseFilter) -> None:
        """Predicts over the whole of it."""
        interval = self.end - self.begin
        pose.predict(self.twist, self.density / interval, interval)

    def split(self, time: float) -> tuple["Motion", "Motion"]:
        """What was before `time` [s] and what came after."""
        return Motion(self.begin, time, self.twist, self.density), Motion(time, self.end, self.twist, self.density)


class DelayedPose:
    """A pose filter at a moment of the past, and the motions since."""

    def __init__(self, make: Callable[[], PoseFilter], kept: float):
        """Measurements may be up to `kept` [s] old."""
        self.past, self._now, self._kept = make(), make(), kept
        self._time = -np.inf  # [s] of the past; before the first motion it is any
        self._since: deque[Motion] = deque()

    def move(self, motion: Motion) -> None:
        """Goes on by a motion that begins where the latest one ended."""
        self._since.append(motion)
        self.go_to(motion.end - self._kept)

    def go_to(self, time: float) -> bool:
        """Takes the past on to `time` [s]; whether it is not there already or beyond."""
        if time <= self._time + SAME:
            return False
        while self._since and self._since[0].begin < time - SAME:
            motion = self._since.popleft()
            if motion.end > time + SAME:
                motion, rest = motion.split(time)
                self._since.appendleft(rest)
            motion.move(self.past)
        self._time = time
        return True

    @property
    def now(self) -> PoseFilter:
        """The past carried on to the end of the latest motion."""
        if not self._since:
            return self.past
        self._now.start(self.past.mean, self.past.covariance)
        for motion in self._since:
            motion.move(self._now)
        return self._now
