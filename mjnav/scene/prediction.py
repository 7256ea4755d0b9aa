"""How people are predicted to go on: the table [prediction] of a run file."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, pi
from types import MappingProxyType
from typing import Annotated

from mjnav.errors import InvalidValue
from mjnav.settings import Beside, Choice, Range, Variants, settle
from mjnav.settings.plugins import PredictorPlugin

MAX_STEPS = 200  # of a prediction

HazardRate = Annotated[float, Range(0.0, 10.0, "1/s")]
Duration = Annotated[float, Range(0.05, 10.0, "s")]


@dataclass(frozen=True, slots=True)
class ConstantVelocityModel:
    """Everybody walks straight on, each sample at its own velocity."""


@dataclass(frozen=True, slots=True)
class MixtureModel:
    """Each sample goes on, stops or turns left or right; how likely each is, the person's motion so far decides."""

    stop_rate: Annotated[HazardRate, "how often somebody who walks stops"] = 0.05
    turn_rate: Annotated[HazardRate, "how often somebody who walks turns, left and right together"] = 0.1
    go_rate: Annotated[HazardRate, "how often somebody who stands after a stop walks on"] = 0.3
    turn_angle: Annotated[float, Range(0.0, pi, "rad"), "largest angle of a turn"] = 0.5 * pi
    sway: Annotated[float, Range(0.0, 5.0, "m/s/√s"), "of a walk: std of a velocity component after one second"] = 0.1
    relaxation_time: Annotated[Duration, "in which a velocity comes within 1/e of a new one"] = 0.5
    velocity_noise: Annotated[
        float, Range(0.001, 5.0, "m/s"), "std of a velocity component of the tracks of somebody who walks straight"
    ] = 0.2

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True)
class SocialForceModel:
    """Everybody keeps their velocity as far as social forces of the others, of walls and of furniture let them."""

    form: Annotated[str, Choice(("moussaid_2009", "helbing")), "of the forces, with its published constants"] = (
        "moussaid_2009"
    )
    neighbour_range: Annotated[float, Range(0.5, 20.0, "m"), "distance beyond which nobody counts"] = 3.0
    crowds: Annotated[
        int,
        Range(1, 10_000),
        "number of samples that are rolled out; others depart from their straight line as these do",
    ] = 25
    sees_robot: Annotated[bool, "the robot counts as a body that keeps its velocity"] = False

    def __post_init__(self):
        settle(self)


PredictionModel = ConstantVelocityModel | MixtureModel | SocialForceModel
MODELS: Mapping[str, type[PredictionModel]] = MappingProxyType(
    {"constant_velocity": ConstantVelocityModel, "mixture": MixtureModel, "social_force": SocialForceModel}
)


@dataclass(frozen=True, slots=True)
class Prediction:
    """How people are predicted to go on: the model's name in `model`, and its keys beside it."""

    model: Annotated[
        PredictionModel | PredictorPlugin,
        Variants("model", MODELS, PredictorPlugin),
        Beside(),
        "of how people go on",
    ] = ConstantVelocityModel()
    horizon: Annotated[float, Range(0.05, 60.0, "s"), "how far ahead; later everybody walks straight on"] = 4.8
    step: Annotated[
        float, Range(0.05, 10.0, "s"), "time between predicted positions, between which lines are straight"
    ] = 0.4

    def __post_init__(self):
        settle(self)
        if not 1.0 - 1e-9 <= self.horizon / self.step <= MAX_STEPS + 1e-9:
            allowed = f"from one step ({self.step:g} s) to {MAX_STEPS} steps"
            raise InvalidValue("horizon", self.horizon, allowed)

    @property
    def name(self) -> str:
        """Of the model, as a run file has it."""
        if isinstance(self.model, PredictorPlugin):
            return self.model.name
        return next(name for name, kind in MODELS.items() if type(self.model) is kind)

    @property
    def num_steps(self) -> int:
        """H, the number of predicted positions: as many steps as the horizon takes, the last one whole."""
        return ceil(self.horizon / self.step - 1e-9)
