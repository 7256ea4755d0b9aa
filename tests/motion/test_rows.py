import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.motion.unicycle import integrate, integrate_rows


@given(st.integers(0, 10**6), st.sampled_from([1e-9, 1e-3, 0.1, 1.0, 30.0]), st.floats(0.001, 2.0))
def test_rows_move_as_the_arrays_do(seed, rate, duration):
    rng = np.random.default_rng(seed)
    pose, v, omega = rng.uniform(-3.1, 3.1, (20, 3)), rng.normal(size=20), rate * rng.normal(size=20)
    before = pose.copy()
    assert integrate_rows(pose, v, omega, duration) == pytest.approx(integrate(pose, v, omega, duration), abs=1e-12)
    assert np.array_equal(pose, before)


def test_headings_are_wrapped_and_standing_still_changes_nothing():
    pose = np.array([[1.0, 2.0, 3.1], [1.0, 2.0, -3.1], [1.0, 2.0, np.pi]])
    turned = integrate_rows(pose, np.zeros(3), np.array([1.0, -1.0, 0.0]), 0.1)
    assert turned[:, 2] == pytest.approx([3.2 - 2.0 * np.pi, 2.0 * np.pi - 3.2, np.pi])
    assert np.array_equal(integrate_rows(pose, np.zeros(3), np.zeros(3), 0.1), pose)
