import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from mjnav.compile.compiled import exact
from mjnav.geometry.angles import LEAST, wrap, wrapped


@exact
def _wrapped(angle):
    return wrapped(angle)


@given(st.floats(-1e4, 1e4))
@example(np.pi)
@example(-np.pi)
@example(LEAST)
@example(float(np.nextafter(np.pi, 4.0)))
@example(-3.0 * np.pi)
def test_one_heading_is_wrapped_as_an_array_of_them(angle):
    found = _wrapped(float(angle))
    assert -np.pi < found <= np.pi
    assert np.abs(np.exp(1j * found) - np.exp(1j * wrap(angle))) < 1e-9
    if -np.pi < angle <= np.pi:
        assert found == angle
