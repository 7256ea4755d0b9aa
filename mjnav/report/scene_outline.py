"""What stands in a room, as plain lists for a page's map [m]."""

from typing import Any

import numpy as np

from mjnav.messages import Array
from mjnav.report.inspection import shown_people
from mjnav.scene.bodies import KnownBodies
from mjnav.scene.spec import Scenario, Table
from mjnav.scene.ways import planned_legs


def scene_outline(scenario: Scenario) -> dict[str, Any]:
    """Walls as {from, to, thickness}, tables as {corners, legs, leg_radius}, pillars, lanes, ways and radii."""
    robot = scenario.robot
    legs = planned_legs(scenario)
    return {
        "start": list(robot.start),
        "route": [list(point) for point in robot.route],
        "goal_tolerance": robot.goal_tolerance,
        "radius": robot.radius,
        "people_radius": [person.radius for person in scenario.people],
        "people_legs": [{"person": leg.person, "points": [leg.start, *leg.points]} for leg in legs if leg.points],
        "people_words": [person.words for person in shown_people(scenario)],
        **body_outline(scenario),
        "lanes": [scenario.lanes.left, scenario.lanes.right] if scenario.lanes else [],
    }


def body_outline(bodies: Scenario | KnownBodies) -> dict[str, Any]:
    """Walls, tables and pillars alone: of the world, or of the map that the robot has."""
    return {
        "walls": [{"from": w.start, "to": w.end, "thickness": w.thickness} for w in bodies.walls],
        "tables": [
            {"corners": _top(t).tolist(), "legs": t.legs.tolist(), "leg_radius": t.leg_radius} for t in bodies.tables
        ],
        "pillars": [{"position": p.position, "radius": p.radius} for p in bodies.pillars],
    }


def _top(table: Table) -> Array:
    """Corners of a table's top, (4, 2)."""
    half = 0.5 * np.array(table.size) + table.leg_radius
    cosine, sine = np.cos(table.yaw), np.sin(table.yaw)
    corners = half * [[1, 1], [-1, 1], [-1, -1], [1, -1]]
    return np.array(table.position) + corners @ [[cosine, sine], [-sine, cosine]]
