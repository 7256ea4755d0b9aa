"""What a lidar makes of exact ranges: errors, mixed pixels, missing returns, limits."""

import numpy as np
import pytest
from scipy import stats

from mjnav.noise import profile
from mjnav.scene.sensors import LidarSpec, Sensors
from mjnav.world.lidar import Returns, footprint

NUM = 10_000
CLEAN = {"mixed": 0.0, "missing": 0.0, "bias": 0.0, "spread": 0.0, "resolution": 0.0}


def measured(ranges, law: str = "pearson", seed: int = 1, **keys) -> np.ndarray:
    """What returns of beams that each meet one surface at `ranges`."""
    lidar = Sensors(lidar=LidarSpec(**{"beams": len(ranges), **keys})).scanner
    returns = Returns(lidar, profile(law)["lidar.range"], seed)
    return returns.measure(np.tile(ranges, (returns.num_rays, 1)))


# Of each lidar the range, half the accuracy and half the precision (or the std) that its maker gives there.
FIGURES = [
    ("lds-01", 0.3, 0.015 / 2, 0.010 / 2),
    ("lds-01", 2.0, 0.05 * 2.0 / 2, 0.035 * 2.0 / 2),
    ("lds-02", 0.25, 0.010 / 2, 0.010 / 2),
    ("lds-02", 4.0, 0.03 * 4.0 / 2, 0.03 * 4.0 / 2),
    ("lds-02", 7.0, 0.05 * 7.0 / 2, 0.05 * 7.0 / 2),
    ("rplidar-a1", 1.0, 0.0, 0.0005 / 2),
    ("rplidar-a1", 6.0, 0.0, 0.01 * 6.0 / 2),
    ("utm-30lx", 5.0, 0.030 / 2, 0.010),
    ("utm-30lx", 15.0, 0.050 / 2, 0.030),
]


@pytest.mark.parametrize(("model", "distance", "bias", "spread"), FIGURES)
def test_errors_have_the_maker_s_size_and_the_profile_s_shape(model, distance, bias, spread):
    lidar = Sensors(lidar=LidarSpec(model)).scanner
    errors = measured(np.full(NUM, distance), model=model, missing=0.0) - distance
    errors = errors[np.isfinite(errors)]
    assert len(errors) > 0.98 * NUM  # an error may lead out of the limits
    assert errors.mean() == pytest.approx(bias, abs=0.05 * spread)
    assert errors.std() == pytest.approx(np.hypot(spread, lidar.resolution / 12**0.5), rel=0.05)
    if spread > 10 * lidar.resolution:
        assert stats.skew(errors) == pytest.approx(-1.2, abs=0.25)
    np.testing.assert_allclose(np.round((errors + distance) / lidar.resolution) * lidar.resolution, errors + distance)


def test_the_share_of_missing_returns_is_that_of_the_range():
    shares = [[1.0, 0.1], [3.0, 0.5]]
    for distance, share in ((0.5, 0.1), (2.0, 0.3), (3.0, 0.5)):
        lost = np.isinf(measured(np.full(NUM, distance), **{**CLEAN, "missing": shares}))
        assert lost.mean() == pytest.approx(share, abs=4.0 * np.sqrt(share * (1 - share) / NUM))
        assert abs(np.corrcoef(lost[1:], lost[:-1])[0, 1]) < 0.05  # in no pattern


def test_a_beam_on_two_surfaces_returns_a_range_between_them_as_often_as_the_share_says():
    near, far, mixed = 1.0, 3.0, 0.3
    rays = np.tile([[far], [near], [far]], (1, NUM))
    ranges = footprint(rays, 0.01, mixed, np.random.default_rng(0).random((2, NUM)))
    between = (ranges > near) & (ranges < far)
    assert between.mean() == pytest.approx(mixed, abs=4.0 * np.sqrt(mixed * (1 - mixed) / NUM))
    assert stats.kstest(ranges[between], stats.uniform(near, far - near).cdf).pvalue > 0.01
    assert (ranges[~between] == far).all()


def test_a_beam_on_one_flat_surface_is_never_mixed_however_it_is_inclined():
    """At 89 degrees the footprint of 0.02 rad is metres long: r = d / cos."""
    angles, half = np.radians(np.linspace(-88.8, 88.8, 999)), 0.01
    rays = 1.0 / np.cos(angles + np.array([[0.0], [half], [-half]]))
    ranges = footprint(np.where(rays > 0.0, rays, np.inf), 2 * half, 1.0, np.full((2, 999), 0.5))
    np.testing.assert_array_equal(ranges, rays[0])


def test_the_draws_of_a_scan_do_not_depend_on_what_the_scans_before_met():
    lidar = Sensors(lidar=LidarSpec("lds-01", missing=0.2)).scanner
    full, empty = (Returns(lidar, profile("pearson")["lidar.range"], 3) for _ in range(2))
    full.measure(np.full((3, 360), 2.0))
    empty.measure(np.full((3, 360), np.inf))
    edges = np.where(np.arange(360) % 7 == np.arange(3)[:, None], 1.0, 3.0)
    np.testing.assert_array_equal(full.measure(edges), empty.measure(edges))
