import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mjnav.compile.compiled import exact
from mjnav.geometry.angles import HALF_TURN_TIE, LEAST, circular_mean, rounded, shortest_turn, wrap, wrapped

ANGLES = st.floats(-1e4, 1e4)


@given(ANGLES)
def test_a_wrapped_angle_is_the_same_direction_in_the_half_open_range(angle):
    wrapped = float(wrap(angle))
    assert -np.pi < wrapped <= np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-9)


@given(st.floats(allow_infinity=False))
def test_one_angle_and_an_array_of_it_are_wrapped_to_the_same_bits(angle):
    assert np.float64(wrap(angle)).tobytes() == wrap(np.array([angle])).tobytes()


@given(ANGLES)
def test_the_way_round_is_the_wrapped_angle_but_that_half_a_turn_has_one_side(angle):
    turn = shortest_turn(angle)
    half = np.pi - abs(turn) < 2.0 * HALF_TURN_TIE
    assert turn == pytest.approx(abs(float(wrap(angle))) if half else float(wrap(angle)), abs=1e-8)


@pytest.mark.parametrize("turns", range(-5, 6))
@pytest.mark.parametrize("off", [-1e-12, 0.0, 1e-12])
def test_half_a_turn_is_to_the_left_whatever_the_last_bits(turns, off):
    assert shortest_turn((2 * turns + 1) * np.pi + off) == pytest.approx(np.pi, abs=2e-12)


@pytest.mark.parametrize("turns", range(-5, 6))
@pytest.mark.parametrize("towards", [-np.inf, np.inf])
def test_the_neighbours_of_pi_stay_inside_the_range(turns, towards):
    for steps in range(5):
        angle = (2 * turns + 1) * np.pi
        for _ in range(steps):
            angle = np.nextafter(angle, towards)
        assert -np.pi < float(wrap(angle)) <= np.pi


def test_the_mean_direction_follows_the_weights():
    assert circular_mean([0.0, np.pi / 2], [1.0, 1.0]) == pytest.approx(np.pi / 4)
    assert circular_mean([0.0, np.pi / 2], [2.0, 0.0]) == pytest.approx(0.0)
    assert circular_mean([0.0, np.pi / 2], [1.0, np.sqrt(3.0)]) == pytest.approx(np.pi / 3)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=10), ANGLES)
def test_turning_all_angles_turns_their_mean(angles, turn):
    turned = circular_mean(np.array(angles) + turn)
    assert float(wrap(turned - circular_mean(angles) - turn)) == pytest.approx(0.0, abs=1e-9)


@exact
def _wrapped(angle):
    return wrapped(angle)


@exact
def _rounded(angle):
    return rounded(angle)


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
    assert np.float64(_rounded(float(angle))).tobytes() == wrap(np.array([angle])).tobytes()
    if -np.pi < angle <= np.pi:
        assert found == angle
