import numpy as np
import pytest

from mjnav.errors import InputError
from mjnav.world.render import render
from mjnav.world.simulator import Simulator


def test_the_picture_has_the_size_asked_for_and_shows_the_trail(clutter):
    scenario = clutter()
    state = Simulator(scenario, 0).state()
    try:
        plain = render(scenario, state, size=(320, 180))
    except InputError as error:
        pytest.skip(str(error))
    trailed = render(scenario, state, size=(320, 180), trail=np.array([[-0.8, -1.0, 0.0], [2.0, -0.2, 0.0]]))
    assert plain.shape == (180, 320, 3)
    assert plain.dtype == np.uint8
    assert len(np.unique(plain.reshape(-1, 3), axis=0)) > 100
    assert (plain != trailed).any()


def test_a_missing_renderer_is_an_input_error_that_says_what_to_install(clutter, monkeypatch):
    def missing(name):
        raise ImportError(f"no {name}")

    monkeypatch.setattr("mjnav.world.offscreen.import_module", missing)
    monkeypatch.setenv("MUJOCO_GL", "egl")
    scenario = clutter()
    with pytest.raises(InputError, match="libegl1"):
        render(scenario, Simulator(scenario, 0).state())
