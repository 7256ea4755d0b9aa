"""How people will go on: between the tracker, which says where they are, and the controller."""

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any

from mjnav.robot.prediction.base import ConstantVelocity, Crowd, Futures, OwnPredictor, Predictor, RobotNow
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import PredictorPlugin

__all__ = ["PREDICTORS", "Crowd", "Futures", "Predictor", "RobotNow", "make_predictor"]

# model -> module:Class
PREDICTORS: Mapping[str, str] = MappingProxyType(
    {
        "constant_velocity": "mjnav.robot.prediction.base:ConstantVelocity",
        "mixture": "mjnav.robot.prediction.mixture:Mixture",
        "social_force": "mjnav.robot.prediction.social_force:SocialForces",
    }
)


def make_predictor(scenario: Scenario, seed: int) -> Predictor:
    """The model that the scenario names, under the run's seed."""
    choice = scenario.prediction
    if choice is None:
        return ConstantVelocity()
    model: Any = choice.model
    if isinstance(model, PredictorPlugin):
        return OwnPredictor(model.name, model.make(scenario, seed))
    if choice.name == "constant_velocity":
        return ConstantVelocity()
    module, _, found = PREDICTORS[choice.name].partition(":")
    return getattr(import_module(module), found)(choice, model, seed)
