"""The figures of measurements: what stands where, and that nothing is shared or left behind."""

from dataclasses import replace
from io import BytesIO

import matplotlib
import numpy as np
import pytest

from mjnav.loop.prepare import load_scenario
from mjnav.paper import DIRECT, real_time, snapshots, surface
from mjnav.paper.continuous_cost import VARIANTS
from mjnav.paper.pictures import one as one_figure
from mjnav.paper.pictures import real_time as real_time_figure
from mjnav.paper.pictures import snapshots as snapshots_figure
from mjnav.paper.pictures import style
from mjnav.paper.pictures import surface as surface_figure
from mjnav.paper.pictures import table as table_figure
from mjnav.paper.pictures.bars import bars
from mjnav.paper.snapshots import GOAL, MATCHED
from mjnav.study.compare.compare import CellRows

SHORT = (*DIRECT, "physics.engine=kinematic", "time_limit=3.0")


@pytest.fixture(scope="module")
def surface_data():
    return surface.measure([load_scenario("crossing1", [*SHORT, "control.samples=9"])], quick=True)


@pytest.fixture(scope="module")
def snapshots_data():
    return snapshots.measure([load_scenario("five", SHORT)], quick=True)


@pytest.fixture(scope="module")
def real_time_data():
    rng = np.random.default_rng(0)
    sizes = [(10, 5), (25, 5), (50, 5), (25, 1), (25, 10)]
    times = [
        real_time.Times(d, n, j, *(1e-6 * n**2 * rng.uniform(0.8, 1.2, (2, 30))), gram)
        for d in real_time.DEGREES
        for n, j in sizes
        for gram in (False, True)
    ]
    return real_time.RealTimeData("somewhere", 0.1, 402, tuple(times))


@pytest.fixture(params=["surface", "snapshots", "real_time"])
def drawing(request):
    module = {"surface": surface_figure, "snapshots": snapshots_figure, "real_time": real_time_figure}[request.param]
    return module.figure, request.getfixturevalue(f"{request.param}_data")


def titles(figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes if axes.get_title(loc="left")]


def saved(figure, format="png") -> bytes:
    with style.style():
        figure.savefig(file := BytesIO(), format=format, dpi=50)
    return file.getvalue()


def test_every_figure_is_two_columns_wide_can_be_saved_and_leaves_no_style(drawing):
    draw, data = drawing
    before = dict(matplotlib.rcParams)
    figure = draw(data)
    assert len(saved(figure)) > 5_000
    assert figure.get_figwidth() == style.TWO_COLUMNS
    assert dict(matplotlib.rcParams) == before


def test_print_has_its_text_as_text(real_time_data):
    document = saved(real_time_figure.figure(real_time_data), "pdf")
    assert b"/FontFile2" in document  # TrueType, not outlines


def test_the_surface_has_a_panel_a_variant_and_its_least_cost_is_marked(surface_data):
    figure = surface_figure.figure(surface_data)
    assert titles(figure)[:4] == list(VARIANTS)
    for axes, view in zip(figure.axes[:4], surface_data.views[:4], strict=True):
        i, j = view.surface.minimum
        least, ends = axes.get_lines()
        assert least.get_xydata().tolist() == [[view.surface.v[i], view.surface.omega[j]]]
        assert np.array_equal(ends.get_xydata(), view.ends)


def test_jumps_and_shares_are_the_data_s(surface_data):
    panels = {axes.get_title(loc="left"): axes for axes in surface_figure.figure(surface_data).axes}
    jumps = panels["largest jump of the slope within a step"].get_lines()
    assert [line.get_label() for line in jumps] == [*VARIANTS, "d = 3, not clipped"]
    for line, view in zip(jumps, surface_data.views, strict=True):
        assert np.array_equal(line.get_ydata(), view.jumps)
    bars = panels["between the limits"].patches
    assert len(bars) == 3 * len(VARIANTS) * len(surface.STARTS)
    worse = [bar.get_height() for bar in bars[::3]]
    expected = (surface_data.against_grid[:, :, 1] > 0).mean(axis=0)
    assert worse == pytest.approx(expected.ravel().tolist())
    tops = [bar.get_y() + bar.get_height() for bar in bars[2::3]]
    assert tops == pytest.approx([1.0] * len(tops))


def test_snapshots_have_a_column_each_and_all_samples_are_in_their_histograms(snapshots_data):
    s = snapshots_data.snapshots
    figure = snapshots_figure.figure(snapshots_data)
    assert titles(figure) == [f"{snapshot.time:.1f} s" for snapshot in s]
    for snapshot, axes in zip(s, figure.axes[len(s) : 2 * len(s)], strict=True):
        matched, goal, desired = (patch for patch in axes.patches if hasattr(patch, "get_data"))
        for stairs in (matched, goal, desired):
            assert stairs.get_data().values.sum() == pytest.approx(1.0)
        values, edges, _ = matched.get_data()
        assert np.isclose(edges, 0.0).any()
        assert values[edges[:-1] >= -1e-9].sum() == pytest.approx((snapshot.f[MATCHED] > 0.0).mean())
        assert not desired.get_data().values[edges[:-1] >= -1e-9].any()
    for snapshot, axes in zip(s, figure.axes[2 * len(s) : 3 * len(s)], strict=True):
        shares = [bar.get_width() for bar in axes.patches[1::2]]
        assert shares[0] == pytest.approx((snapshot.f[MATCHED] <= 0.0).mean())
        assert shares[2] == pytest.approx((snapshot.f[GOAL] <= 0.0).mean())


def test_few_snapshots_and_samples_that_are_not_clipped_are_drawn_too(snapshots_data):
    one = replace(snapshots_data.snapshots[0], f=tuple(10.0 * f for f in snapshots_data.snapshots[0].f))
    figure = snapshots_figure.figure(replace(snapshots_data, snapshots=(one,), clip=np.inf))
    assert titles(figure) == [f"{one.time:.1f} s"]


def test_medians_stand_at_their_sizes_and_the_period_is_drawn(real_time_data):
    _, samples, obstacles = real_time_figure.figure(real_time_data).axes
    lines = samples.get_lines()
    assert len(lines) == 2 * len(real_time.DEGREES) + 1
    middle = real_time_data.of(degree=2, obstacles=5)
    (line,) = (line for line in lines if line.get_color() == style.DEGREES[2] and line.get_linestyle() == "-")
    assert line.get_xdata() == pytest.approx([10.0, 25.0, 50.0])
    assert line.get_ydata() == pytest.approx([1e3 * np.median(t.seconds) for t in middle])
    assert lines[-1].get_ydata() == pytest.approx([100.0, 100.0])
    assert [tick.get_text() for tick in obstacles.get_xticklabels()] == ["1", "5", "10"]


def test_every_method_has_a_colour_of_its_own():
    from mjnav.control import names

    assert set(style.METHODS) == set(names())
    assert len(set(style.METHODS.values())) == len(style.METHODS)


def test_what_was_not_run_is_a_gap_with_a_word_and_titles_say_how_many_were():
    def cell(method, setting, num, **columns):
        numbers = {"success": np.ones(num), "ticks": np.full(num, 9.0), "ticks_without_own": np.ones(num)}
        figures = dict.fromkeys((*one_figure.FIGURES, "infeasible_ticks", "max_deviation_m"), np.ones(num))
        return CellRows("s", setting, method, {"seed": np.arange(num), **figures, **numbers, **columns})

    failed = {"success": np.array([1.0, np.nan, np.nan]), "time_to_avoid_s": np.full(3, np.nan)}
    cells = [cell("rkhs d=1", "here", 3, **failed), cell("kld", "here", 5), cell("kld", "there", 5)]
    figures = {"control_cost": "cost", "time_to_avoid_s": "time"}
    figure = bars(cells, ("rkhs d=1", "kld"), figures)
    assert [axes.get_title() for axes in figure.axes[:2]] == ["here\nn = 1–5", "there\nn = 5"]
    words = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert words == [[], ["not run"], ["undefined"], ["not run"]]
    figure = one_figure.figure([*cells, cell("gaussian-moments eta=0.5", "there", 2)])
    assert [axes.get_title() for axes in figure.axes[:2]] == ["here\nn = 1", "there\nn = 2"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["gaussian-moments over η", "rkhs d=1"]
    (axes,) = table_figure.figure([cell("d=1", "here", 3, success=np.full(3, np.nan))]).axes
    assert [text.get_text() for text in axes.texts] == ["undefined", "not run", "not run", "not run"]
    assert len(saved(figure)) > 5_000
