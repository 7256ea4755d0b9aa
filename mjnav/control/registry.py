"""The control methods by name, and how a controller is made from a name, a class or an object.

A controller of a user's own may have `decide` alone: what it lacks of the protocol is added.

A new method is a file in `methods/` and an entry in METHODS: `mjnav list`, run files and the README's table follow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from inspect import isclass
from math import inf
from types import MappingProxyType
from typing import Any

from mjnav.control.base import Controller
from mjnav.control.parameters import CHANGE_WEIGHT, RATED_PERIOD, LoopParameters, check_memory
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits, number
from mjnav.settings.plugins import (
    ControllerPlugin,
    construct,
    find,
    name_of,
    own_parameters,
    parameters_type,
    registered_place,
)

# --------------------------------------------------------------------------- controllers of one's own


class Completed:
    """A controller that has `decide` alone: the default number of samples, and no cone in the log."""

    def __init__(self, controller: Any, parameters: LoopParameters):
        self._controller = controller
        self.parameters: LoopParameters = getattr(controller, "parameters", parameters)
        self.decide: Any = controller.decide
        self.closest_cone: Any = getattr(controller, "closest_cone", lambda observation, decision: None)


def completed_controller(name: str, controller: Any, parameters: LoopParameters | None = None) -> Controller:
    """The controller itself where it has all that the loop asks for, else `Completed`.

    `parameters` are those that it was made with. Raises InvalidValue where its own have no `samples`.
    """
    parameters = parameters or LoopParameters()
    if not hasattr(getattr(controller, "parameters", parameters), "samples"):
        allowed = f"{ControllerPlugin.allowed()}, whose parameters have `samples`, as LoopParameters do"
        raise InvalidValue(ControllerPlugin.key, name, allowed)
    if hasattr(controller, "parameters") and hasattr(controller, "closest_cone"):
        return controller
    return Completed(controller, parameters)


# ------------------------------------------------------------------------------------ methods by name


def as_published(period: float) -> dict[str, Any]:
    """`rkhs-paper`: what the paper does not have is switched off; a candidate is previewed over one period."""
    return {
        "form": "line",
        "degree": 3,
        "scale": 1.0,
        "offset": 1.0,
        "weight": 1.0,
        "lane_weights": (1.0, 1.0),
        "normalise": False,
        "clip": inf,
        "sensing_range": inf,
        "max_obstacles": 1_000_000,
        "desired_min": 0,
        "heading_weight": 0.0,
        "safety_margin": 0.0,
        "preview": period,
        "lane_horizon": period,
    }


def as_read(period: float) -> dict[str, Any]:
    """`rkhs-reading`: what the paper leaves open, decided in the method's favour.

    Algorithm 1's bounds as the window; an obstacle counts within 7 m and while it approaches; f over R^2, which is the
    kernel's free scale. What is left open as a number is the best of 24 settings of the study `tuning`.
    """
    return {
        "form": "ray", "window": "bounds", "sensing_range": 7.0, "degree": 3, "weight": 21.9, "ball": 0.15,
        "safety_margin": 0.0392, "heading_weight": 0.131, "preview": 0.349,
        "speed_change_weight": 0.146 * (period / RATED_PERIOD), "turn_change_weight": 0.00522 * (period / RATED_PERIOD),
    }  # fmt: skip


@dataclass(frozen=True, slots=True)
class Method:
    """One method, a row of the README's table; its class is loaded when a controller is made."""

    name: str
    place: str  # module:Class, in mjnav.control.methods
    idea: str
    source: str
    preset: Callable[[float], dict[str, Any]] = lambda period: {}  # parameters other than the class's, by period [s]

    @property
    def file(self) -> str:
        """Its file, below mjnav/."""
        return f"control/methods/{self.place.partition(':')[0]}.py"

    @property
    def controller_class(self) -> Any:
        """Its class."""
        module, _, name = self.place.partition(":")
        return getattr(import_module(f"mjnav.control.methods.{module}"), name)


def registry(*methods: Method) -> Mapping[str, Method]:
    """The methods by name, read-only. Raises ValueError for a name that occurs twice."""
    found = {method.name: method for method in methods}
    if len(found) < len(methods):
        raise ValueError(f"a method is registered twice: {', '.join(sorted(method.name for method in methods))}")
    return MappingProxyType(found)


METHODS = registry(
    Method(
        "rkhs", "rkhs:Rkhs", "constraint distributions nearest to collision-free ones by MMD, tuned", "Nair et al. 2021"
    ),
    Method(
        "rkhs-paper", "rkhs:Rkhs", "the paper's equations alone: line form, degree 3, no scaling, clip or margin",
        "Nair et al. 2021", as_published,
    ),
    Method(
        "rkhs-reading", "rkhs:Rkhs", "the paper's method, what it leaves open decided in its favour and tuned",
        "Nair et al. 2021", as_read,
    ),
    Method("mean", "mean:Mean", "the constraints at the mean only", "velocity obstacles, Fiorini & Shiller 1998"),
    Method(
        "gaussian-linearised", "gaussian_linearised:GaussianLinearised",
        "chance constraints, linearised about Gaussian means", "Zhu & Alonso-Mora 2019",
    ),
    Method(
        "gaussian-moments", "gaussian_moments:GaussianMoments", "mean(f) + k std(f) ≤ 0, Gaussian beliefs",
        "Gopalakrishnan et al. 2015; PRVO 2017",
    ),
    Method("kld", "kld:Kld", "as rkhs, by the divergence of fitted Gaussian mixtures", "PVO, Poonganam et al. 2020"),
    Method(
        "mmd-dirac", "mmd_dirac:MmdDirac", "MMD of the violations max(0, f) to none, Gaussian kernel",
        "Gupta, Singh & Krishna 2022",
    ),
    Method(
        "cvar", "cvar:Cvar", "the mean of the worst samples must be safe",
        "Rockafellar & Uryasev 2000; MMD-OPT 2024's baseline",
    ),
    Method(
        "saa", "saa:Saa", "at most a share of samples may collide",
        "sample average approximation; MMD-OPT 2024's baseline",
    ),
    Method(
        "mppi", "mppi:Mppi", "a mean of sampled rollouts, weighted by their cost", "Williams et al. 2017; DRA-MPPI 2025"
    ),
    Method(
        "mppi-plus", "mppi_plus:MppiPlus", "the rollouts and costs of rkhs-plan with the risk of mppi",
        "this project; the risk as in DRA-MPPI 2025",
    ),
    Method(
        "rkhs-plan", "rkhs_plan:RkhsPlan", "plans whose joint violations are nearest to none by MMD",
        "this project, after Nair et al. 2021",
    ),
    Method(
        "orca", "orca:Orca", "half-planes of velocity, effective centre", "van den Berg et al. 2011; Snape et al. 2010"
    ),
    Method("dwa", "dwa:Dwa", "clearance along arcs, every obstacle where it is now", "Fox, Burgard & Thrun 1997"),
)  # fmt: skip


def names() -> tuple[str, ...]:
    """The methods that exist."""
    return tuple(sorted(METHODS))


def describe() -> dict[str, str]:
    """The idea and the source of each method, in a line, by name."""
    return {name: f"{METHODS[name].idea} ({METHODS[name].source})" for name in names()}


def make_controller(name: Any, robot_limits: RobotLimits, period: float, **parameters: Any) -> Controller:
    """The controller `name` for a robot and a control period [s], with its own parameters.

    `name` is one of `names()`; for a controller of one's own "package.module:Class", "file.py:Class", the name that a
    package registers, the class itself or an object, which is used as it is. The defaults of speed_change_weight and
    turn_change_weight, where the method has them, follow the period: 0.01 at 0.1 s. Raises InvalidValue for a name that
    does not exist, a parameter that the method does not have, and a value that is not allowed.
    """
    name = name_of(name)
    if not number("period", period) > 0.0:
        raise InvalidValue("period", period, "a finite number > 0")
    if not isinstance(robot_limits, RobotLimits):
        raise InvalidValue("robot_limits", robot_limits, "RobotLimits")
    method = METHODS.get(name)
    registered_place(ControllerPlugin, name, METHODS)
    kind: Any = method.controller_class if method else find(ControllerPlugin, name, METHODS)
    if not isclass(kind):
        return _object(name, kind, parameters)
    preset = _preset(method, period)
    kind_of_parameters = parameters_type(ControllerPlugin, name, kind, LoopParameters)
    own = construct(ControllerPlugin, name, partial(own_parameters, name, kind_of_parameters, parameters, preset))
    check_memory(own)
    if method is not None:
        return method.controller_class(robot_limits, period, own)
    made = construct(ControllerPlugin, name, kind, robot_limits, period, own)
    return construct(ControllerPlugin, name, completed_controller, name, made, own)


def shipped_parameters(name: str, period: float, **parameters: Any) -> LoopParameters | None:
    """The parameters with which `make_controller` makes a method that is shipped; None for any other controller.

    Raises InvalidValue as it does.
    """
    method = METHODS.get(name)
    if method is None:
        return None
    kind = method.controller_class.parameters_type
    return own_parameters(name, kind, parameters, _preset(method, period))


def _preset(method: Method | None, period: float) -> dict[str, Any]:
    """Defaults other than a class's own."""
    # The gain of a change of control within one period is proportional to the period, so its cost has to be as well:
    # with constant weights a robot at 50 Hz would accelerate a fifth as readily as at 10 Hz.
    change_weight = CHANGE_WEIGHT * (period / RATED_PERIOD)
    preset = {"speed_change_weight": change_weight, "turn_change_weight": change_weight}
    return preset | (method.preset(period) if method else {})


def _object(name: str, controller: Any, parameters: dict[str, Any]) -> Controller:
    """A controller that was made elsewhere: the robot's preferred speed is its own affair, and so is all else."""
    for key, value in parameters.items():
        if key != "preferred_speed":
            raise InvalidValue(key, value, f"no parameters beside {name}, an object that has its own")
    return completed_controller(name, controller)
