"""The picture of `method/planning.md`, from the planner that runs: `python docs/pictures/planning.py FOLDER`."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import mjnav
from mjnav.control import make_controller
from mjnav.control.planner import Weighed
from mjnav.control.problem.problem import Problem
from mjnav.loop.run import record_at
from mjnav.messages import Observation

BLUE, VERMILION, GREY, GREEN = "#0072b2", "#d55e00", "#8a8a8a", "#009e73"
SCENE, SEED, TIME = "crossing3", 3, 3.4


def weighed(observation: Observation) -> tuple[Problem, Weighed, int]:
    """A decision's problem, its rollouts with all that they cost, and which is followed."""
    scenario = mjnav.load_scenario(SCENE, controller="rkhs-plan", seed=SEED)
    controller: Any = make_controller("rkhs-plan", scenario.robot.limits, scenario.control.period)
    kept: list[Weighed] = []
    weigh = controller.weigh
    controller.weigh = lambda *given: kept.append(weigh(*given)) or kept[-1]
    controller.decide(observation)
    found, feasible = kept[0], kept[0].risks.contact <= controller.parameters.risk_bound
    return controller.problem(observation), found, int(np.where(feasible, found.total, np.inf).argmin())


def map_of(axes: Axes, problem: Problem, found: Weighed, shown: list[tuple[int, str]]) -> None:
    """The rollouts by the rank of their cost, the people's samples in 2 s, and the shown ones."""
    o, mean = problem.observation, problem.mean_pose[:2]
    order = np.argsort(found.total)[::-1]
    rank = np.linspace(1.0, 0.0, len(order))
    for k, share in zip(order[::2], rank[::2], strict=True):
        colour = (0.85 * min(1.0, 2.0 * share), 0.8 * min(1.0, 2.0 - 2.0 * share), 0.15, 0.35)
        axes.plot(mean[0] + found.rollouts.x[:, k], mean[1] + found.rollouts.y[:, k], color=colour, linewidth=0.5)
    for body in o.obstacles:
        if body.velocity.any():
            later = body.position + 2.0 * body.velocity
            axes.plot(*later.T, ".", color=VERMILION, markersize=2.0, alpha=0.6)
            axes.add_patch(Circle(body.position.mean(axis=0), body.radius, facecolor=VERMILION, alpha=0.75))
    axes.add_patch(Circle(mean, problem.limits.radius, facecolor=BLUE))
    for k, colour in shown:
        axes.plot(mean[0] + found.rollouts.x[:, k], mean[1] + found.rollouts.y[:, k], color=colour, linewidth=2.2)
    axes.set(aspect="equal", xlim=(mean[0] - 0.8, mean[0] + 3.9), ylim=(mean[1] - 2.3, mean[1] + 2.3))
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(f"{len(order)} rollouts, cheap (green) to costly (red)", fontsize=9)


def rollouts() -> Figure:
    """The rollouts of a decision, and the violation under three of them beside the target."""
    problem, found, followed = weighed(
        record_at(mjnav.load_scenario(SCENE, controller="rkhs-plan", seed=SEED), TIME).seen
    )
    rushing, h = int(found.goal.argmin()), found.risks.violation
    middle = int(np.abs(found.risks.cost - 0.5 * found.risks.cost[rushing]).argmin())
    shown = [(rushing, VERMILION), (middle, "#b38b00"), (followed, "#222222")]
    names = ("least other cost", "half of its risk", "the plan that is followed")
    figure = Figure(figsize=(9.0, 4.0), dpi=110, layout="constrained", facecolor="white")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.25, 1.0))
    map_of(figure.add_subplot(grid[:, 0]), problem, found, shown)
    for row, ((k, colour), name) in enumerate(zip(shown, names, strict=True)):
        axes = figure.add_subplot(grid[row, 1])
        axes.axvspan(1.0, 2.0, color="#f3c9b5", linewidth=0.0)
        axes.hist(h[k], np.linspace(0.0, 2.0, 41), color=colour, weights=np.full(h.shape[1], 100.0 / h.shape[1]))
        axes.axvline(0.0, color=GREEN, linewidth=3.0)
        axes.set_title(f"{name}: λ MMD = {found.risks.cost[k]:.2f}, the rest {found.goal[k]:.2f}", fontsize=8)
        axes.set(xlim=(-0.03, 2.0), ylim=(0.0, 100.0), yticks=(0, 50, 100))
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=7)
        axes.label_outer()
    figure.axes[-1].set_xlabel("h: a contact where above 1; target: all at 0 (green)", fontsize=8)
    return figure


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    rollouts().savefig(folder / "planning-rollouts.png")
