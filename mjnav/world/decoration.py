"""What is drawn on the floor of a scene and has no physics: the goal, lanes, the robot's path, beliefs."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import hypot

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario
from mjnav.world.scene import scene_points

TRAIL_STEP = 0.04  # [m] below which two points of a trail are one
PREVIEW = 1.0  # [s] that a believed velocity is drawn ahead

_ORANGE, _GREEN, _RED, _BLUE, _VIOLET, _PALE = (
    (0.95, 0.42, 0.08, 1.0),
    (0.16, 0.65, 0.35, 0.9),
    (0.85, 0.2, 0.2, 0.8),
    (0.2, 0.4, 0.85, 0.8),
    (0.45, 0.15, 0.6, 1.0),
    (0.97, 0.9, 0.6, 0.8),
)


def draw_route(scene: mujoco.MjvScene, scenario: Scenario) -> None:
    """The goal and the way points before it as discs, and the lanes: the left one red, the right one blue."""
    for x, y in scenario.robot.route:
        _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [scenario.robot.goal_tolerance, 0.004, 0.0], [x, y, 0.004], _GREEN)
    if scenario.lanes is None:
        return
    points = scene_points(scenario)
    centre, reach = points.mean(0), float(np.hypot(*np.ptp(points, axis=0))) * 0.5 + 1.0
    for (a, b, c), colour in ((scenario.lanes.left, _RED), (scenario.lanes.right, _BLUE)):
        normal = np.array([a, b]) / np.hypot(a, b)
        foot = centre - (normal @ centre + c / np.hypot(a, b)) * normal
        along = np.array([-normal[1], normal[0]])
        _draw_band(scene, foot - reach * along, foot + reach * along, 0.02, colour)


def draw_trail(scene: mujoco.MjvScene, trail: ArrayLike) -> None:
    """A way (n, 2 or more) [m] as a band."""
    points = np.asarray(trail, float)[:, :2]
    kept = list(points[:1])
    for point in points[1:]:
        if hypot(*(point - kept[-1])) >= TRAIL_STEP:
            kept.append(point)
    for start, end in pairwise(kept):
        _draw_band(scene, start, end, 0.03, _ORANGE)


def draw_ways(scene: mujoco.MjvScene, ways: Iterable[Sequence[Point]]) -> None:
    """Ways of people that bend around something, as thin lines."""
    for way in ways:
        for start, end in pairwise(np.array(way)):
            _draw_band(scene, start, end, 0.012, _PALE)


def draw_tracks(scene: mujoco.MjvScene, tracks: ArrayLike) -> None:
    """Where people are believed to walk within PREVIEW: means (P, 4) x, y, vx, vy; NaN for who has no track."""
    for x, y, vx, vy in np.asarray(tracks, float):
        start, end = np.array([x, y]), np.array([x + PREVIEW * vx, y + PREVIEW * vy])
        if np.isfinite(end).all():
            _draw_band(scene, start, end, 0.03, _VIOLET)
            _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [0.09, 0.004, 0.0], [*end, 0.006], _VIOLET)


def _draw_band(scene: mujoco.MjvScene, start: Array, end: Array, half_width: float, colour: tuple[float, ...]) -> None:
    """A flat box along the floor: a twentieth of a capsule's cost, of which a trail has hundreds."""
    along = end - start
    length = hypot(*along)
    if length > 0.0:
        (x, y), (c, s) = 0.5 * (start + end), along / length
        turned = [c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0]
        size = [0.5 * length + 0.3 * half_width, half_width, 0.002]  # longer, so that bends have no gaps
        _draw(scene, mujoco.mjtGeom.mjGEOM_BOX, size, [x, y, 0.005], colour, turned)


def _draw(
    scene: mujoco.MjvScene,
    kind: int,
    size: list[float],
    position: list[float],
    colour: tuple[float, ...],
    rotation: ArrayLike = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
) -> None:
    """Adds a geom, unless the scene is full."""
    if scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom, kind, np.array(size), np.array(position), np.array(rotation), np.array(colour, np.float32)
    )
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1
