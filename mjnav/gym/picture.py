"""Pictures of an environment: drawn off screen, or in MuJoCo's window."""

from time import monotonic, sleep

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array, WorldState
from mjnav.scene.spec import Scenario
from mjnav.world.render import Renderer
from mjnav.world.viewer import Viewer


class Drawing:
    """Pictures of one scene off screen, with the way that the robot went; `size` is (width, height) in pixels.

    Raises InputError where OpenGL cannot draw without a screen.
    """

    def __init__(self, scenario: Scenario, size: tuple[int, int]):
        floor = np.array([scenario.robot.start[:2], *(person.start for person in scenario.people)])
        self._renderer = Renderer(scenario, floor, size=size, quick=True)

    def draw(self, state: WorldState, trail: list[Array]) -> NDArray[np.uint8]:
        """The scene at `state`, (height, width, 3), with the robot's positions so far, (2,) each."""
        return self._renderer.draw(state, trail=trail)

    def close(self) -> None:
        """Frees what OpenGL holds."""
        self._renderer.close()


class Window:
    """A window that shows one scene at the pace of the clock. Raises InputError where no window can be opened."""

    def __init__(self, scenario: Scenario):
        self._viewer = Viewer(scenario)
        self._period = scenario.control.period
        self._due = monotonic()

    def show(self, state: WorldState) -> None:
        """Shows `state` one control period after the one before, or at once where that is past."""
        sleep(max(self._due - monotonic(), 0.0))
        self._due = max(self._due, monotonic()) + self._period
        self._viewer.show(state)

    def begin(self) -> None:
        """The next state is the first of an episode."""
        self._viewer.forget_trail()
        self._due = monotonic()

    def close(self) -> None:
        """Closes the window."""
        self._viewer.close()
