"""The lidar of a run file: models, own figures in their place, and what is refused."""

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.noise import Zero, profile
from mjnav.scene.load import load
from mjnav.scene.sensors import LidarSpec, Sensors

LAW = profile("pearson")["lidar.range"]


def refused(key, **overrides):
    with pytest.raises(InvalidValue) as error:
        load("crossing1", {f"sensors.{name}": value for name, value in overrides.items()})
    assert error.value.key == f"sensors.{key}"
    return str(error.value)


def test_without_a_model_the_lidar_is_the_ideal_one_of_the_keys_beside_it():
    lidar = Sensors(lidar_beams=8, lidar_range=4.0).scanner
    assert np.array_equal(lidar.angles, 2.0 * np.pi * np.arange(8) / 8 - np.pi)
    assert (lidar.model, lidar.rate, lidar.max_range, lidar.min_range) == ("ideal", None, 4.0, 0.0)
    assert (lidar.bias(2.0, LAW), lidar.std(2.0, LAW)) == (LAW.mean, LAW.std)
    assert not lidar.turn_offsets.any()
    assert not lidar.mount.any()


def test_a_maker_s_limits_become_bias_and_spread_by_range():
    """The e-manual of the LDS-01: accuracy +-15 mm below 0.5 m, then +-5 %; precision +-10 mm, then +-3.5 %."""
    lidar = Sensors(lidar=LidarSpec("lds-01")).scanner
    ranges = np.array([0.2, 0.4999, 0.5001, 1.0, 2.0, 3.5])
    assert lidar.bias(ranges, LAW) == pytest.approx([0.0075, 0.0075, *(0.025 * ranges[2:])], rel=1e-3)
    assert lidar.std(ranges, LAW) == pytest.approx([0.005, 0.005, *(0.0175 * ranges[2:])], rel=1e-3)
    assert not lidar.std(ranges, Zero()).any()
    assert (len(lidar.angles), lidar.max_range) == (360, 3.5)
    assert lidar.turn_offsets[[0, 90, 359]] == pytest.approx([0.0, 0.05, 0.2 * 359 / 360])


def test_an_estimator_takes_off_the_bias_of_a_calibrated_lidar_alone():
    known, unknown = (Sensors(lidar=LidarSpec("lds-01", calibrated=value)).scanner for value in (True, False))
    assert known.known_bias(2.0, LAW) == known.bias(2.0, LAW) == unknown.bias(2.0, LAW) == pytest.approx(0.05)
    assert unknown.known_bias(2.0, LAW) == 0.0
    law = profile("measured")["lidar.range"]
    assert Sensors(lidar=LidarSpec(calibrated=False)).scanner.known_bias(2.0, law) == law.mean == -0.035


def test_what_cannot_be_is_refused_at_its_key():
    assert "did you mean 'lds-01'?" in refused("lidar.model", **{"lidar.model": "lds01"})
    refused("lidar_beams", **{"lidar.model": "lds-01", "lidar_beams": 720})
    refused("lidar_range", **{"lidar.max_range": 5.0, "lidar_range": 4.0})
    refused("lidar.min_range", **{"lidar.min_range": 20.0})
    refused("lidar.max_range", **{"lidar.model": "lds-01", "lidar.max_range": 0.1})
    refused("lidar.bias.1.0", **{"lidar.bias": [[1.0, 0.0], [0.5, 0.0]]})
    refused("lidar.mount", **{"lidar.mount": [0.2, 0.2, 0.0]})
