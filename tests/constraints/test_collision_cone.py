import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.constraints import FORMS, collision_cone
from mjnav.errors import InvalidValue

PLANE = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
MOVING = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)).filter(lambda q: np.hypot(*q) > 0.05)
RADIUS = st.floats(0.0, 2.0)
HORIZON = st.one_of(st.none(), st.floats(0.01, 100.0))
# Far outside any room, yet within what squares and products of float64 hold.
EXTREME = st.one_of(st.floats(-1e70, 1e70), st.floats(-1e-6, 1e-6), st.sampled_from([0.0, 1e-9, -1e-9, 5e-324]))
EXTREMES = st.tuples(EXTREME, EXTREME)


def literal(r, q, radius, form, horizon=None):
    """f as the formulas have it, one pair at a time."""
    rr, qq, rq = r[0] ** 2 + r[1] ** 2, q[0] ** 2 + q[1] ** 2, r[0] * q[0] + r[1] * q[1]
    if np.sqrt(qq) < 1e-9:
        return radius**2 - rr
    if form == "line":
        return rq**2 / qq - rr + radius**2
    if form == "ray":
        return rq**2 / qq - rr + radius**2 if rq < 0.0 else radius**2 - rr
    t = -rq / qq
    if t < 0.0:
        t = 0.0
    if horizon is not None and t > horizon:
        t = horizon
    return radius**2 - ((r[0] + t * q[0]) ** 2 + (r[1] + t * q[1]) ** 2)


def close(f, r, radius):
    return pytest.approx(f, rel=1e-9, abs=1e-12 * (1.0 + r[0] ** 2 + r[1] ** 2 + radius**2))


@pytest.mark.parametrize("form", FORMS)
@given(r=PLANE, q=MOVING, radius=RADIUS, horizon=HORIZON)
def test_every_form_is_its_formula(form, r, q, radius, horizon):
    f = float(collision_cone(r, q, radius, form=form, horizon=horizon))
    assert f == close(literal(r, q, radius, form, horizon), r, radius)


@pytest.mark.parametrize("form", FORMS)
def test_a_whole_array_is_a_loop_over_its_elements(form):
    rng = np.random.default_rng(5)
    r, q = rng.normal(scale=3.0, size=(4, 1, 6, 2)), rng.normal(size=(5, 1, 2))
    radius = rng.uniform(0.1, 1.0, size=(6,))
    f = collision_cone(r, q, radius, form=form, horizon=2.0)
    assert f.shape == (4, 5, 6)
    for i, j, k in np.ndindex(4, 5, 6):
        assert f[i, j, k] == close(literal(r[i, 0, k], q[j, 0], radius[k], form, 2.0), r[i, 0, k], radius[k])


def least_distance(r, q, times):
    return np.hypot(r[0] + times * q[0], r[1] + times * q[1]).min()


@pytest.mark.parametrize(
    ("form", "horizon", "first", "last"),
    [("line", None, -1.0, 1.0), ("ray", None, 0.0, 1.0), ("segment", None, 0.0, 1.0), ("segment", 4.0, 0.0, 4.0)],
)
@given(r=PLANE, q=MOVING, radius=RADIUS)
def test_f_is_that_of_the_closest_approach_on_a_dense_grid_of_times(form, horizon, first, last, r, q, radius):
    speed = np.hypot(*q)
    if horizon is None:  # long enough to have passed by
        reach = np.hypot(*r) / speed + 1.0
        first, last = first * reach, last * reach
    times = np.linspace(first, last, 4001)
    sampled = least_distance(r, q, times)
    exact = np.sqrt(max(radius**2 - float(collision_cone(r, q, radius, form=form, horizon=horizon)), 0.0))
    rounding = 1e-6 * (1.0 + np.hypot(*r))  # of a square root near 0
    assert exact <= sampled + rounding
    assert exact >= sampled - 0.5 * speed * (times[1] - times[0]) - rounding


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("q", [(0.0, 0.0), (9e-10, 0.0), (-5e-10, 5e-10), (0.0, -1e-300), (5e-324, 0.0)])
@pytest.mark.parametrize("horizon", [None, 4.0])
def test_without_relative_motion_every_form_is_the_present_distance(form, q, horizon):
    for r in ((3.0, -4.0), (-3.0, 4.0)):
        assert float(collision_cone(r, q, 2.0, form=form, horizon=horizon)) == -21.0


@pytest.mark.parametrize("form", FORMS)
def test_motion_from_a_billionth_of_a_metre_a_second_on_has_a_direction(form):
    approaching = float(collision_cone((3.0, -4.0), (-1e-9, 0.0), 2.0, form=form))
    assert approaching == pytest.approx(4.0 - 16.0)  # it will pass at 4 m
    assert float(collision_cone((3.0, -4.0), (-0.999e-9, 0.0), 2.0, form=form)) == -21.0


@pytest.mark.parametrize("form", FORMS)
@given(r=EXTREMES, q=EXTREMES, radius=st.floats(0.0, 1e70), horizon=st.one_of(st.none(), st.floats(1e-300, 1e70)))
def test_f_is_always_a_finite_number_and_never_above_the_squared_radius(form, r, q, radius, horizon):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        f = float(collision_cone(r, q, radius, form=form, horizon=horizon))
    assert np.isfinite(f)
    assert f <= radius**2 + 1e-9 * (r[0] ** 2 + r[1] ** 2) + 1e-300


def test_arrays_that_must_not_be_written_are_only_read():
    r, q = np.ones((3, 2)), np.ones((3, 2))
    r.flags.writeable = q.flags.writeable = False
    assert collision_cone(r, q, 1.0).tolist() == [-1.0] * 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"form": "lime"}, "form: found 'lime'; allowed: line, ray, segment; did you mean 'line'?"),
        ({"horizon": 0.0}, "horizon: found 0.0; allowed: a number > 0, or None"),
        ({"horizon": -1.0}, "horizon: found -1.0"),
        ({"horizon": np.nan}, "horizon: found nan"),
        ({"horizon": "long"}, "horizon: found 'long'; allowed: a finite number"),
        ({"form": []}, "form: found []; allowed: line, ray, segment"),
        ({"relative_position": [0.0] * 3}, "allowed: finite numbers, an array of shape (..., 2), up to 1e+70 [m]"),
        ({"relative_position": (np.nan, 0.0)}, "relative_position: found (nan, 0.0); allowed: finite numbers"),
        (
            {"combined_radius": None},
            "combined_radius: found nothing; allowed: finite numbers, an array of shape (...,)",
        ),
        ({"relative_position": np.zeros((3, 2)), "combined_radius": [1.0, 2.0]}, "shapes: found ((3, 2), (2,), (2,))"),
        ({"relative_velocity": 1.0}, "relative_velocity: found 1.0; allowed: finite"),
    ],
)
def test_bad_input_is_refused_by_its_name(arguments, message):
    arguments = {"relative_position": (1.0, 0.0), "relative_velocity": (0.0, 1.0), "combined_radius": 1.0} | arguments
    with pytest.raises(InvalidValue) as error:
        collision_cone(**arguments)
    assert message in str(error.value)
