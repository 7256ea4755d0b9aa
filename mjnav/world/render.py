"""Pictures of a scene without a screen: OpenGL context, camera, drawn model and renderer.

OpenGL comes from EGL or OSMesa, whichever is installed. The camera sees the whole scene. The stage is a model of the
scene with all its decoration, put into any state of either engine.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

import os
import subprocess
import sys
from functools import cache
from importlib import import_module
from math import tan
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.errors import InputError
from mjnav.messages import Array, WorldState
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import planned_legs
from mjnav.world import decoration
from mjnav.world.mujoco_engine import AWAY
from mjnav.world.scene import compose, scene_points

# -------------------------------------------------------------------------- OpenGL without a screen


BACKENDS = ("egl", "osmesa")  # EGL first: it may have a graphics card behind it
PROBE_TIMEOUT = 60.0  # [s]

_ADVICE = "on Debian install libegl1 and libgl1-mesa-dri, or libosmesa6"


def open_context(width: int, height: int) -> Any:
    """An OpenGL context of MuJoCo's, to be used within its `as_current()` and freed; `width` and `height` in pixels.

    The variable MUJOCO_GL may name egl or osmesa; otherwise it is what works. Raises InputError where nothing does.
    """
    backend = _backend(os.environ.get("MUJOCO_GL", "").lower())
    try:
        context = import_module(f"mujoco.{backend}").GLContext(width, height)
        with context.as_current():  # shows that it works; left current, it would keep a window from opening
            pass
    except Exception as error:  # which class depends on what is missing: library, driver or display
        raise InputError(f"cannot draw without a screen ({backend}): {error}; {_ADVICE}") from error
    return context


@cache
def _backend(asked: str) -> str:
    """The backend asked for, or else the first one with which another process can draw.

    A backend that fails leaves libraries loaded on which the next one fails, so each is tried in another process.
    """
    if asked in BACKENDS:
        return asked
    for backend in BACKENDS:
        code = f"from mujoco.{backend} import GLContext as C; c = C(8, 8); c.make_current(); c.free()"
        command = [sys.executable, "-P", "-c", code]
        probe = subprocess.run(command, capture_output=True, timeout=PROBE_TIMEOUT, check=False)
        if probe.returncode == 0:
            return backend
    raise InputError(f"cannot draw without a screen: neither EGL nor OSMesa works; {_ADVICE}")


# ------------------------------------------------------------------------------------------- camera


AZIMUTH, ELEVATION = 90.0, -50.0  # [deg] where the camera looks
_TALLEST = 1.7  # [m] a person's head


def overview(
    floor: Array, aspect: float, *, azimuth: float = AZIMUTH, elevation: float = ELEVATION
) -> mujoco.MjvCamera:
    """A camera just far enough away that everything above the points `floor` (n, 2) [m] is in the picture.

    `aspect` is the picture's width over its height; azimuth and elevation [deg] say where the camera looks.
    """
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


# -------------------------------------------------------------------------------------------- stage


FIELD_OF_VIEW = 0.6  # [rad] vertical
_QUICK = 2048, 4  # shadow map's side [pixels], samples a pixel; a third of the time a picture
_WALL = (0.95, 0.93, 0.88, 0.55)  # people behind a wall or below a table stay visible
_TABLE_TOP = (0.66, 0.45, 0.27, 0.55)


class Stage:
    """A model of the scenario that is drawn and not simulated. `model` and `data` are MuJoCo's."""

    def __init__(self, scenario: Scenario, *, size: tuple[int, int] = (640, 480), quick: bool = False):
        """`size` [pixels] is the largest picture that will be drawn off screen; `quick` drawing has coarser edges."""
        spec = compose(scenario)
        spec.visual.global_.offwidth, spec.visual.global_.offheight = size
        spec.visual.global_.fovy = float(np.degrees(FIELD_OF_VIEW))
        if quick:
            spec.visual.quality.shadowsize, spec.visual.quality.offsamples = _QUICK
        spec.material("wall").rgba = _WALL
        for i in range(len(scenario.tables)):
            spec.material(f"table{i}/wood").rgba = _TABLE_TOP
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._scenario = scenario

    def place(self, state: WorldState) -> None:
        """Puts robot and people where they are in `state`."""
        data = self.data
        x, y, heading = state.robot_pose
        half = 0.5 * heading
        data.time = state.time
        data.joint("robot/free").qpos = [x, y, 0.0, np.cos(half), 0.0, 0.0, np.sin(half)]
        positions = np.nan_to_num(state.people_position, nan=AWAY)  # out of the picture
        for i, (person, position) in enumerate(zip(self._scenario.people, positions, strict=True)):
            for axis, now, start in zip("xy", position, person.start, strict=True):
                data.joint(f"person{i}/{axis}").qpos = now - start
        mujoco.mj_forward(self.model, data)


# ----------------------------------------------------------------------------------------- renderer


_MAX_GEOMS = 20_000
LEGEND_SIDE = 400  # [pixels] of a picture, below which a legend would hide too much or be cut off
# what may be drawn -> its colour, and what it is
_LEGEND = (
    ("ways", "pale yellow", "people's ways around things"),
    ("trail", "orange", "its way so far"),
    ("plan", "black, red", "its plan; red where nothing is feasible"),
    ("fan", "violet to yellow", "what else it weighed, by cost"),
    ("tracks", "violet, dot", "people as believed, and in 1 s"),
    ("detections", "teal", "what the scan shows besides the map"),
    ("scan", "magenta", "where beams end"),
)


class Renderer:
    """Draws one picture after another from one place; a context manager.

    The camera looks down at an angle and is just far enough away that all that stands in the scene, and `floor`
    (n, 2) [m], is in the picture. Ways around things, of people who are there, are lines on the floor. `size` is
    (width, height) in pixels; `quick` drawing has coarser edges. Several may be used in turn, and beside a window.

    Raises InputError where OpenGL cannot draw without a screen.
    """

    def __init__(self, scenario: Scenario, floor: Array, *, size: tuple[int, int], quick: bool = False):
        width, height = size
        self._context = open_context(width, height)
        self._scenario = scenario
        legs = planned_legs(scenario)
        self._ways = [(leg.person, (leg.start, *leg.points)) for leg in legs if leg.in_the_way and leg.points]
        self._stage = Stage(scenario, size=size, quick=quick)
        model = self._stage.model
        points = np.concatenate([scene_points(scenario), floor])
        self._camera = overview(points, width / height)
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_GEOMS)
        with self._context.as_current():
            self._drawing = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        self._rectangle = mujoco.MjrRect(0, 0, width, height)

    def draw(
        self,
        state: WorldState,
        *,
        trail: ArrayLike | None = None,
        tracks: ArrayLike | None = None,
        text: str | None = None,
        coasts: ArrayLike | None = None,
        scan: ArrayLike | None = None,
        detections: ArrayLike | None = None,
        plan: ArrayLike | None = None,
        fan: ArrayLike | None = None,
        feasible: bool = True,
        legend: bool = False,
    ) -> NDArray[np.uint8]:
        """The scene at `state`: (height, width, 3) of uint8.

        `trail` (n, 2 or more) is a way to draw on the floor [m], `tracks` (P, 4) are where people are believed to be
        and to go, pale for those of whom nothing is seen, `coasts` (P,); `text` stands in the corner. `scan` (n, 2) are
        points at the lidar's height, and `detections` (n, 3) discs x, y, radius on the floor. `plan` (T, 2) is where
        the robot is to go, red unless `feasible`, with the robot at its end, and `fan` (F, T, 2) what else it weighed,
        cheapest first. A `legend` says what lines are, where the picture is LEGEND_SIDE wide and high.
        """
        scene, rectangle, drawing = self._scene, self._rectangle, self._drawing
        self._stage.place(state)
        everything = int(mujoco.mjtCatBit.mjCAT_ALL)
        model, data = self._stage.model, self._stage.data
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, self._camera, everything, scene)
        decoration.draw_route(scene, self._scenario)
        there = ~np.isnan(state.people_position[:, 0])
        ways = [way for person, way in self._ways if there[person]]
        decoration.draw_ways(scene, ways)
        if trail is not None:
            decoration.draw_trail(scene, trail)
        if tracks is not None:
            decoration.draw_tracks(scene, tracks, coasts)
        if scan is not None:
            decoration.draw_scan(scene, scan, self._scenario.sensors.scanner.height)
        if detections is not None:
            decoration.draw_detections(scene, detections)
        if fan is not None:
            decoration.draw_fan(scene, fan)
        if plan is not None:
            decoration.draw_plan(scene, plan, self._scenario.robot.limits.half_width, feasible=feasible)
        picture = np.empty((rectangle.height, rectangle.width, 3), np.uint8)
        with self._context.as_current():
            mujoco.mjr_render(rectangle, scene, drawing)
            if text is not None:
                font, corner = mujoco.mjtFont.mjFONT_NORMAL, mujoco.mjtGridPos.mjGRID_TOPLEFT
                mujoco.mjr_overlay(font, corner, rectangle, text, "", drawing)
            if legend and min(rectangle.width, rectangle.height) >= LEGEND_SIDE:
                given = {"ways": len(ways) or None, "trail": trail, "plan": plan, "fan": fan, "tracks": tracks,
                         "detections": detections, "scan": scan}  # fmt: skip
                rows = [row[1:] for row in _LEGEND if _is_drawn(given[row[0]])]
                colours, meanings = ("\n".join(column) for column in zip(("green", "goal"), *rows, strict=True))
                font, corner = mujoco.mjtFont.mjFONT_NORMAL, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT
                mujoco.mjr_overlay(font, corner, rectangle, colours, meanings, drawing)
            mujoco.mjr_readPixels(picture, None, rectangle, drawing)
        return np.ascontiguousarray(picture[::-1])  # OpenGL's rows go upwards

    def close(self) -> None:
        """Frees what OpenGL holds."""
        with self._context.as_current():
            self._drawing.free()
        self._context.free()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _is_drawn(given: ArrayLike | None) -> bool:
    return given is not None and bool(np.isfinite(given).any())


def render(
    scenario: Scenario, state: WorldState, *, size: tuple[int, int] = (1280, 720), **drawn: Any
) -> NDArray[np.uint8]:
    """One picture, with the robot and all people in it, and what is `drawn` besides; see `Renderer`."""
    there = ~np.isnan(state.people_position[:, 0])
    floor = np.concatenate([state.robot_pose[None, :2], state.people_position[there]])
    with Renderer(scenario, floor, size=size) as renderer:
        return renderer.draw(state, **drawn)
