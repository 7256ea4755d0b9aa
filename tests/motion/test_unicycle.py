import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.geometry.angles import wrap
from mjnav.motion.unicycle import integrate


def runge_kutta(pose, v, omega, duration, steps=200):
    """The unicycle's differential equation, fourth order."""

    def derivative(state):
        return np.array([v * np.cos(state[2]), v * np.sin(state[2]), omega])

    state, h = np.array(pose, float), duration / steps
    for _ in range(steps):
        k1 = derivative(state)
        k2 = derivative(state + 0.5 * h * k1)
        k3 = derivative(state + 0.5 * h * k2)
        k4 = derivative(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


@given(
    st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(-3.2, 3.2)),
    st.floats(-2.0, 2.0),
    st.one_of(st.floats(-3.0, 3.0), st.floats(-1e-6, 1e-6)),
    st.floats(0.0, 1.5),
)
def test_the_arc_solves_the_unicycles_equation(pose, v, omega, duration):
    exact, numerical = integrate(pose, v, omega, duration), runge_kutta(pose, v, omega, duration)
    assert exact[:2] == pytest.approx(numerical[:2], abs=1e-8)
    assert float(wrap(exact[2] - numerical[2])) == pytest.approx(0.0, abs=1e-9)
    assert -np.pi < exact[2] <= np.pi


def test_poses_and_controls_broadcast():
    v, omega = np.array([[0.0], [1.0], [2.0]]), np.zeros((1, 4))
    poses = integrate(np.zeros((3, 4, 3)), v, omega, 0.1)
    assert poses.shape == (3, 4, 3)
    assert poses[:, 0, 0] == pytest.approx([0.0, 0.1, 0.2])
