import numpy as np
import pytest

from mjnav.messages import PHASES
from mjnav.metrics.timing import compute_ms, quantiles


def test_quantiles_are_by_phase_in_milliseconds_and_the_tick_is_their_sum():
    timing = np.zeros((101, 7), np.int64)
    timing[:, 0] = np.arange(101)
    timing[:, 1 + PHASES.index("control")] = np.arange(101) * 1_000_000
    timing[:, 1 + PHASES.index("advance")] = 500_000
    timing[:, 6] = 10**12  # lateness is no work
    found = compute_ms(timing)
    assert list(found) == ["sense", "estimate", "control", "record", "tick"]
    assert found["control"] == pytest.approx({"p50": 50.0, "p99": 99.0, "max": 100.0})
    assert found["tick"] == pytest.approx({"p50": 50.5, "p99": 99.5, "max": 100.5})
    assert found["sense"] == {"p50": 0.0, "p99": 0.0, "max": 0.0}


def test_no_tick_has_no_time():
    assert compute_ms(np.zeros((0, 7), np.int64))["tick"] == {"p50": None, "p99": None, "max": None}


def test_more_quantiles_come_before_the_maximum():
    assert quantiles(np.arange(1001), p999=0.999) == {"p50": 500.0, "p99": 990.0, "p999": 999.0, "max": 1000.0}
    assert list(quantiles(np.zeros(0), p999=0.999).items()) == [(key, None) for key in ("p50", "p99", "p999", "max")]
