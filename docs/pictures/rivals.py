"""The picture of `method/rivals.md`, from the methods that run: `python docs/pictures/rivals.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mjnav
from mjnav.control import make_controller
from mjnav.control.base import GridController
from mjnav.control.decision_surface import decision_surface
from mjnav.control.registry import METHODS
from mjnav.loop.run import record_at
from mjnav.messages import Array, Observation, RobotLimits

SCENE, SEED, TIME = "crossing3", 3, 0.4
NUM = 41  # of speeds and of turn rates


def shown(axes: Axes, name: str, observation: Observation, limits: RobotLimits, period: float) -> None:
    """Total cost by rank over (v, omega); white where it is forbidden; the chosen control."""
    controller = make_controller(name, limits, period)
    decision = controller.decide(observation)
    if isinstance(controller, GridController):
        surface = decision_surface(controller, observation, decision, num=NUM)
        axes.pcolormesh(surface.omega, surface.v, by_rank(surface.total), cmap="viridis_r", shading="nearest")
        (low_v, low_w), (high_v, high_w) = surface.reachable
        axes.plot(
            [low_w, high_w, high_w, low_w, low_w], [low_v, low_v, high_v, high_v, low_v], color="k", linewidth=0.8
        )
    else:
        costs = decision.costs
        if costs is not None:
            order = np.argsort(costs.total)[::-1]
            axes.scatter(costs.omega[order], costs.v[order], c=np.linspace(1.0, 0.0, len(order)), cmap="viridis_r", s=5)
    axes.plot(decision.omega, decision.v, "o", color="#d55e00", markeredgecolor="white", markersize=6)
    axes.set_title(name, fontsize=8)
    axes.set(xlim=(-limits.max_turn_rate, limits.max_turn_rate), ylim=(0.0, limits.max_speed))
    axes.tick_params(labelsize=6)
    axes.label_outer()


def by_rank(total: Array) -> Array:
    """Shares of the finite costs that are lower; NaN where infinite."""
    flat, out = total.ravel(), np.full(total.size, np.nan)
    finite = np.flatnonzero(np.isfinite(flat))
    out[finite[np.argsort(flat[finite])]] = np.linspace(0.0, 1.0, finite.size)
    return out.reshape(total.shape)


def decisions() -> Figure:
    """What every method makes of one moment."""
    scenario = mjnav.load_scenario(SCENE, seed=SEED)
    observation = record_at(scenario, TIME).seen
    figure = Figure(figsize=(9.0, 5.2), dpi=110, layout="constrained", facecolor="white")
    grid = figure.subplots(3, 5, sharex=True, sharey=True)
    for axes, name in zip(grid.flat, METHODS, strict=True):
        shown(axes, name, observation, scenario.robot.limits, scenario.control.period)
    figure.supxlabel("ω [rad/s]", fontsize=8)
    figure.supylabel("v [m/s]", fontsize=8)
    return figure


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    decisions().savefig(folder / "rivals-decisions.png")
