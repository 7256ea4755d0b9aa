import numpy as np
import pytest
from scipy import stats

from mjnav.robot.estimation.direct import DirectLocalizer, DirectTracker


def test_pose_samples_have_the_skew_of_the_noise_the_other_way_round(drive, pearson):
    (reading,), _ = drive(pearson, 0, ticks=1)
    belief = DirectLocalizer(pearson, 50_000, 0).update(reading)
    for column, (channel, skew) in enumerate((("pose.x", 1.2), ("pose.y", 1.2), ("pose.theta", 0.8))):
        assert stats.skew(belief.particles[:, column]) == pytest.approx(-skew, abs=0.2)
        assert belief.particles[:, column].std() == pytest.approx(pearson[channel].std, rel=0.03)
    assert belief.mean == pytest.approx(reading.pose, abs=0.003)
    assert belief.ess == pytest.approx(50_000)


def test_the_truth_lies_within_direct_samples_as_one_of_them(drive, pearson):
    ranks = []
    for seed in range(300):
        (reading,), truth = drive(pearson, seed, ticks=1)
        ranks.append(np.mean(DirectLocalizer(pearson, 400, seed).update(reading).particles[:, 0] < truth[0, 0]))
    assert stats.kstest(ranks, "uniform").pvalue > 1e-3


def test_before_a_second_detection_the_velocity_is_the_prior(drive, pearson):
    (reading,), _ = drive(pearson, 2, ticks=1, people=[(1.0, 2.0, 1.0, 0.0)])
    (track,) = DirectTracker(pearson, 20_000, [0.3], 2).update(reading)
    assert track.mean[2:] == pytest.approx([0.0, 0.0], abs=0.03)
    assert track.covariance[2:, 2:] == pytest.approx(np.eye(2), abs=0.05)


def test_after_a_window_the_velocity_is_the_least_squares_slope_with_its_variance(drive, pearson):
    readings, _ = drive(pearson, 3, ticks=31, people=[(1.0, 2.0, 1.0, -0.5)])
    tracker = DirectTracker(pearson, 20_000, [0.3], 3)
    for reading in readings:
        (track,) = tracker.update(reading)
    times = np.array([reading.time for reading in readings[-11:]])
    slope = np.polyfit(times, np.array([reading.detections[0] for reading in readings[-11:]]), 1)[0]
    assert track.mean[2:] == pytest.approx(slope, abs=0.03)  # the prior weighs 1 %
    deviation = np.sum((times - times.mean()) ** 2)
    assert track.covariance[2, 2] == pytest.approx(pearson["detection.x"].std ** 2 / deviation, rel=0.1)
