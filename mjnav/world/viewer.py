"""A window that shows a run as it happens: MuJoCo's passive viewer."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

import os
import threading
import warnings
from typing import Any, Self

from mjnav.errors import InputError
from mjnav.messages import Array, WorldState
from mjnav.scene.spec import Scenario
from mjnav.world.decoration import draw_route, draw_trail
from mjnav.world.render import Stage, overview
from mjnav.world.scene import scene_points

CLOSING_TIME = 5.0  # [s] that the window gets to end in order
_ASPECT = 1.5  # of the window, roughly
_INSTEAD = "use `mjnav run --live`, or `mjnav render LOG -o film.mp4` afterwards; over SSH, ssh -X"


class Viewer:
    """A window that shows the state given to `show`; a context manager, which closes it.

    It has a model of its own, so that nothing done in the window changes the run. Raises InputError where no window can
    be opened.
    """

    def __init__(self, scenario: Scenario):
        _check_display()
        from mujoco import viewer

        self._scenario = scenario
        self._stage = Stage(scenario)
        self._trail: list[Array] = []
        before = set(threading.enumerate())
        self._window = viewer.launch_passive(
            self._stage.model, self._stage.data, show_left_ui=False, show_right_ui=False
        )
        self._threads = set(threading.enumerate()) - before
        camera = overview(scene_points(scenario), _ASPECT)
        with self._window.lock():
            for name in ("type", "lookat", "azimuth", "elevation", "distance"):
                setattr(self._window.cam, name, getattr(camera, name))

    @property
    def closed(self) -> bool:
        """Whether somebody closed the window."""
        return not self._window.is_running()

    def show(self, state: WorldState) -> None:
        """Brings the window up to date; returns before it has been drawn."""
        if self.closed:
            return
        self._trail.append(state.robot_pose[:2])
        with self._window.lock():
            self._stage.place(state)
            scene: Any = self._window.user_scn
            scene.ngeom = 0
            draw_route(scene, self._scenario)
            draw_trail(scene, self._trail)
        self._window.sync()

    def forget_trail(self) -> None:
        """The next state shown begins another run."""
        self._trail.clear()

    def close(self) -> None:
        """Closes the window and waits for its thread, which must not outlive the libraries that it uses."""
        self._window.close()
        for thread in self._threads:
            thread.join(CLOSING_TIME)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def has_display() -> bool:
    """Whether the environment names a display, on which a window may open."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _check_display() -> None:
    """Raises InputError where a window cannot be opened: MuJoCo's viewer itself would wait for ever."""
    if not has_display():
        raise InputError(f"no display: {_INSTEAD}")
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if not glfw.init():
            raise InputError(f"the display cannot be used: {_INSTEAD}")
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        window = glfw.create_window(64, 64, "mjnav", None, None)
        glfw.default_window_hints()
        if not window:
            glfw.terminate()
            raise InputError(f"the display has no OpenGL: {_INSTEAD}")
        glfw.destroy_window(window)  # without glfw.terminate: MuJoCo starts GLFW for its first window only
