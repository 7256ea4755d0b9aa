"""Times of decisions: which are taken, what they decide, and the figure of them."""

from dataclasses import replace
from io import BytesIO

import matplotlib.pyplot
import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.paper import real_time, style
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.item import Verdict, judge
from mjnav.paper.real_time import DEGREES, OBSTACLES, SAMPLES, DecisionTimes, Times, claims, picture

SMALL = ("physics.engine=kinematic", "control.num_v=4", "control.num_omega=5")


def measure(scenario):
    return real_time.measure([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario(
        "five", [*options(DIRECT), "physics.engine=kinematic", "control.num_v=4", "control.num_omega=5"]
    )


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


def constant(seconds, num=50):
    """Data of which every decision took as long; by Gram matrices 1000 times as long."""
    times = [
        Times(d, SAMPLES, OBSTACLES, np.full(num, s), np.full(num, s), gram)
        for d in DEGREES
        for gram, s in ((False, seconds), (True, 1000.0 * seconds))
    ]
    return DecisionTimes("somewhere", 0.1, 402, tuple(times))


def test_every_degree_is_timed_on_every_size(data):
    sizes = {(t.samples, t.obstacles) for t in data.times}
    assert sizes == {(10, 5), (25, 5), (50, 5), (25, 1), (25, 10)}
    for samples, obstacles in sizes:
        for degree in DEGREES:
            (times,) = data.of(degree=degree, samples=samples, obstacles=obstacles)
            assert times.seconds.shape == times.cpu.shape == (40,)
            assert (times.seconds > 0.0).all()
    assert data.num_candidates == 22
    assert data.period == 0.1


def test_gram_matrices_take_longer_and_grow_faster(data):
    few, many = (min(t.cpu) for t in data.of(degree=3, gram=True))
    (moments,) = data.of(degree=3, samples=SAMPLES, obstacles=OBSTACLES)
    assert many > 5.0 * few  # pairs squared: 39 times as much
    assert many > 10.0 * min(moments.cpu)


def test_quantiles_and_rates_have_intervals_around_them():
    seconds = np.linspace(0.001, 0.003, 101)
    times = Times(1, 25, 5, seconds, seconds)
    middle, low, high = times.quantile(0.5)
    assert (middle, low < middle < high) == (pytest.approx(0.002), True)
    rate, slow, fast = times.rate()
    assert rate == pytest.approx(500.0)
    # The mean's standard error is 0.58 ms / sqrt(101); of the rate 2.9 %.
    assert (slow, fast) == (pytest.approx(500.0 / 1.057, rel=0.01), pytest.approx(500.0 / 0.943, rel=0.01))
    assert times.quantile(0.99) == times.quantile(0.99)


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        (1e-3, [Verdict.HOLDS, Verdict.FAILS]),
        (1e-5, [Verdict.HOLDS, Verdict.HOLDS]),
        (0.2, [Verdict.FAILS, Verdict.FAILS]),
    ],
)
def test_the_period_decides_what_real_time_is(seconds, expected):
    found = judge(claims(constant(seconds)))
    assert [finding.verdict for finding in found] == expected
    assert (
        f"{1.0 / seconds:.3g} [{1.0 / seconds:.3g}, {1.0 / seconds:.3g}] decisions a second (n = 50)"
        in found[0].evidence
    )


def test_the_slowest_degree_decides():
    data = constant(1e-3)
    slow = replace(data.times[0], seconds=np.full(50, 0.2))
    found = judge(claims(replace(data, times=(slow, *data.times[1:]))))
    assert found[0].verdict == Verdict.FAILS


def test_another_method_is_refused(scenario):
    saa = replace(scenario, control=replace(scenario.control, method="saa", parameters={}))
    with pytest.raises(InvalidValue, match="rkhs"):
        measure(saa)


def test_a_figure_is_saved_with_text_as_text_and_leaves_no_style(data):
    before = dict(matplotlib.rcParams)
    figure = picture(data)
    assert figure.get_figwidth() == style.TWO_COLUMNS
    with style.style():
        figure.savefig(file := BytesIO(), format="pdf")
    assert b"/FontFile2" in file.getvalue()  # TrueType, not outlines
    assert dict(matplotlib.rcParams) == before
    assert matplotlib.pyplot.get_fignums() == []
