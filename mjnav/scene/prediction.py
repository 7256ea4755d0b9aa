"""How people are predicted to go on: the table [prediction] of a run file."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from types import MappingProxyType
from typing import Annotated

from mjnav.errors import InvalidValue
from mjnav.settings import Beside, Range, Settled, Variants
from mjnav.settings.plugins import PredictorPlugin

MAX_STEPS = 200  # of a prediction


@dataclass(frozen=True, slots=True)
class WallsModel:
    """Everybody walks straight on, each sample at its own velocity, and along a wall that would stand in the way."""


@dataclass(frozen=True, slots=True)
class ConstantVelocityModel:
    """Everybody walks straight on, each sample at its own velocity, also through walls."""


WALLS, CONSTANT_VELOCITY = "walls", "constant_velocity"
MODELS: Mapping[str, type[WallsModel | ConstantVelocityModel]] = MappingProxyType(
    {WALLS: WallsModel, CONSTANT_VELOCITY: ConstantVelocityModel}
)


@dataclass(frozen=True, slots=True)
class Prediction(Settled):
    """How people are predicted to go on: the model's name in `model`, and its keys beside it."""

    model: Annotated[
        WallsModel | ConstantVelocityModel | PredictorPlugin,
        Variants("model", MODELS, PredictorPlugin),
        Beside(),
        "of how people go on",
    ] = WallsModel()
    horizon: Annotated[float, Range(0.05, 60.0, "s"), "how far ahead; later everybody walks straight on"] = 4.8
    step: Annotated[
        float, Range(0.05, 10.0, "s"), "time between predicted positions, between which lines are straight"
    ] = 0.4

    def _check(self):
        if not 1.0 - 1e-9 <= self.horizon / self.step <= MAX_STEPS + 1e-9:
            allowed = f"from one step ({self.step:g} s) to {MAX_STEPS} steps"
            raise InvalidValue("horizon", self.horizon, allowed)

    @property
    def name(self) -> str:
        """Of the model, as a run file has it."""
        if isinstance(self.model, PredictorPlugin):
            return self.model.name
        return next(name for name, kind in MODELS.items() if isinstance(self.model, kind))

    @property
    def num_steps(self) -> int:
        """H, the number of predicted positions: as many steps as the horizon takes, the last one whole."""
        return ceil(self.horizon / self.step - 1e-9)
