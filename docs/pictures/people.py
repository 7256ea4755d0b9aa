"""The picture of `method/people.md`, from the world that runs: `python docs/pictures/people.py FOLDER`."""

import sys
from collections.abc import Sequence
from math import cos, pi, sin
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mjnav.messages import Array
from mjnav.scene.spec import Orca, Person, Robot, Scenario, SocialForce, Wall
from mjnav.world.simulator import Simulator

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#f0e442", "#8a8a8a")
LAWS = {
    "social_force, moussaid_2009": lambda goal: SocialForce(waypoints=(goal,), speed=1.2, loop=False),
    "social_force, helbing": lambda goal: SocialForce(waypoints=(goal,), speed=1.2, loop=False, form="helbing"),
    "orca": lambda goal: Orca(waypoints=(goal,), speed=1.2, loop=False),
}
CIRCLE = tuple(((4.0 * cos(a), 4.0 * sin(a)), (-4.0 * cos(a), -4.0 * sin(a))) for a in np.arange(8) * pi / 4)
DOOR = (*(((-3.0, y), (3.5, y)) for y in (-1.0, 0.0, 1.0)), ((3.0, 0.4), (-3.5, 0.4)))
WALLS = (Wall((0.0, -2.6), (0.0, -0.6)), Wall((0.0, 0.6), (0.0, 2.6)))


def walked(people: Sequence[Person], walls: Sequence[Wall]) -> Array:
    """Positions every 0.1 s of 14 s, (T, P, 2) [m]; the robot is far away."""
    robot = Robot(start=(0.0, 90.0, 0.0), goal=(0.0, 95.0))
    scenario = Scenario("people", robot, walls=tuple(walls), people=tuple(people))
    simulator, found = Simulator(scenario, 0, lidar=False), []
    for _ in range(140):
        simulator.advance(0.1, (0.0, 0.0))
        found.append(simulator.state().people_position)
    return np.array(found)


def draw(axes: Axes, people: Sequence[Person], walls: Sequence[Wall], positions: Array) -> None:
    """The ways, with the bodies every 2 s."""
    for i, (person, colour) in enumerate(zip(people, COLOURS, strict=False)):
        axes.plot(*positions[:, i].T, color=colour, linewidth=1.2)
        axes.plot(*person.start, "o", color=colour, markersize=3)
        for place in positions[20:80:20, i]:
            axes.add_patch(Circle(place, person.radius, facecolor=colour, alpha=0.25, edgecolor="none"))
    for wall in walls:
        axes.plot(*zip(wall.start, wall.end, strict=True), color="#444444", linewidth=3.0)
    axes.set(aspect="equal", xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set_visible(False)


def ways() -> Figure:
    """Three laws, two scenes."""
    figure = Figure(figsize=(9.0, 5.2), dpi=110, layout="constrained", facecolor="white")
    grid = figure.subplots(2, 3, height_ratios=(4.6, 3.0))
    for column, (title, law) in zip(grid.T, LAWS.items(), strict=True):
        column[0].set_title(title, fontsize=9)
        for axes, trips, walls in zip(column, (CIRCLE, DOOR), ((), WALLS), strict=True):
            people = [Person(start, law(goal)) for start, goal in trips]
            draw(axes, people, walls, walked(people, walls))
    return figure


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    ways().savefig(folder / "people-ways.png")
