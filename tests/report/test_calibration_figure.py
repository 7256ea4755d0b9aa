"""The reliability curves' picture: what stands where."""

import numpy as np
import pytest

from mjnav.metrics.prediction import calibration
from mjnav.report.calibration_figure import calibration_figure


def some(bias: float, num: int = 200):
    rng = np.random.default_rng(0)
    q = rng.uniform(0.0, 0.8, num)
    return calibration(q + bias, q, np.arange(num) % 10, rng, resamples=100)


def test_a_panel_a_setting_and_a_curve_a_method():
    found = {method: {"direct": some(0.0), "filtered": some(0.1)} for method in ("rkhs", "mean", "saa")}
    figure = calibration_figure(found, "somewhere")
    curves, counts = figure.axes[:2], figure.axes[2:]
    assert [axes.get_title() for axes in curves] == ["direct", "filtered"]
    assert figure.get_suptitle() == "somewhere"
    for setting, curve, count in zip(("direct", "filtered"), curves, counts, strict=True):
        for method, line, bars in zip(found, curve.get_lines()[1:], count.get_lines(), strict=True):
            bins = [b for b in found[method][setting].bins if b.count]
            assert line.get_xydata() == pytest.approx(np.array([(b.predicted, b.observed) for b in bins]))
            assert bars.get_ydata().tolist() == [b.count for b in bins]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [f"{method}\n0.000, 0.100" for method in found]


def test_one_setting_and_no_forecasts_make_a_picture_too(tmp_path):
    nothing = calibration([], [], [], np.random.default_rng(0))
    calibration_figure({"rkhs": {"direct": nothing}}, "").savefig(tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000
