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
from mjnav.settings import plugins
from mjnav.settings.plugins import ControllerPlugin

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

CHANGES = ("speed_change_weight", "turn_change_weight")


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


def tuned(**values: Any) -> Callable[[float], dict[str, Any]]:
    """A preset: what tuning found (runs/bench/tuning.toml). Weights of a change, at RATED_PERIOD, follow the period."""
    return lambda period: values | _followed(period, {key: values[key] for key in CHANGES if key in values})


def _followed(period: float, weights: Mapping[str, float]) -> dict[str, float]:
    """Weights of a change at a control period [s], of those at RATED_PERIOD.

    The gain of a change of control within one period is proportional to the period, so its cost has to be as well:
    with constant weights a robot at 50 Hz would accelerate a fifth as readily as at 10 Hz.
    """
    return {key: weight * (period / RATED_PERIOD) for key, weight in weights.items()}


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
        "rkhs", "rkhs:Rkhs", "constraint distributions nearest to collision-free ones by MMD", "Nair et al. 2021",
        tuned(weight=13.7, degree=1, root=True, horizon=4.9, safety_margin=0.122,
              speed_change_weight=0.0151, turn_change_weight=0.0366),
    ),
    Method(
        "rkhs-paper", "rkhs:Rkhs", "the paper's equations alone: line form, degree 3, no scaling, clip or margin",
        "Nair et al. 2021", as_published,
    ),
    Method(
        "rkhs-reading", "rkhs:Rkhs", "the paper's method, what it leaves open decided in its favour",
        # Algorithm 1's bounds as window; an obstacle counts within 7 m and while it approaches; f / R^2, a free scale.
        "Nair et al. 2021",
        tuned(form="ray", window="bounds", sensing_range=7.0, degree=2, weight=1.93, ball=0.15, safety_margin=0.138,
              heading_weight=0.653, preview=0.545, speed_change_weight=0.0328, turn_change_weight=0.0188),
    ),
    Method(
        "mean", "mean:Mean", "the constraints at the mean only", "velocity obstacles, Fiorini & Shiller 1998",
        tuned(preview=0.48, horizon=6.91, safety_margin=0.0966, heading_weight=0.672,
              speed_change_weight=0.0241, turn_change_weight=0.0392),
    ),
    Method(
        "gaussian-linearised", "gaussian_linearised:GaussianLinearised",
        "chance constraints, linearised about Gaussian means", "Zhu & Alonso-Mora 2019",
        tuned(delta=0.0556, horizon=4.45, safety_margin=0.0362, heading_weight=1.17, penalty=3.0,
              speed_change_weight=0.137, turn_change_weight=0.0102),
    ),
    Method(
        "gaussian-moments", "gaussian_moments:GaussianMoments", "mean(f) + k std(f) ≤ 0, Gaussian beliefs",
        "Gopalakrishnan et al. 2015; PRVO 2017",
        tuned(eta=0.817, tail="quantile", horizon=5.49, safety_margin=0.146, window="bounds", penalty=30.0,
              speed_change_weight=0.0169, turn_change_weight=0.00329),
    ),
    Method(
        "kld", "kld:Kld", "as rkhs, by the divergence of fitted Gaussian mixtures", "PVO, Poonganam et al. 2020",
        tuned(weight=1.08, std_floor=0.173, horizon=5.31, safety_margin=0.123,
              speed_change_weight=0.0326, turn_change_weight=0.0152),
    ),
    Method(
        "mmd-dirac", "mmd_dirac:MmdDirac", "MMD of the violations max(0, f) to none, Gaussian kernel",
        "Gupta, Singh & Krishna 2022",
        tuned(weight=89.2, bandwidth=0.317, horizon=5.94, safety_margin=0.131,
              speed_change_weight=0.101, turn_change_weight=0.0437),
    ),
    Method(
        "cvar", "cvar:Cvar", "the mean of the worst samples must be safe",
        "Rockafellar & Uryasev 2000; MMD-OPT 2024's baseline",
        tuned(eta=0.775, horizon=7.46, safety_margin=0.07, heading_weight=0.26,
              speed_change_weight=0.0443, turn_change_weight=0.117),
    ),
    Method(
        "saa", "saa:Saa", "at most a share of samples may collide",
        "sample average approximation; MMD-OPT 2024's baseline",
    ),
    Method(
        "mppi", "mppi:Mppi", "a mean of sampled rollouts, weighted by their cost",
        "Williams et al. 2017; DRA-MPPI 2025",
        tuned(weight=14.4, temperature=0.155, step=0.211, safety_margin=0.0687,
              speed_change_weight=0.246, turn_change_weight=0.012),
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
        "orca", "orca:Orca", "half-planes of velocity, effective centre",
        "van den Berg et al. 2011; Snape et al. 2010",
        tuned(time_horizon=7.49, wall_horizon=2.1, responsibility=0.562, effective_centre=0.168, safety_margin=0.0665,
              approach_time=0.637, spread=2.54),
    ),
    Method(
        "dwa", "dwa:Dwa", "clearance along arcs, people going straight on",
        "Fox, Burgard & Thrun 1997; Seder & Petrovic 2007",
        tuned(weight=2.31, clearance=3.38, safety_margin=0.0895, heading_weight=0.781, moving=True,
              speed_change_weight=0.0467, turn_change_weight=0.00867),
    ),
)  # fmt: skip


def names() -> tuple[str, ...]:
    """The methods that exist."""
    return tuple(sorted(METHODS))


_BY_CLASS = {f"mjnav.control.methods.{m.place}": Method(m.name, m.place, m.idea, m.source) for m in METHODS.values()}


def shipped(name: Any) -> Method | None:
    """The method of a name, or of the place of its class, then without a preset; None for what is not mjnav's own."""
    return METHODS.get(name) or _BY_CLASS.get(name) if isinstance(name, str) else None


def describe() -> dict[str, str]:
    """The idea and the source of each method, in a line, by name."""
    return {name: f"{METHODS[name].idea} ({METHODS[name].source})" for name in names()}


def make_controller(name: Any, robot_limits: RobotLimits, period: float, /, **parameters: Any) -> Controller:
    """The controller `name` for a robot and a control period [s], with its own parameters.

    `name` is one of `names()`; for a controller of one's own "package.module:Class", "file.py:Class", the name that a
    package registers, the class itself or an object, which is used as it is. The defaults of speed_change_weight and
    turn_change_weight, where the method has them, are those at 0.1 s and follow the period. By its name a method has
    what tuning found, by its class the class's defaults. Raises InvalidValue for a name that does not exist, for a
    parameter that the method does not have, and for a value that is not allowed.
    """
    name = plugins.name_of(name)
    if not number("period", period) > 0.0:
        raise InvalidValue("period", period, "a finite number > 0")
    if not isinstance(robot_limits, RobotLimits):
        raise InvalidValue("robot_limits", robot_limits, "RobotLimits")
    method = shipped(name)
    plugins.registered_place(ControllerPlugin, name, METHODS)
    kind: Any = method.controller_class if method else plugins.find(ControllerPlugin, name, METHODS)
    if not isclass(kind):
        return _object(name, kind, parameters)
    preset = _preset(method, period)
    kind_of_parameters = plugins.parameters_type(ControllerPlugin, name, kind, LoopParameters)
    own = plugins.construct(
        ControllerPlugin, name, partial(plugins.own_parameters, name, kind_of_parameters, parameters, preset)
    )
    check_memory(own)
    if method is not None:
        return method.controller_class(robot_limits, period, own)
    made = plugins.construct(ControllerPlugin, name, kind, robot_limits, period, own)
    return plugins.construct(ControllerPlugin, name, completed_controller, name, made, own)


def shipped_parameters(name: str, period: float, /, **parameters: Any) -> LoopParameters | None:
    """The parameters with which `make_controller` makes a method that is shipped; None for any other controller.

    Raises InvalidValue as it does.
    """
    method = shipped(name)
    if method is None:
        return None
    return plugins.own_parameters(name, method.controller_class.parameters_type, parameters, _preset(method, period))


def _preset(method: Method | None, period: float) -> dict[str, Any]:
    """Defaults other than a class's own."""
    return _followed(period, dict.fromkeys(CHANGES, CHANGE_WEIGHT)) | (method.preset(period) if method else {})


def _object(name: str, controller: Any, parameters: dict[str, Any]) -> Controller:
    """A controller that was made elsewhere: the robot's preferred speed is its own affair, and so is all else."""
    for key, value in parameters.items():
        if key != "preferred_speed":
            raise InvalidValue(key, value, f"no parameters beside {name}, an object that has its own")
    return completed_controller(name, controller)
