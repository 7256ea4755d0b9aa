import numpy as np
import pytest

from mjnav.estimation.kalman import ExtendedPoseFilter, UnscentedPoseFilter
from mjnav.estimation.lidar.kalman import DelayedPose, Motion

DENSITY = np.diag([0.03, 0.05]) ** 2 * 0.1
TWISTS = [np.array(twist) for twist in ([0.8, 0.4], [0.9, -1.0], [0.2, 0.7])]
START, SPREAD = np.array([1.0, 2.0, 3.0]), np.diag([0.1, 0.1, 0.05]) ** 2
MEASURED, NOISE = np.array([0.87, 2.05, 3.05]), np.diag([0.02, 0.03, 0.01]) ** 2


@pytest.mark.parametrize("kind", [ExtendedPoseFilter, UnscentedPoseFilter])
def test_a_late_measurement_counts_as_if_it_had_come_in_time(kind):
    delayed, timely = DelayedPose(kind, kept=1.0), kind()
    delayed.past.start(START, SPREAD)
    timely.start(START, SPREAD)
    for k, twist in enumerate(TWISTS):
        delayed.move(Motion(0.1 * k, 0.1 * (k + 1), twist, DENSITY))
    assert delayed.go_to(0.14)
    delayed.past.correct(MEASURED, NOISE)

    for begin, end, twist in ((0.0, 0.1, 0), (0.1, 0.14, 1), (0.14, 0.2, 1), (0.2, 0.3, 2)):
        timely.predict(TWISTS[twist], DENSITY / (end - begin), end - begin)
        if end == 0.14:
            timely.correct(MEASURED, NOISE)
    assert delayed.now.mean == pytest.approx(timely.mean, abs=1e-9)
    assert delayed.now.covariance == pytest.approx(timely.covariance, abs=1e-9)


def test_it_does_not_go_back_and_does_not_wait_for_ever():
    pose = DelayedPose(ExtendedPoseFilter, kept=0.25)
    pose.past.start(START, SPREAD)
    for k, twist in enumerate(TWISTS * 2):
        pose.move(Motion(0.1 * k, 0.1 * (k + 1), twist, DENSITY))
    before = pose.now.mean
    # The past has followed to 0.35 s, 0.25 s behind.
    assert not pose.go_to(0.3)
    assert pose.go_to(0.4)
    assert not pose.go_to(0.4)
    assert pose.now.mean == pytest.approx(before, abs=1e-12)
