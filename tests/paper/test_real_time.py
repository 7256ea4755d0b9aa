"""Times of decisions: which are taken, what they decide, and the figure of them."""

from dataclasses import replace
from io import BytesIO

import matplotlib.pyplot
import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.paper import draw, real_time
from mjnav.paper.claims import Verdict, judge
from mjnav.paper.episodes import DIRECT, changed
from mjnav.paper.real_time import DEGREES, SAMPLES, DecisionTimes, Times, claims, picture


def measure(scenario):
    return real_time.measure([scenario], True, lambda done, total: None)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("five", [*DIRECT, "physics.engine=kinematic", "control.num_v=4", "control.num_omega=5"])


@pytest.fixture(scope="module")
def data(scenario):
    return measure(scenario)


def constant(seconds, num=50):
    """Data of which every decision took as long; by Gram matrices 1000 times as long."""
    times = [
        Times(d, SAMPLES, np.full(num, s), gram)
        for d in DEGREES
        for gram, s in ((False, seconds), (True, 1e3 * seconds))
    ]
    return DecisionTimes(0.1, 402, tuple(times))


def test_every_degree_is_timed_on_every_size_and_gram_matrices_take_longer_and_grow_faster(data):
    for degree in DEGREES:
        moments, gram = (data.of(degree, gram=gram) for gram in (False, True))
        assert [times.samples for times in moments] == [10, 25, 50]
        assert [times.samples for times in gram] == [10, 25]
        assert all((times.seconds > 0.0).all() for times in (*moments, *gram))
        assert moments[0].seconds.shape == (40,)
    few, many = (min(times.seconds) for times in data.of(3, gram=True))
    assert many > 5.0 * few  # pairs squared: 39 times as much
    assert many > 10.0 * min(data.of(3, gram=False)[1].seconds)
    assert (data.num_candidates, data.period) == (22, 0.1)


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
    rate = f"{1.0 / seconds:.3g}"
    assert f"{rate} [{rate}, {rate}] decisions a second (n = 50)" in found[0].evidence


def test_the_slowest_degree_decides():
    data = constant(1e-3)
    slow = replace(data.times[0], seconds=np.full(50, 0.2))
    assert judge(claims(replace(data, times=(slow, *data.times[1:]))))[0].verdict == Verdict.FAILS


def test_another_method_is_refused(scenario):
    with pytest.raises(InvalidValue, match="rkhs"):
        measure(changed(scenario, "saa"))


def test_a_figure_is_saved_with_text_as_text_and_leaves_no_style(data):
    before = dict(matplotlib.rcParams)
    figure = picture(data)
    with draw.style():
        figure.savefig(file := BytesIO(), format="pdf")
    assert b"/FontFile2" in file.getvalue()  # TrueType, not outlines
    assert dict(matplotlib.rcParams) == before
    assert matplotlib.pyplot.get_fignums() == []
