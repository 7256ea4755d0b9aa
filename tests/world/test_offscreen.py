"""Which OpenGL draws where there is no screen."""

import os
import subprocess
import sys

import pytest

from mjnav.errors import InputError
from mjnav.world import render as offscreen

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
