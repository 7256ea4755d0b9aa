"""The controller that a run file names, with its parameters."""

import re
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from mjnav.control import Controller, make_controller
from mjnav.control.parameters import LoopParameters
from mjnav.control.registry import shipped, shipped_parameters
from mjnav.scene.spec import Scenario
from mjnav.settings import below


def build_controller(scenario: Scenario) -> Controller:
    """The controller that the scenario names, with its parameters. Raises InvalidValue with the run file's key."""
    control = scenario.control
    parameters = {"preferred_speed": scenario.robot.preferred_speed, **control.parameters}
    limits, parameters = deepcopy(
        (scenario.robot.limits, parameters)
    )  # the controller's own: the robot keeps its limits
    with below("control", file=scenario.source):
        return make_controller(control.method, limits, control.period, **parameters)


def num_samples(scenario: Scenario) -> int | None:
    """How many samples of each belief the scenario's controller takes, said without making the controller.

    None for one of a user's own, which may change its parameters when it is made.
    """
    known = parameters_of(scenario)
    return None if known is None else known.samples


def parameters_of(scenario: Scenario) -> LoopParameters | None:
    """The parameters of the scenario's controller, said without making it; None for one of a user's own."""
    control = scenario.control
    parameters = {"preferred_speed": scenario.robot.preferred_speed, **control.parameters}
    with below("control", file=scenario.source):
        return shipped_parameters(control.method, control.period, **parameters)


def plans_in_time(scenario: Scenario) -> bool | None:
    """Whether the scenario's controller takes people where they are predicted at every step; None for one's own."""
    method = shipped(scenario.control.method)
    return None if method is None else method.controller_class.plans_in_time


def resolved_parameters(scenario: Scenario) -> dict[str, Any]:
    """Every parameter of the scenario's controller with its value, presets and defaults included, as JSON.

    For a controller without a dataclass `parameters`, those that the scenario gives. Raises InvalidValue.
    """
    parameters = getattr(build_controller(scenario), "parameters", None)
    if not is_dataclass(parameters) or isinstance(parameters, type):
        return _plain(scenario.control.parameters)
    return _plain(parameters)


def _plain(value: Any) -> Any:
    """A parameter as JSON; what JSON cannot express becomes Python's text for it, without addresses."""
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Mapping():
            return {str(key): _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case np.ndarray() | np.generic():
            return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    return re.sub(r" at 0x[0-9a-f]+", "", repr(value))
