"""Controllers by name: `make_controller`, `names`, and the messages they take and give."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any

from mjnav.control.base import Controller
from mjnav.control.custom import custom_class, make_custom
from mjnav.control.parameters import CHANGE_WEIGHT, RATED_PERIOD, make_parameters
from mjnav.control.size import check_size
from mjnav.errors import InvalidValue, unknown_name
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

# name -> module:Class; the preset that it starts from where it has one; a line for `mjnav list`.
REGISTRY: Mapping[str, str] = MappingProxyType(
    {
        "gaussian-linearised": "mjnav.control.methods.gaussian_linearised:GaussianLinearised",
        "gaussian-moments": "mjnav.control.methods.gaussian_moments:GaussianMoments",
        "kld": "mjnav.control.methods.kld:Kld",
        "cvar": "mjnav.control.methods.cvar:Cvar",
        "dwa": "mjnav.control.methods.dwa:Dwa",
        "mean": "mjnav.control.methods.mean:Mean",
        "mppi": "mjnav.control.methods.mppi:Mppi",
        "mmd-dirac": "mjnav.control.methods.mmd_dirac:MmdDirac",
        "orca": "mjnav.control.methods.orca:Orca",
        "rkhs": "mjnav.control.methods.rkhs:Rkhs",
        "rkhs-paper": "mjnav.control.methods.rkhs:Rkhs",
        "saa": "mjnav.control.methods.saa:Saa",
    }
)
DESCRIPTIONS: Mapping[str, str] = MappingProxyType(
    {
        "gaussian-linearised": "chance constraints, linearised about Gaussian means (Zhu & Alonso-Mora 2019)",
        "gaussian-moments": "mean(f) + k std(f) <= 0, Gaussian beliefs (Gopalakrishnan et al. 2015; PRVO 2017)",
        "kld": "as rkhs, by the KL divergence of Gaussian mixtures (PVO, Poonganam et al. 2020)",
        "cvar": "the mean of the worst samples must be safe (Rockafellar & Uryasev 2000)",
        "dwa": "clearance along arcs, obstacles where they are now (Fox, Burgard & Thrun 1997)",
        "mean": "the constraints at the mean only (velocity obstacles, Fiorini & Shiller 1998)",
        "mmd-dirac": "the distance of violations from none, Gaussian kernel (Gupta, Singh & Krishna 2022)",
        "mppi": "a mean of sampled rollouts, weighed by their cost (Williams et al. 2017; DRA-MPPI 2025)",
        "orca": "half-planes of velocity (van den Berg et al. 2011), effective centre (Snape et al. 2010)",
        "rkhs": "matches distributions with collision-free ones in an RKHS (Nair et al. 2021), tuned",
        "rkhs-paper": "the same, literally as published",
        "saa": "at most a share of the samples may collide (sample average approximation)",
    }
)
PRESETS: Mapping[str, str] = MappingProxyType({"rkhs-paper": "mjnav.control.methods.rkhs:PAPER"})


def names() -> tuple[str, ...]:
    """The controllers that exist."""
    return tuple(sorted(REGISTRY))


def describe() -> dict[str, str]:
    """What each controller does, in a line, by name."""
    return {name: DESCRIPTIONS[name] for name in names()}


def make_controller(name: str, robot_limits: RobotLimits, period: float, **parameters: Any) -> Controller:
    """The controller `name` for a robot and a control period [s], with its own parameters.

    `name` is one of `names()`, or "package.module:Class" for a controller of one's own. The defaults of
    speed_change_weight and turn_change_weight, where the method has them, follow the period: 0.01 at 0.1 s. Raises
    InvalidValue for a name that does not exist, a parameter that the method does not have, and a value that is not
    allowed.
    """
    if name not in REGISTRY and ":" not in name:
        raise unknown_name("method", name, REGISTRY)
    if not 0.0 < period < float("inf"):
        raise InvalidValue("period", period, "a finite number > 0")
    kind = _load(REGISTRY[name]) if name in REGISTRY else custom_class(name)
    # What a change of control gains in one period is in proportion to the period, so its cost has to be as well: with
    # weights that do not follow it, a robot at 50 Hz accelerates a fifth as readily as at 10 Hz.
    preset: dict[str, Any] = dict.fromkeys(
        ("speed_change_weight", "turn_change_weight"), CHANGE_WEIGHT * (period / RATED_PERIOD)
    )
    if name in PRESETS:
        preset |= _load(PRESETS[name])
    if name == "rkhs-paper":
        preset["preview"] = period  # the paper previews a candidate over one period
        preset["lane_horizon"] = period
    own = make_parameters(name, kind.parameters_type, parameters, preset)
    check_size(own)
    return kind(robot_limits, period, own) if name in REGISTRY else make_custom(name, kind, robot_limits, period, own)


def _load(path: str) -> Any:
    module, _, name = path.partition(":")
    return getattr(import_module(module), name)
