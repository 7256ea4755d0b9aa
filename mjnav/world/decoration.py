"""What a scene shows that has no physics: goal, lanes, the robot's path and plan, beliefs, what the lidar sees."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import hypot

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Scenario
from mjnav.world.scene import scene_points

TRAIL_STEP = 0.04  # [m] below which two points of a trail are one
POINT = 0.02  # [m] half the side of a point of a scan
FAN_STRIDE = 3  # steps of a rollout from corner to corner
PREVIEW = 1.0  # [s] that a believed velocity is drawn ahead

_ORANGE, _GREEN, _RED, _BLUE, _VIOLET, _PALE, _MAGENTA, _TEAL = (
    (0.95, 0.42, 0.08, 1.0),
    (0.16, 0.65, 0.35, 0.9),
    (0.85, 0.2, 0.2, 0.8),
    (0.2, 0.4, 0.85, 0.8),
    (0.45, 0.15, 0.6, 1.0),
    (0.97, 0.9, 0.6, 0.8),
    (0.85, 0.05, 0.55, 1.0),
    (0.0, 0.6, 0.6, 0.6),
)


_BLACK, _BAD = (0.08, 0.08, 0.1, 1.0), (0.85, 0.1, 0.1, 1.0)
_COSTS = (  # red, green, blue from the cheapest rollout to the costliest
    (0.267, 0.005, 0.329),
    (0.230, 0.322, 0.546),
    (0.128, 0.567, 0.551),
    (0.369, 0.789, 0.383),
    (0.993, 0.906, 0.144),
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


def draw_tracks(scene: mujoco.MjvScene, tracks: ArrayLike, coasts: ArrayLike | None = None) -> None:
    """Where people are believed to walk within PREVIEW: means (P, 4) x, y, vx, vy; NaN for who has no track.

    A track that `coasts` (P,) is pale.
    """
    tracks = np.asarray(tracks, float)
    pale = np.zeros(len(tracks), bool) if coasts is None else np.asarray(coasts, bool)
    for (x, y, vx, vy), is_pale in zip(tracks, pale, strict=True):
        start, end = np.array([x, y]), np.array([x + PREVIEW * vx, y + PREVIEW * vy])
        if np.isfinite(end).all():
            colour = (*_VIOLET[:3], 0.35) if is_pale else _VIOLET
            _draw_band(scene, start, end, 0.03, colour)
            _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [0.09, 0.004, 0.0], [*end, 0.006], colour)


def draw_scan(scene: mujoco.MjvScene, points: ArrayLike, height: float) -> None:
    """Where beams end, (n, 2) [m], at the `height` [m] of the lidar."""
    for x, y in np.asarray(points, float):
        _draw(scene, mujoco.mjtGeom.mjGEOM_BOX, [POINT, POINT, POINT], [x, y, height], _MAGENTA)


def draw_detections(scene: mujoco.MjvScene, discs: ArrayLike) -> None:
    """Detected bodies (n, 3) x, y, radius [m] as discs on the floor."""
    for x, y, radius in np.asarray(discs, float):
        _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, 0.002, 0.0], [x, y, 0.004], _TEAL)


def draw_fan(scene: mujoco.MjvScene, fan: ArrayLike) -> None:
    """Rollouts (F, T, 2) [m], cheapest first, as thin lines on the floor from dark violet to yellow."""
    ways = np.asarray(fan, float)[:, ::FAN_STRIDE]
    for number, way in enumerate(ways):
        low, share = divmod(number / max(1, len(ways) - 1) * (len(_COSTS) - 1), 1.0)
        between = np.array(_COSTS[int(low) : int(low) + 2])
        red, green, blue = between[0] + share * (between[-1] - between[0])
        for start, end in pairwise(way):
            _draw_band(scene, start, end, 0.008, (red, green, blue, 0.8))


def draw_plan(scene: mujoco.MjvScene, plan: ArrayLike, radius: float, *, feasible: bool) -> None:
    """A plan (T, 2) [m] as a band with a dot a step, and the robot at its end; red where it is not feasible."""
    path, colour = np.asarray(plan, float), _BLACK if feasible else _BAD
    for start, end in pairwise(path):
        _draw_band(scene, start, end, 0.018, colour)
    for x, y in path:
        _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [0.032, 0.004, 0.0], [x, y, 0.006], colour)
    for x, y in path[-1:]:
        _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, 0.002, 0.0], [x, y, 0.003], (*colour[:3], 0.3))


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
