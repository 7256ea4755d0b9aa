import numpy as np
import pytest

from mjnav.noise import CHANNELS, profile, profile_names

# mean, std, skew, kurtosis
PEARSON = {
    "odometry.v": (0.0, 0.03, -2.0, 8.4),
    "odometry.omega": (0.0, 0.07, 1.1, 14.0),
    "actuation.v": (0.0, 0.05, 1.5, 6.4),
    "actuation.omega": (0.0, 0.08, -1.0, 5.0),
    "pose.x": (0.0, 0.08, 1.2, 5.2),
    "pose.y": (0.0, 0.08, 1.2, 5.2),
    "pose.theta": (0.0, 0.05, 0.8, 5.0),
    "detection.x": (0.0, 0.12, 1.2, 5.2),
    "detection.y": (0.0, 0.12, 1.2, 5.2),
    "lidar.range": (0.0, 0.03, -1.2, 4.8),
    "gyro": (0.0, 0.02, 0.5, 4.0),
    "lane.offset": (0.0, 0.08, 1.2, 5.2),
}
MEASURED = {
    "odometry.v": (-0.006, 0.016, -1.99, 8.4),
    "odometry.omega": (0.0, 0.071, 1.09, 14.3),
    "actuation.v": (0.006, 0.016, 1.99, 8.4),
    "actuation.omega": (0.0, 0.071, -1.09, 14.3),
    "lidar.range": (-0.035, 0.174, -1.2, 4.8),
    "detection.x": (0.0, 0.174, -1.2, 4.8),
    "detection.y": (0.0, 0.174, -1.2, 4.8),
    "pose.theta": (-0.002, 0.014, -0.49, 7.7),
    "pose.x": (0.0, 0.08, -1.2, 4.8),
    "pose.y": (0.0, 0.08, -1.2, 4.8),
    "lane.offset": (0.0, 0.08, -1.2, 4.8),
    "gyro": (0.0, 0.02, -0.49, 7.7),
}
TABLE = {**PEARSON, "pose.theta": (0.0, 0.2, 0.8, 5.0)}
GAUSSIAN = {channel: (*moments[:2], 0.0, 3.0) for channel, moments in PEARSON.items()}


def test_every_profile_has_every_channel():
    expected = {"none", "gaussian", "pearson", "bimodal", "measured", "pearson-mirrored", "bimodal-mirrored", "table"}
    assert set(profile_names()) == expected
    for name in profile_names():
        assert set(profile(name)) == set(CHANNELS)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize(
    ("name", "table"), [("gaussian", GAUSSIAN), ("pearson", PEARSON), ("measured", MEASURED), ("table", TABLE)]
)
def test_channel_has_the_moments_of_its_table(quadrature, name, table, channel):
    mean, std, skew, kurtosis = quadrature(profile(name)[channel]).moments()
    assert mean == pytest.approx(table[channel][0], abs=1e-7)
    assert (std, skew, kurtosis) == pytest.approx(table[channel][1:], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("name", ["pearson", "bimodal"])
def test_a_mirrored_profile_has_the_densities_of_the_other_side(name, channel):
    x = np.linspace(-0.5, 0.5, 101)
    there, mirrored = profile(name)[channel], profile(f"{name}-mirrored")[channel]
    np.testing.assert_allclose(mirrored.logpdf(x), there.logpdf(-x), rtol=1e-9)
    assert (mirrored.mean, mirrored.std) == pytest.approx((-there.mean, there.std), abs=1e-12)
