"""The picture of `method/figures.md`, from a run: `python docs/pictures/figures.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import mjnav
from mjnav.loop.result import Result
from mjnav.messages import Array, WorldState
from mjnav.metrics.effort import STALLED_SPEED
from mjnav.metrics.social import INTIMATE, PERSONAL
from mjnav.scene.spec import Scenario

SCENE, SEED, CONTROLLER = "crossing3", 3, "rkhs-plan"
ROBOT, PERSON = "#0072b2", "#d55e00"
SPACES = ((INTIMATE, "intimate_space_share", "#e69f00"), (PERSONAL, "personal_space_share", "#f0e442"))


def surfaces(scenario: Scenario, robot: Array, people: Array) -> Array:
    """Distances of every person's surface from the robot's, (T, P) [m]."""
    radii = np.array([person.radius for person in scenario.people])
    return np.hypot(*np.moveaxis(people - robot[:, None, :2], -1, 0)) - radii - scenario.robot.limits.radius


def places(axes: Axes, scenario: Scenario, result: Result, robot: Array, people: Array, distance: Array) -> None:
    """The ways; the nearest moment, with the spaces about the robot; deviation as an area."""
    radius = scenario.robot.limits.radius
    start, goal = robot[0, :2], np.array(scenario.robot.route[-1])
    along = (goal - start) / np.hypot(*(goal - start))
    feet = start + ((robot[:, :2] - start) @ along)[:, None] * along
    area = np.concatenate([robot[:, :2], feet[::-1]])
    axes.fill(*area.T, color="#d8d8d8", label=f"mean_deviation_m = {result.summary['mean_deviation_m']:.2f}")
    straight = result.summary["straight_line_m"]
    axes.plot(*np.stack([start, goal]).T, "k--", linewidth=0.8, label=f"straight_line_m = {straight:.2f}")
    axes.plot(*robot[:, :2].T, color=ROBOT, label=f"path_length_m = {result.summary['path_length_m']:.2f}")
    when, who = np.unravel_index(np.argmin(distance), distance.shape)
    here = robot[when, :2]
    for i, person in enumerate(scenario.people):
        axes.plot(*people[:, i].T, color=PERSON, linewidth=0.6)
        axes.add_patch(Circle(tuple(people[when, i]), person.radius, color=PERSON, linewidth=0.0))
    for space, _, colour in reversed(SPACES):
        axes.add_patch(Circle(tuple(here), radius + space, facecolor=colour, alpha=0.4, zorder=0.5))
    axes.add_patch(Circle(tuple(here), radius, color=ROBOT, zorder=3.0))
    towards = (people[when, who] - here) / np.hypot(*(people[when, who] - here))
    gap = here + np.outer([radius, radius + distance[when, who]], towards)
    axes.plot(*gap.T, "k-", linewidth=2.0, label=f"min_human_distance_m = {distance[when, who]:.2f}")
    low, high = robot[:, :2].min(axis=0) - 1.6, robot[:, :2].max(axis=0) + 1.6
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")


def times(near: Axes, fast: Axes, result: Result, states: list[WorldState], nearest: Array) -> None:
    """The nearest person's distance, with the spaces; the speed, and below what the robot counts as stalled."""
    time = np.array([state.time for state in states])
    low = 0.0
    for space, name, colour in SPACES:
        near.axhspan(low, space, color=colour, alpha=0.4, label=f"{name} = {result.summary[name]:.2f}")
        low = space
    near.plot(time, nearest, color=PERSON)
    near.set(ylabel="nearest person [m]", ylim=(0.0, 3.0), xlim=(0.0, time[-1]))
    near.legend(fontsize=8, loc="upper right")
    stalled = f"stalled_s = {result.summary['stalled_s']:.1f}"
    fast.axhspan(-STALLED_SPEED, STALLED_SPEED, color="#cc79a7", alpha=0.4, label=stalled)
    fast.plot(time, [state.robot_twist[0] for state in states], color=ROBOT)
    fast.set(xlabel=f"t [s]; time_s = {result.summary['time_s']:.1f}", ylabel="speed [m/s]", xlim=(0.0, time[-1]))
    fast.legend(fontsize=8, loc="upper right")


def measured() -> Figure:
    """One run, and its figures."""
    states: list[WorldState] = []
    scenario = mjnav.load_scenario(SCENE, {"physics.engine": "kinematic"}, seed=SEED, controller=CONTROLLER)
    result = mjnav.run(scenario, watch=lambda record: states.append(record.truth))
    robot = np.array([state.robot_pose for state in states])
    people = np.array([state.people_position for state in states])
    distance = surfaces(scenario, robot, people)
    figure = Figure(figsize=(9.0, 4.2), dpi=110, layout="constrained", facecolor="white")
    axes = figure.subplot_mosaic([["places", "near"], ["places", "fast"]], width_ratios=(1.25, 1.0))
    places(axes["places"], scenario, result, robot, people, distance)
    figure.legend(*axes["places"].get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize=8)
    times(axes["near"], axes["fast"], result, states, distance.min(axis=1))
    return figure


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    measured().savefig(folder / "figures-run.png")
