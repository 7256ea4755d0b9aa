import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.constraints import lane_distance
from mjnav.errors import InvalidValue

NUMBER = st.floats(-10.0, 10.0)
LINE = st.tuples(NUMBER, NUMBER, NUMBER).filter(lambda line: np.hypot(line[0], line[1]) > 1e-3)


@pytest.mark.parametrize(
    ("position", "line", "distance"),
    [
        ((3.0, 2.0), (0.0, 1.0, -1.5), 0.5),
        ((3.0, 1.0), (0.0, 2.0, -3.0), -0.5),
        ((1.0, 1.0), (3.0, 4.0, -2.0), 1.0),
        ((1.0, 1.0), (-3.0, -4.0, 2.0), -1.0),
        ((0.0, 0.0), (1.0, 0.0, 0.0), 0.0),
    ],
)
def test_small_cases_come_out_exactly(position, line, distance):
    assert float(lane_distance(position, line)) == pytest.approx(distance, abs=1e-15)


@given(st.tuples(NUMBER, NUMBER), LINE, st.floats(0.01, 100.0))
def test_the_distance_does_not_depend_on_the_factor_of_the_lines_equation(position, line, factor):
    a, b, c = line
    foot = -c / (a * a + b * b) * np.array([a, b])  # the line's point nearest to the origin
    along = np.array([-b, a]) / np.hypot(a, b)
    offset = np.array(position) - foot
    expected = np.hypot(*(offset - (offset @ along) * along))
    scale = 1.0 + np.hypot(*foot)
    assert abs(float(lane_distance(position, line))) == pytest.approx(expected, abs=1e-9 * scale)
    scaled = tuple(factor * value for value in line)
    assert float(lane_distance(position, scaled)) == pytest.approx(
        float(lane_distance(position, line)), abs=1e-9 * scale
    )


def test_many_positions_have_a_distance_each():
    positions = np.array([[[0.0, 1.0], [0.0, 2.0]], [[5.0, 3.0], [5.0, 4.0]]])
    assert lane_distance(positions, (0.0, 1.0, -1.0)).tolist() == [[0.0, 1.0], [2.0, 3.0]]


@pytest.mark.parametrize("line", [(0.0, 0.0, 1.0), (np.nan, 1.0, 0.0)])
def test_a_line_without_direction_is_refused(line):
    with pytest.raises(InvalidValue, match="allowed: a line"):
        lane_distance((0.0, 0.0), line)


def test_a_position_that_is_not_in_the_plane_is_refused():
    with pytest.raises(InvalidValue, match="position"):
        lane_distance((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
