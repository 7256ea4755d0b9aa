"""The constraints on samples: collision cone, walls and lanes. f <= 0 is safe."""

from mjnav.constraints.collision_cone import FORMS, collision_cone
from mjnav.constraints.walls import lane_distance, wall_clearance

__all__ = ["FORMS", "collision_cone", "lane_distance", "wall_clearance"]
