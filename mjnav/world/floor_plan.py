"""The room from above: legs and pillars as discs, walls as rectangles."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Matrix
from mjnav.messages import Array
from mjnav.scenarios.spec import Scenario


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
        discs, heights, names = [], [], []
        for i, table in enumerate(scenario.tables):
            discs += [(*leg, table.leg_radius) for leg in table.legs]
            heights += [table.height] * 4
            names += [f"table{i}"] * 4
        for i, pillar in enumerate(scenario.pillars):
            discs.append((*pillar.position, pillar.radius))
            heights.append(pillar.height)
            names.append(f"pillar{i}")
        boxes = []
        for i, wall in enumerate(scenario.walls):
            (x0, y0), (x1, y1) = wall.start, wall.end
            length = hypot(x1 - x0, y1 - y0)
            along = ((x1 - x0) / length, (y1 - y0) / length)
            boxes.append((0.5 * (x0 + x1), 0.5 * (y0 + y1), *along, 0.5 * length, 0.5 * wall.thickness))
            names.append(f"wall{i}")
        return cls(
            discs=np.array(discs, float).reshape(-1, 3),
            disc_heights=np.array(heights, float),
            boxes=np.array(boxes, float).reshape(-1, 6),
            box_heights=np.array([wall.height for wall in scenario.walls], float),
            names=tuple(names),
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


@exact
def box_distance(x, y, box):
    """From a point to a box as in `FloorPlan.boxes` [m]; 0 inside it."""
    dx, dy = x - box[0], y - box[1]
    along = max(abs(dx * box[2] + dy * box[3]) - box[4], 0.0)
    across = max(abs(dy * box[2] - dx * box[3]) - box[5], 0.0)
    return np.sqrt(along * along + across * across)
