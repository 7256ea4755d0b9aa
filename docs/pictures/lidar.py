"""The pictures of `method/lidar.md`: `python docs/pictures/lidar.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from mjnav.geometry.distances import placed
from mjnav.messages import Array, Reading
from mjnav.noise.profiles import profile
from mjnav.scene.sensors import LIDARS, LidarSpec
from mjnav.scene.spec import ConstantVelocity, Noise, Person, Physics, Pillar, Robot, Scenario, Sensors, Wall
from mjnav.world.simulator import Simulator

BLUE, VERMILION, GREY, GREEN, PURPLE = "#0072b2", "#d55e00", "#8a8a8a", "#009e73", "#cc79a7"
ROOM = ((-2.0, -1.5), (2.5, -1.5), (2.5, 1.8), (-2.0, 1.8))
TURNING = (0.0, 1.5)  # v [m/s], omega [rad/s]


def new_figure(width: float, height: float) -> Figure:
    """On white, so that it can be read on a dark page too."""
    return Figure(figsize=(width, height), dpi=110, layout="constrained", facecolor="white")


def scene(lidar: LidarSpec) -> Scenario:
    """A small room with a pillar and somebody who stands."""
    walls = tuple(Wall(corner, ROOM[(i + 1) % 4]) for i, corner in enumerate(ROOM))
    return Scenario(
        "lidar",
        Robot((0.0, 0.0, 0.0), (1.0, 1.0)),
        walls=walls,
        pillars=(Pillar((-1.0, 0.8)),),
        people=(Person((1.3, -0.2), ConstantVelocity((0.0, 0.0))),),
        noise=Noise("pearson"),
        physics=Physics("kinematic"),
        sensors=Sensors(lidar=lidar),
    )


def ends(pose: Array, angles: Array, ranges: Array) -> Array:
    """Where beams that met something end, (n, 2)."""
    met = np.isfinite(ranges)
    headings = pose[2] + angles[met]
    return pose[:2] + ranges[met, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)


def latest(scenario: Scenario) -> tuple[Reading, list[tuple[float, Array]]]:
    """The latest scan of a robot that turns, and its true poses every 2 ms."""
    simulator, poses, found = Simulator(scenario, 4), [], None
    for _ in range(600):
        poses.append((simulator.time, simulator.state().robot_pose))
        simulator.advance(0.002, TURNING)
        found = next((reading for reading in simulator.sense() if reading.scan.size), found)
    assert found is not None
    return found, poses


def room(axes: Axes, scenario: Scenario) -> None:
    """The truth in grey."""
    (x, y), (right, top) = ROOM[0], ROOM[2]
    axes.add_patch(Rectangle((x + 0.05, y + 0.05), right - x - 0.1, top - y - 0.1, fill=False, color=GREY, linewidth=1))
    for disc in (*scenario.pillars, *scenario.people):
        centre = disc.start if isinstance(disc, Person) else disc.position
        axes.add_patch(Circle(centre, disc.radius, fill=False, color=GREY, linewidth=1))
    axes.plot(0.0, 0.0, "k.", markersize=4)
    axes.set(aspect="equal", xlim=(x - 0.4, right + 0.4), ylim=(y - 0.3, top + 0.5))
    axes.set_axis_off()


def errors() -> Figure:
    """Bias and two standard deviations by range."""
    figure = new_figure(9.0, 2.4)
    law = profile("pearson")["lidar.range"]
    names = [name for name, model in LIDARS.items() if model.rate is not None]
    for axes, name, colour in zip(figure.subplots(1, 4), names, (BLUE, VERMILION, GREEN, PURPLE), strict=True):
        lidar = Sensors(lidar=LidarSpec(name)).scanner
        ranges = np.linspace(lidar.min_range, min(lidar.max_range, 12.0), 500)
        bias, std = 1e3 * lidar.bias(ranges, law), 1e3 * lidar.std(ranges, law)
        axes.fill_between(ranges, bias - 2.0 * std, bias + 2.0 * std, color=colour, alpha=0.25, linewidth=0)
        axes.plot(ranges, bias, color=colour, linewidth=1.4)
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        axes.set_title(name, fontsize=9)
        axes.set_xlabel("range [m]", fontsize=8)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    figure.axes[0].set_ylabel("error [mm]", fontsize=8)
    return figure


def scans() -> Figure:
    """One turn of a robot that turns, as the points are where all beams are taken at once, and with each one's pose."""
    figure = new_figure(9.0, 3.0)
    scenario = scene(LidarSpec("lds-01", mixed=0.0, missing=0.0, bias=0.0))
    lidar = scenario.sensors.scanner
    reading, poses = latest(scenario)
    times = np.array([time for time, _ in poses])
    then = np.array([poses[int(np.argmin(np.abs(times - time)))][1] for time in reading.scan_times])
    last = then[-1]
    undone = np.concatenate(
        [ends(pose, lidar.angles[[i]], reading.scan[[i]]) for i, pose in enumerate(then)]  # each from its own pose
    )
    left, middle, right = figure.subplots(1, 3)
    for axes, points, title in (
        (left, ends(last, lidar.angles, reading.scan), "lds-01, robot turns at 1.5 rad/s"),
        (middle, undone, "the same, each beam from its own pose"),
    ):
        room(axes, scenario)
        axes.plot(*points.T, ".", color=BLUE, markersize=2.5)
        axes.set_title(title, fontsize=9)
    edges = scene(LidarSpec("utm-30lx", mixed=1.0, beam_width=0.01, missing=0.0, bias=0.0))
    ranges = Simulator(edges, 2).sense()[0].scan
    room(right, edges)
    pose = placed(np.zeros(3), edges.sensors.scanner.mount)
    right.plot(*ends(pose, edges.sensors.scanner.angles, ranges).T, ".", color=VERMILION, markersize=2.0)
    right.set_title("utm-30lx at rest: mixed pixels at edges", fontsize=9)
    return figure


def main(folder: Path) -> None:
    """Writes the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for draw in (errors, scans):
        draw().savefig(folder / f"lidar-{draw.__name__}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
