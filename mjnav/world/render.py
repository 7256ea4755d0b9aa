"""Pictures of a scene without a screen."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.messages import Array, WorldState
from mjnav.scenarios.routes import planned_legs
from mjnav.scenarios.spec import Scenario
from mjnav.world.camera import AZIMUTH, ELEVATION, overview
from mjnav.world.decoration import (
    draw_detections,
    draw_fan,
    draw_plan,
    draw_route,
    draw_scan,
    draw_tracks,
    draw_trail,
    draw_ways,
)
from mjnav.world.offscreen import open_context
from mjnav.world.scene import scene_points
from mjnav.world.stage import Stage

_MAX_GEOMS = 20_000


class Renderer:
    """Draws one picture after another from one place; a context manager.

    The camera looks down at an angle and is just far enough away that all that stands in the scene, and `floor`
    (n, 2) [m], is in the picture. Ways around things, of people who are there, are lines on the floor. `size` is
    (width, height) in pixels; azimuth and elevation [deg] say where the camera looks; `quick` drawing has coarser
    edges. Several may be used in turn, and beside a window.

    Raises InputError where OpenGL cannot draw without a screen.
    """

    def __init__(
        self,
        scenario: Scenario,
        floor: Array,
        *,
        size: tuple[int, int],
        azimuth: float = AZIMUTH,
        elevation: float = ELEVATION,
        quick: bool = False,
    ):
        width, height = size
        self._context = open_context(width, height)
        self._scenario = scenario
        legs = planned_legs(scenario.people, scenario.walls, scenario.tables, scenario.pillars)
        self._ways = [(leg.person, (leg.start, *leg.points)) for leg in legs if leg.in_the_way and leg.points]
        self._stage = Stage(scenario, size=size, quick=quick)
        model = self._stage.model
        points = np.concatenate([scene_points(scenario), floor])
        self._camera = overview(points, width / height, azimuth=azimuth, elevation=elevation)
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
    ) -> NDArray[np.uint8]:
        """The scene at `state`: (height, width, 3) of uint8.

        `trail` (n, 2 or more) is a way to draw on the floor [m], `tracks` (P, 4) are where people are believed to be
        and to go, pale for those of whom nothing is seen, `coasts` (P,); `text` stands in the corner. `scan` (n, 2) are
        points at the lidar's height, and `detections` (n, 3) discs x, y, radius on the floor. `plan` (T, 2) is where
        the robot is to go, red unless `feasible`, with the robot at its end, and `fan` (F, T, 2) what else it weighed,
        cheapest first.
        """
        scene, rectangle, drawing = self._scene, self._rectangle, self._drawing
        self._stage.place(state)
        everything = int(mujoco.mjtCatBit.mjCAT_ALL)
        model, data = self._stage.model, self._stage.data
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, self._camera, everything, scene)
        draw_route(scene, self._scenario)
        there = ~np.isnan(state.people_position[:, 0])
        draw_ways(scene, (way for person, way in self._ways if there[person]))
        if trail is not None:
            draw_trail(scene, trail)
        if tracks is not None:
            draw_tracks(scene, tracks, coasts)
        if scan is not None:
            draw_scan(scene, scan)
        if detections is not None:
            draw_detections(scene, detections)
        if fan is not None:
            draw_fan(scene, fan)
        if plan is not None:
            draw_plan(scene, plan, self._scenario.robot.radius, feasible=feasible)
        picture = np.empty((rectangle.height, rectangle.width, 3), np.uint8)
        with self._context.as_current():
            mujoco.mjr_render(rectangle, scene, drawing)
            if text is not None:
                font, corner = mujoco.mjtFont.mjFONT_NORMAL, mujoco.mjtGridPos.mjGRID_TOPLEFT
                mujoco.mjr_overlay(font, corner, rectangle, text, "", drawing)
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


def render(
    scenario: Scenario,
    state: WorldState,
    *,
    size: tuple[int, int] = (1280, 720),
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
    **drawn: Any,
) -> NDArray[np.uint8]:
    """One picture, with the robot and all people in it, and what is `drawn` besides; see `Renderer`."""
    there = ~np.isnan(state.people_position[:, 0])
    floor = np.concatenate([state.robot_pose[None, :2], state.people_position[there]])
    with Renderer(scenario, floor, size=size, azimuth=azimuth, elevation=elevation) as renderer:
        return renderer.draw(state, **drawn)
