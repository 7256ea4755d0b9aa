import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.constraints import lane_distance, wall_clearance
from mjnav.errors import InvalidValue

POINT = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
VELOCITY = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
POINTS = 201


def brute_force(p, q, start, end, horizon):
    """Least distance over many points of both segments, and the half spacing of those points."""
    p, q, start, end = (np.array(a, float) for a in (p, q, start, end))
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    path, wall = p + share * horizon * q, start + share * (end - start)
    distance = np.hypot(path[:, None, 0] - wall[None, :, 0], path[:, None, 1] - wall[None, :, 1]).min()
    spacing = (np.hypot(*(horizon * q)) + np.hypot(*(end - start))) / (POINTS - 1)
    return distance, 0.5 * spacing


def least_distance(p, q, start, end, horizon):
    return float(np.sqrt(max(-float(wall_clearance(p, q, start, end, 0.0, horizon)), 0.0)))


@settings(max_examples=60)
@given(POINT, VELOCITY, POINT, POINT, st.floats(0.0, 3.0))
def test_the_distance_is_that_of_the_nearest_of_many_points_of_path_and_wall(p, q, start, end, horizon):
    sampled, spacing = brute_force(p, q, start, end, horizon)
    exact = least_distance(p, q, start, end, horizon)
    assert exact <= sampled + 1e-6
    assert exact >= sampled - spacing - 1e-6


@pytest.mark.parametrize(
    ("p", "q", "start", "end", "horizon", "distance"),
    [
        ((0.0, 0.0), (1.0, 0.0), (1.0, -1.0), (1.0, 1.0), 2.0, 0.0),  # crosses
        ((0.0, 0.0), (1.0, 0.0), (1.0, -1.0), (1.0, 1.0), 0.25, 0.75),  # stops short
        ((0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 1.0), 2.0, 0.0),  # touches the wall's end
        ((0.0, 0.0), (1.0, 0.0), (2.0, -1.0), (2.0, 1.0), 2.0, 0.0),  # ends on the wall
        ((0.0, 0.0), (1.0, 0.0), (-5.0, 1.0), (5.0, 1.0), 2.0, 1.0),  # parallel
        ((0.0, 0.0), (1.0, 0.0), (0.5, 0.0), (9.0, 0.0), 2.0, 0.0),  # on one line, overlapping
        ((0.0, 0.0), (1.0, 0.0), (5.0, 0.0), (9.0, 0.0), 2.0, 3.0),  # on one line, apart
        ((0.0, 0.0), (-1.0, 0.0), (1.0, -1.0), (1.0, 1.0), 2.0, 1.0),  # drives away
        ((0.0, 0.0), (1.0, 0.0), (3.0, 1.0), (4.0, 5.0), 2.0, 2.0**0.5),  # end to end
        ((0.0, 0.0), (0.0, 0.0), (3.0, -9.0), (3.0, 9.0), 2.0, 3.0),  # no path
        ((0.0, 0.0), (1.0, 0.0), (3.0, 4.0), (3.0, 4.0), 0.0, 5.0),  # no path, no wall
        ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (1.0, 0.5), 2.0, 0.5),  # no wall, beside the path
        ((0.0, 0.0), (1.0, 1.0), (0.0, 2.0), (2.0, 0.0), 2.0, 0.0),  # oblique
    ],
)
def test_known_places_have_the_exact_distance_from_the_wall_and_its_reverse(p, q, start, end, horizon, distance):
    for a, b in ((start, end), (end, start)):
        f = float(wall_clearance(p, q, a, b, 0.3, horizon))
        assert f == pytest.approx(0.09 - distance**2, abs=1e-12)


def test_all_arguments_broadcast():
    p = np.array([[[0.0, 0.0]], [[0.0, 5.0]]])  # (2, 1, 2)
    start, end = np.array([[1.0, -9.0], [3.0, -9.0], [-2.0, -9.0]]), np.array([[1.0, 9.0], [3.0, 9.0], [-2.0, 9.0]])
    f = wall_clearance(p, (0.5, 0.0), start, end, np.array([0.1, 0.2, 0.3]), 1.0)
    assert f == pytest.approx(np.array([[0.01 - 0.25, 0.04 - 6.25, 0.09 - 4.0]] * 2))


@given(
    *[st.tuples(*[st.one_of(st.floats(-1e70, 1e70), st.sampled_from([0.0, 1e-200, 5e-324]))] * 2)] * 4,
    st.floats(0.0, 1e5),
)
def test_f_is_always_a_finite_number(p, q, start, end, horizon):
    assert np.isfinite(float(wall_clearance(p, q, start, end, 0.3, horizon)))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"horizon": -1.0}, "horizon: found -1.0; allowed: a finite number >= 0"),
        ({"horizon": np.inf}, "horizon: found inf"),
        ({"horizon": np.nan}, "horizon: found nan"),
        ({"position": np.zeros(3)}, "position: found (3,); allowed: an array whose last axis is 2"),
        ({"velocity": 0.0}, "velocity: found ()"),
        ({"start": np.zeros((2, 1))}, "start: found (2, 1)"),
        ({"end": np.zeros(0)}, "end: found (0,)"),
    ],
)
def test_bad_input_is_refused_by_its_name(arguments, message):
    points = dict.fromkeys(("position", "velocity", "start", "end"), (0.0, 0.0))
    arguments = points | {"radius": 1.0, "horizon": 1.0} | arguments
    with pytest.raises(InvalidValue) as error:
        wall_clearance(**arguments)
    assert message in str(error.value)


def test_a_wall_shorter_than_a_metre_is_passed_beside_its_end():
    start, end = (0.0, 0.0), (0.5, 0.0)
    assert wall_clearance((0.5, 0.3), (0.0, 0.0), start, end, 1.0, 0.0) == pytest.approx(1.0 - 0.3**2)
    # One crosses the line of the other beyond its end.
    assert wall_clearance((2.0, -0.1), (0.0, 0.2), start, end, 1.0, 1.0) == pytest.approx(1.0 - 1.5**2)
    assert wall_clearance((-1.0, 0.2), (0.5, 0.0), (0.0, 0.0), (0.0, 0.5), 1.0, 1.0) == pytest.approx(1.0 - 0.5**2)


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


@pytest.mark.parametrize("line", [(0.0, 0.0, 1.0), (np.nan, 1.0, 0.0)])
def test_a_line_without_direction_is_refused(line):
    with pytest.raises(InvalidValue, match="allowed: a line"):
        lane_distance((0.0, 0.0), line)


def test_a_position_that_is_not_in_the_plane_is_refused():
    with pytest.raises(InvalidValue, match="position"):
        lane_distance((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


def test_every_position_of_an_array_has_its_lane_distance():
    assert lane_distance([[0.0, 1.0], [2.0, 3.0], [4.0, -5.0]], (0.0, 1.0, 0.0)).tolist() == [1.0, 3.0, -5.0]
