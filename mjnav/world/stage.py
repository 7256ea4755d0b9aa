"""The scene for pictures: a model with all its decoration, put into any state of either engine."""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

import mujoco
import numpy as np

from mjnav.messages import WorldState
from mjnav.scenarios.spec import Scenario
from mjnav.world.mujoco_people import AWAY
from mjnav.world.scene import compose

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
