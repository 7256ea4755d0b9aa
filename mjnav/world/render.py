"""A picture of a scene without a screen, for reports and the README."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

import os
from importlib import import_module
from itertools import pairwise
from math import tan
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.errors import InputError
from mjnav.messages import Array, WorldState
from mjnav.scenarios.spec import Scenario
from mjnav.world.scene import compose, scene_points

FIELD_OF_VIEW = 0.6  # [rad] vertical
_TALLEST = 1.7  # [m] a person's head
_MAX_GEOMS = 20_000
_WALL = (0.95, 0.93, 0.88, 0.55)  # who stands behind one is seen
_TRAIL, _GOAL, _LEFT, _RIGHT = (
    (0.95, 0.42, 0.08, 1.0),
    (0.16, 0.65, 0.35, 0.9),
    (0.85, 0.2, 0.2, 0.8),
    (0.2, 0.4, 0.85, 0.8),
)


def render(
    scenario: Scenario,
    state: WorldState,
    *,
    size: tuple[int, int] = (1280, 720),
    azimuth: float = 90.0,
    elevation: float = -50.0,
    trail: ArrayLike | None = None,
) -> NDArray[np.uint8]:
    """The scene at `state`, seen from above at an angle and filling the picture: (height, width, 3) of uint8.

    `size` is (width, height) in pixels; azimuth and elevation [deg] say where the camera looks; `trail` (n, 2 or more)
    is a way to draw on the floor [m]. Raises InputError where OpenGL cannot draw without a screen.
    """
    width, height = size
    spec = compose(scenario)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.global_.fovy = float(np.degrees(FIELD_OF_VIEW))
    spec.material("wall").rgba = _WALL
    model = spec.compile()
    data = mujoco.MjData(model)
    _place(model, data, scenario, state)
    camera = _camera(scenario, state, width / height, azimuth, elevation)
    scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
    everything = int(mujoco.mjtCatBit.mjCAT_ALL)
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, everything, scene)
    _draw_route(scene, scenario)
    if trail is not None:
        for start, end in pairwise(np.asarray(trail, float)[:, :2]):
            _draw_line(scene, start, end, 0.03, _TRAIL)
    context = _open_context(width, height)
    try:
        drawing = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
        rectangle, picture = mujoco.MjrRect(0, 0, width, height), np.empty((height, width, 3), np.uint8)
        mujoco.mjr_render(rectangle, scene, drawing)
        mujoco.mjr_readPixels(picture, None, rectangle, drawing)
        drawing.free()
    finally:
        context.free()
    return np.ascontiguousarray(picture[::-1])  # OpenGL's rows go upwards


def _open_context(width: int, height: int) -> Any:
    """An OpenGL context without a screen: EGL, or what the variable MUJOCO_GL names.

    `mujoco.Renderer` chooses when mujoco is imported, and takes a screen for granted.
    """
    backend = os.environ.get("MUJOCO_GL", "").lower()
    backend = backend if backend in ("egl", "glfw", "osmesa") else "egl"
    try:
        context = import_module(f"mujoco.{backend}").GLContext(width, height)
        context.make_current()
    except Exception as error:  # which class depends on what is missing: library, driver or display
        raise InputError(
            f"cannot draw without a screen ({backend}): {error}; on Debian install libegl1 and libgl1-mesa-dri, "
            "or install libosmesa6 and set MUJOCO_GL=osmesa"
        ) from error
    return context


def _place(model: mujoco.MjModel, data: mujoco.MjData, scenario: Scenario, state: WorldState) -> None:
    x, y, heading = state.robot_pose
    half = 0.5 * heading
    data.joint("robot/free").qpos = [x, y, 0.0, np.cos(half), 0.0, 0.0, np.sin(half)]
    for i, (person, position) in enumerate(zip(scenario.people, state.people_position, strict=True)):
        for axis, now, start in zip("xy", position, person.start, strict=True):
            data.joint(f"person{i}/{axis}").qpos = now - start
    mujoco.mj_forward(model, data)


def _camera(scenario: Scenario, state: WorldState, aspect: float, azimuth: float, elevation: float) -> mujoco.MjvCamera:
    """A camera just far enough away that everything between floor and heads is in the picture."""
    floor = np.concatenate([scene_points(scenario), state.robot_pose[None, :2], state.people_position])
    low, high = floor.min(0) - 0.3, floor.max(0) + 0.3
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0.0, _TALLEST)])
    a, e = np.radians(azimuth), np.radians(elevation)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    up = np.cross(right, ahead)
    tan_y = tan(0.5 * FIELD_OF_VIEW)
    tan_x = tan_y * aspect
    centre, distance = corners.mean(0), 0.0
    # Moving the centre along the picture's height until the room above and below is equal.
    for _ in range(20):
        offset = corners - centre
        depth, x, y = offset @ ahead, offset @ right, offset @ up
        distance = float(np.max(np.maximum(np.abs(x) / tan_x, np.abs(y) / tan_y) - depth))
        seen = y / (distance + depth)
        centre = centre + 0.5 * (seen.max() + seen.min()) * distance * up
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat, camera.azimuth, camera.elevation, camera.distance = centre, azimuth, elevation, 1.02 * distance
    return camera


def _draw_route(scene: mujoco.MjvScene, scenario: Scenario) -> None:
    for x, y in scenario.robot.route:
        _draw(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, [scenario.robot.goal_tolerance, 0.004, 0.0], [x, y, 0.004], _GOAL)
    if scenario.lanes is None:
        return
    points = scene_points(scenario)
    centre, reach = points.mean(0), float(np.hypot(*np.ptp(points, axis=0))) * 0.5 + 1.0
    for (a, b, c), colour in ((scenario.lanes.left, _LEFT), (scenario.lanes.right, _RIGHT)):
        normal = np.array([a, b]) / np.hypot(a, b)
        foot = centre - (normal @ centre + c / np.hypot(a, b)) * normal
        along = np.array([-normal[1], normal[0]])
        _draw_line(scene, foot - reach * along, foot + reach * along, 0.02, colour)


def _draw_line(scene: mujoco.MjvScene, start: Array, end: Array, radius: float, colour: tuple[float, ...]) -> None:
    geom = _draw(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, [radius] * 3, [0.0] * 3, colour)
    if geom is not None:
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, radius, [*start, 0.01], [*end, 0.01])


def _draw(
    scene: mujoco.MjvScene, kind: int, size: list[float], position: list[float], colour: tuple[float, ...]
) -> mujoco.MjvGeom | None:
    """Adds a geom for the eye only; None where the scene is full."""
    if scene.ngeom >= scene.maxgeom:
        return None
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, np.array(size), np.array(position), np.eye(3).ravel(), np.array(colour, np.float32))
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    scene.ngeom += 1
    return geom
