"""Controllers by name: `make_controller`, `names`, and the messages they take and give."""

from mjnav.control.base import Controller
from mjnav.control.registry import describe, make_controller, names
from mjnav.messages import CandidateCosts, Decision, Lanes, Observation, ObstacleSamples, RobotLimits, Status

__all__ = [
    "CandidateCosts",
    "Controller",
    "Decision",
    "Lanes",
    "Observation",
    "ObstacleSamples",
    "RobotLimits",
    "Status",
    "describe",
    "make_controller",
    "names",
]
