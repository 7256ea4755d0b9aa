import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.errors import InvalidValue
from mjnav.rkhs import PolynomialKernel, mmd_squared, moment_distance, raw_moments

VALUES = st.floats(-10.0, 10.0)
WEIGHTS = st.floats(-2.0, 2.0)
SAMPLES = st.integers(1, 12).flatmap(
    lambda n: st.tuples(arrays(float, n, elements=VALUES), arrays(float, n, elements=WEIGHTS))
)
KERNELS = st.fixed_dictionaries(
    {"degree": st.integers(1, 5), "scale": st.floats(0.01, 5.0), "offset": st.floats(0.01, 5.0)}
)


def literal(x, y, alpha, beta, degree, scale, offset):
    """MMD^2 as in the definition, and the sum of its terms' sizes, to which the rounding is in proportion."""

    def sums(first, second):
        terms = [
            (a * b * (scale * u * v + offset) ** degree, abs(a * b) * abs(scale * u * v + offset) ** degree)
            for u, a in zip(*first, strict=True)
            for v, b in zip(*second, strict=True)
        ]
        return np.sum(terms, axis=0)

    (xx, xx_size), (xy, _), (yy, yy_size) = (
        sums(*pair) for pair in (((x, alpha), (x, alpha)), ((x, alpha), (y, beta)), ((y, beta), (y, beta)))
    )
    return xx - 2.0 * xy + yy, xx_size + yy_size


@given(SAMPLES, SAMPLES, KERNELS)
def test_the_moment_form_is_the_definition_for_any_weights_and_lengths(first, second, kernel):
    (x, alpha), (y, beta) = first, second
    expected, size = literal(x, y, alpha, beta, **kernel)
    found = mmd_squared(x, y, x_weights=alpha, y_weights=beta, **kernel)
    assert found == pytest.approx(expected, rel=0.0, abs=1e-9 * size + 1e-300)


@given(SAMPLES, SAMPLES, KERNELS)
def test_without_weights_every_sample_counts_the_same(first, second, kernel):
    (x, _), (y, _) = first, second
    expected, size = literal(x, y, [1.0 / len(x)] * len(x), [1.0 / len(y)] * len(y), **kernel)
    assert mmd_squared(x, y, **kernel) == pytest.approx(expected, rel=0.0, abs=1e-9 * size)


@pytest.mark.parametrize(
    ("x", "y", "kernel", "expected"),
    [
        ([2.0], [5.0], {"degree": 1}, 9.0),
        ([2.0], [5.0], {"degree": 1, "scale": 3.0, "offset": 7.0}, 27.0),
        # 2 (1 - 2)^2 + (1 - 4)^2
        ([1.0], [2.0], {"degree": 2}, 11.0),
        # scale 2, offset 3: c = 9, 12, 4
        ([1.0], [2.0], {"degree": 2, "scale": 2.0, "offset": 3.0}, 12.0 + 4.0 * 9.0),
        # equal means, variances 1 and 0: only p = 2 and p = 3, where E x^3 = 0
        ([-1.0, 1.0], [0.0], {"degree": 3}, 3.0),
        ([0.0, 0.0, 3.0], [1.0], {"degree": 3}, 3.0 * (3.0 - 1.0) ** 2 + (9.0 - 1.0) ** 2),
    ],
)
def test_small_cases_come_out_exactly(x, y, kernel, expected):
    assert mmd_squared(x, y, **kernel) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("degree", range(1, 6))
def test_weights_that_do_not_sum_to_one_add_the_term_of_order_zero(degree):
    difference = mmd_squared([0.0], [0.0], degree=degree, offset=2.0, x_weights=[3.0], y_weights=[0.5])
    assert difference == pytest.approx(2.0**degree * 2.5**2, rel=1e-14)


def test_the_distance_of_degree_d_sees_the_moments_up_to_d_and_no_further():
    # Weights 1/6, 2/3, 1/6 on -sqrt 3, 0, sqrt 3 have the moments 0, 1, 0, 3, 0 of a normal; -1 and 1 have 0, 1, 0, 1.
    x, alpha = np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 6.0
    y = [-1.0, 1.0]
    for degree in (1, 2, 3):
        assert mmd_squared(x, y, degree=degree, x_weights=alpha) == pytest.approx(0.0, abs=1e-28)
    assert mmd_squared(x, y, degree=4, x_weights=alpha) == pytest.approx(4.0, rel=1e-12)


@given(SAMPLES, SAMPLES, KERNELS)
def test_the_distance_is_symmetric_and_never_negative(first, second, kernel):
    (x, alpha), (y, beta) = first, second
    there = mmd_squared(x, y, x_weights=alpha, y_weights=beta, **kernel)
    assert there >= 0.0
    assert there == mmd_squared(y, x, x_weights=beta, y_weights=alpha, **kernel)


BAD = {
    "x": [[], 1.0, [1.0, np.nan], "one", None, [10**400], [1.0, [2.0]], [1j], [1e13]],
    "y": [[[1.0]], [np.inf]],
    "x_weights": [[0.5], [0.5, np.nan]],
    "y_weights": [[np.nan], [[1.0]]],
    "degree": [0, 11, 1.5, 2.0, np.nan, True, "3"],
    "scale": [None, "1", [1.0, 2.0], 0.0, -1.0, np.nextafter(1e6, np.inf)],
    "offset": [0.0, np.nextafter(1e-9, 0.0), np.inf, np.nan],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in BAD.items() for value in values])
def test_bad_input_is_refused_by_its_name(key, value):
    arguments = {"x": [1.0, 2.0], "y": [3.0], "degree": 2} | {key: value}
    with pytest.raises(InvalidValue) as error:
        mmd_squared(arguments.pop("x"), arguments.pop("y"), **arguments)
    assert error.value.key == key


def test_the_ends_of_the_range_are_kernels():
    for value in (1e-9, 1e6):
        coefficients = PolynomialKernel(10, value, value).coefficients
        assert np.isfinite(coefficients).all()
        assert coefficients[0] > 0.0


def test_moments_are_taken_over_the_last_axis():
    x = np.array([[1.0, 2.0], [0.0, -3.0]])
    assert raw_moments(x, 3).tolist() == [[1.5, 2.5, 4.5], [-1.5, 4.5, -13.5]]
    assert raw_moments(x[None], 3).tolist() == [raw_moments(x, 3).tolist()]
    assert raw_moments(x, 1, np.array([2.0, 1.0])).tolist() == [[4.0], [-3.0]]
    assert moment_distance(x, np.zeros(2), PolynomialKernel(2, 0.5, 2.0)).tolist() == [3.0, 2.25]
