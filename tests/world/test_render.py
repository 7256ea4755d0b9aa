"""Pictures without a screen; skipped, saying so, where there is no renderer."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav import load_scenario
from mjnav.errors import InputError
from mjnav.world.render import Renderer
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
    trail = [[-0.8, -1.0, 0.0], [2.0, -0.2, 0.0]]
    assert changed(plain, renderer.draw(state, trail=trail)) > 50
    assert changed(plain, renderer.draw(state, tracks=[[0.0, -1.0, 1.0, 0.0], [np.nan] * 4])) > 20
    assert changed(plain, renderer.draw(state, text="12.3 s")) > 50
    assert changed(plain, renderer.draw(state, scan=[[0.5 + 0.1 * i, -1.0] for i in range(10)])) > 5
    assert changed(plain, renderer.draw(state, detections=[[0.5, -1.0, 0.3]])) > 20
    plan = [[0.5 + 0.1 * i, -1.0] for i in range(10)]
    drawn = renderer.draw(state, plan=plan, fan=[plan, [[x, -y] for x, y in plan]])
    assert changed(plain, drawn) > 50
    assert changed(drawn, renderer.draw(state, plan=plan)) > 5
    assert changed(drawn, renderer.draw(state, plan=plan, fan=[plan, plan], feasible=False)) > 20
    tracks = [[0.0, -1.0, 1.0, 0.0]]
    assert changed(renderer.draw(state, tracks=tracks), renderer.draw(state, tracks=tracks, coasts=[True])) > 20
