"""The room from above: legs and pillars as discs, walls as rectangles."""

from dataclasses import dataclass

import numpy as np

from mjnav.compile.compiled import Matrix, exact
from mjnav.constant import Constant
from mjnav.geometry.floor import box_distance
from mjnav.messages import Array
from mjnav.scene.bodies import Box, Disc, met_by_robot
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of


@dataclass(frozen=True, slots=True)
class FloorPlan(Constant):
    """Fixed things, discs first; `names` holds the body ("table0") of each disc, then of each box."""

    discs: Array  # (n, 3) x, y, radius [m]
    disc_heights: Array  # (n,) [m]
    boxes: Array  # (m, 6) centre x, y; unit vector along, x, y; half length, half thickness [m]
    box_heights: Array  # (m,) [m]
    names: tuple[str, ...]  # (n + m,)

    @classmethod
    def of(cls, scenario: Scenario) -> "FloorPlan":
        """The scenario's tables' legs, pillars and walls."""
        shapes = met_by_robot(scenario.walls, scenario.tables, scenario.pillars)
        floor, discs = floor_of(shapes), [shape for shape in shapes if isinstance(shape, Disc)]
        boxes = [shape for shape in shapes if isinstance(shape, Box)]
        return cls(
            discs=floor.discs,
            disc_heights=np.array([disc.height for disc in discs], float),
            boxes=floor.boxes,
            box_heights=np.array([box.height for box in boxes], float),
            names=tuple(shape.key.replace("s.", "") for shape in (*discs, *boxes)),  # tables.0 is table0
        )

    def distance(self, x: float, y: float) -> float:
        """From a point to the nearest surface [m], negative inside a disc; inf in an empty room."""
        return _distance(x, y, self.discs, self.boxes)


@exact
def _distance(x: float, y: float, discs: Matrix, boxes: Matrix):
    nearest = np.inf
    for j in range(len(discs)):
        nearest = min(nearest, np.hypot(discs[j, 0] - x, discs[j, 1] - y) - discs[j, 2])
    for j in range(len(boxes)):
        nearest = min(nearest, box_distance(x, y, boxes[j]))
    return nearest
