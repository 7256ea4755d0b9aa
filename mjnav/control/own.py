"""Controllers of one's own: what they lack of the protocol is added."""

from typing import Any

from mjnav.control.base import Controller
from mjnav.control.parameters import LoopParameters
from mjnav.errors import InvalidValue
from mjnav.messages import Array, Decision, Observation
from mjnav.plugins import CONTROLLER


class Completed:
    """A controller that has `decide` alone: the default number of samples, and no cone in the log."""

    def __init__(self, controller: Any, parameters: LoopParameters):
        self._controller = controller
        self.parameters: LoopParameters = getattr(controller, "parameters", parameters)

    def decide(self, observation: Observation) -> Decision:
        """The controller's decision."""
        return self._controller.decide(observation)

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """What the controller has for the log; None where it has no such method."""
        found = getattr(self._controller, "closest_cone", None)
        return None if found is None else found(observation, decision)


def completed_controller(name: str, controller: Any, parameters: LoopParameters | None = None) -> Controller:
    """The controller itself where it has all that the loop asks for, else `Completed`.

    `parameters` are those that it was made with. Raises InvalidValue where its own have no `samples`.
    """
    parameters = parameters or LoopParameters()
    if not hasattr(getattr(controller, "parameters", parameters), "samples"):
        allowed = f"{CONTROLLER.allowed}, whose parameters have `samples`, as LoopParameters do"
        raise InvalidValue(CONTROLLER.key, name, allowed)
    if hasattr(controller, "parameters") and hasattr(controller, "closest_cone"):
        return controller
    return Completed(controller, parameters)
