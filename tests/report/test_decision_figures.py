"""Pictures of single decisions: what they show, and where."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from mjnav.control.decision_surface import DecisionSurface
from mjnav.messages import CandidateCosts, Decision, Status
from mjnav.report.figures import CHOSEN, FORBIDDEN, decision_surface_figure

GOAL, CONE, LANE, TOTAL = range(4)
V, OMEGA = np.linspace(0.0, 1.0, 21), np.linspace(-1.5, 1.5, 31)
CHOICE, NOMINAL = (0.35, -0.6), (0.7, 0.9)


def surface(*, cone=None, lane=None, forbidden=None, chosen=CHOICE, nominal=NOMINAL) -> DecisionSurface:
    """A bowl about (0.5, 0), and what is given, (V, W); where `forbidden` the total is infinite."""
    v, omega = np.meshgrid(V, OMEGA, indexing="ij")
    zero = np.zeros_like(v)
    goal = (v - 0.5) ** 2 + omega**2
    cone, lane = zero if cone is None else cone(v, omega), zero if lane is None else lane(v, omega)
    total = goal + cone + lane
    if forbidden is not None:
        total = np.where(forbidden(v, omega), np.inf, total)
    one = np.zeros(1)
    return DecisionSurface(
        v=V,
        omega=OMEGA,
        goal=goal,
        cone=cone[:, :, None],
        lane=np.stack([lane, zero], axis=-1),
        total=total,
        weighted=forbidden is None,
        decision=Decision(chosen[0], chosen[1], Status.OK),
        costs=CandidateCosts(one + nominal[0], one + nominal[1], one, one[:, None], np.zeros((1, 2)), one, 0),
        reachable=np.array([[0.2, -0.7], [0.5, 0.3]]),
    )


def pixels(figure) -> np.ndarray:
    """(height, width, 3) from 0 to 1."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3] / 255.0


def colour_at(picture, axes, v, omega) -> np.ndarray:
    x, y = axes.transData.transform((v, omega))
    return picture[picture.shape[0] - 1 - round(y), round(x)]


@pytest.mark.parametrize("chosen", [CHOICE, (1.0, 1.5), NOMINAL])
def test_the_chosen_control_is_where_its_speed_and_turn_rate_are(chosen):
    figure = decision_surface_figure(surface(chosen=chosen), "")
    picture = pixels(figure)
    for axes in figure.axes[:4]:
        assert colour_at(picture, axes, *chosen) == pytest.approx(to_rgb(CHOSEN["markerfacecolor"]), abs=0.02)
        assert colour_at(picture, axes, 0.5, 0.75) != pytest.approx(to_rgb(CHOSEN["markerfacecolor"]), abs=0.1)


def test_what_is_forbidden_is_grey_and_in_the_legend():
    figure = decision_surface_figure(surface(forbidden=lambda v, omega: v > 0.55), "")
    picture = pixels(figure)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["chosen", "nominal", "reachable in one period", "forbidden"]
    right = [colour_at(picture, figure.axes[TOTAL], 0.85, omega) for omega in np.linspace(-1.4, 0.6, 60)]
    assert np.ptp(right, axis=1).max() < 0.02  # no hue
    for grey in (FORBIDDEN["facecolor"], FORBIDDEN["edgecolor"]):
        assert min(np.abs(colour - to_rgb(grey)).max() for colour in right) < 0.05
    assert np.ptp(colour_at(picture, figure.axes[TOTAL], 0.1, 1.0)) > 0.1
    assert np.ptp(colour_at(picture, figure.axes[GOAL], 0.85, -1.0)) > 0.1
