"""Pictures without a screen; skipped, saying so, where there is no renderer."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from mjnav import load_scenario
from mjnav.errors import InputError
from mjnav.world import render as offscreen
from mjnav.world.render import FIELD_OF_VIEW, Renderer, overview
from mjnav.world.simulator import Simulator

SIZE = (320, 180)


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("hall")


@pytest.fixture(scope="module")
def state(scenario):
    return Simulator(scenario, 0).state()


@pytest.fixture(scope="module")
def renderer(scenario, state):
    try:
        made = Renderer(scenario, state.robot_pose[None, :2], size=SIZE, quick=True)
    except InputError as error:
        pytest.skip(str(error))
    with made:
        yield made


def changed(before, after) -> int:
    """How many pixels differ by more than an edge's flicker."""
    return int((np.abs(before.astype(int) - after).max(axis=2) > 16).sum())


def test_a_picture_depends_on_nothing_that_was_drawn_before(renderer, scenario, state):
    first = renderer.draw(state)
    moved = replace(state, robot_pose=state.robot_pose + 0.5)
    renderer.draw(moved, trail=[[0.0, 0.0], [1.0, 0.0]], tracks=[[0.0, 0.0, 1.0, 1.0]], text="text")
    assert (renderer.draw(state) == first).all()


def test_robot_and_people_are_where_the_state_has_them(renderer, state):
    before = renderer.draw(state)
    assert changed(before, renderer.draw(replace(state, robot_pose=state.robot_pose + 0.3))) > 30
    assert changed(before, renderer.draw(replace(state, people_position=state.people_position + 0.4))) > 100


def test_trail_tracks_and_text_are_drawn_over_the_scene(renderer, state):
    plain = renderer.draw(state)
    plan = [[0.5 + 0.1 * i, -1.0] for i in range(10)]
    tracks = [[0.0, -1.0, 1.0, 0.0]]
    for drawing, pixels in (
        ({"trail": [[-0.8, -1.0, 0.0], [2.0, -0.2, 0.0]]}, 50),
        ({"tracks": [*tracks, [np.nan] * 4]}, 20),
        ({"text": "12.3 s"}, 50),
        ({"scan": plan}, 5),
        ({"detections": [[0.5, -1.0, 0.3]]}, 20),
        ({"plan": plan, "fan": [plan, [[x, -y] for x, y in plan]]}, 50),
    ):
        assert changed(plain, renderer.draw(state, **drawing)) > pixels, drawing
    assert changed(renderer.draw(state, plan=plan), renderer.draw(state, plan=plan, fan=[plan], feasible=False)) > 20
    assert changed(renderer.draw(state, tracks=tracks), renderer.draw(state, tracks=tracks, coasts=[True])) > 20


# ------------------------------------------------------------------------------------------ camera


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.3])
@pytest.mark.parametrize("azimuth", [0.0, 90.0, 200.0])
@pytest.mark.parametrize("elevation", [-20.0, -50.0, -89.0])
def test_all_points_and_heads_above_them_are_in_the_picture_and_fill_it(aspect, azimuth, elevation):
    floor = np.array([[-2.0, -3.0], [12.0, -3.0], [12.0, 3.0], [-2.0, 3.0], [5.0, 0.0]])
    camera = overview(floor, aspect, azimuth=azimuth, elevation=elevation)
    a, e = np.radians([azimuth, elevation])
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    eye = camera.lookat - camera.distance * ahead
    seen = np.vstack([np.column_stack([floor, np.full(5, z)]) for z in (0.0, 1.7)]) - eye
    depth = seen @ ahead
    x = seen @ right / depth / (np.tan(0.5 * FIELD_OF_VIEW) * aspect)
    y = seen @ np.cross(right, ahead) / depth / np.tan(0.5 * FIELD_OF_VIEW)
    assert depth.min() > 0.0
    assert np.abs([x, y]).max() <= 1.0  # of half the picture
    assert np.abs([x, y]).max() > 0.8


# -------------------------------------------------------------------------- OpenGL without a screen


DRAW = """
import numpy as np
from mjnav.messages import WorldState
from mjnav.scene.spec import Robot, Scenario
from mjnav.world.render import render
nobody = np.zeros((0, 2))
state = WorldState(0.0, np.zeros(3), np.zeros(2), nobody, nobody)
scenario = Scenario(name="empty", robot=Robot(start=(0.0, 0.0, 0.0), goal=(1.0, 0.0)))
print(render(scenario, state, size=(64, 48)).std())
"""


def test_where_egl_has_no_driver_osmesa_draws():
    backends = {"PYOPENGL_PLATFORM", "MUJOCO_GL"}
    environment = {name: value for name, value in os.environ.items() if name not in backends}
    environment["__EGL_VENDOR_LIBRARY_DIRS"] = "/nonexistent"
    drawn = subprocess.run([sys.executable, "-c", DRAW], env=environment, capture_output=True, text=True, check=False)
    if "neither EGL nor OSMesa works" in drawn.stderr:
        pytest.skip("libosmesa6 is not installed")
    assert drawn.returncode == 0, drawn.stderr
    assert float(drawn.stdout) > 10.0  # not one colour


def test_where_nothing_draws_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(offscreen, "BACKENDS", ())
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    offscreen._backend.cache_clear()
    with pytest.raises(InputError, match=r"neither EGL nor OSMesa works.*libegl1.*libosmesa6"):
        offscreen.open_context(64, 64)
