import numpy as np
import pytest

from mjnav.geometry.distances import ellipse_95


def test_the_axes_of_a_turned_gaussian_are_found():
    turn = 0.7
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    covariance = rotation @ np.diag([0.09, 0.01]) @ rotation.T
    assert ellipse_95(covariance) == pytest.approx((0.3 * np.sqrt(5.991), 0.1 * np.sqrt(5.991), turn))
    larger = np.zeros((4, 4))
    larger[:2, :2] = covariance
    assert ellipse_95(larger) == ellipse_95(covariance)


def test_it_holds_95_percent_of_draws():
    covariance = np.array([[0.04, 0.01], [0.01, 0.02]])
    draws = np.random.default_rng(0).multivariate_normal([0.0, 0.0], covariance, 20_000)
    a, b, turn = ellipse_95(covariance)
    along = draws @ [np.cos(turn), np.sin(turn)]
    across = draws @ [-np.sin(turn), np.cos(turn)]
    assert np.mean((along / a) ** 2 + (across / b) ** 2 <= 1.0) == pytest.approx(0.95, abs=0.006)
