"""Predictors of a user's own: they get copies, and what they return is copied and checked."""

from typing import Any

import numpy as np

from mjnav.errors import PluginFault
from mjnav.messages import Array
from mjnav.prediction.base import Crowd, Futures
from mjnav.sealed import sealed_message


class OwnPredictor:
    """People by a user's predictor."""

    def __init__(self, name: str, predictor: Any):
        self._name, self._own = name, predictor

    def predict(self, crowd: Crowd) -> Futures:
        """The predictor's futures. Raises PluginFault where they are none."""
        with PluginFault.told(self._name, "predict()"):
            return self._futures(crowd, self._own.predict(sealed_message(crowd)))

    def _futures(self, crowd: Crowd, found: Any) -> Futures:
        if not isinstance(found, Futures):
            raise PluginFault(f"{self._name}: predict() returned a {type(found).__name__} in place of Futures")
        shape = (*crowd.samples.shape[:2], 2)
        position = self._checked("position", found.position, shape)
        velocity = self._checked("velocity", found.velocity, shape)
        if found.ahead is None:
            return Futures(position, velocity)
        num = np.shape(found.ahead)[2] if np.ndim(found.ahead) == 4 else 0
        ahead = self._checked("ahead", found.ahead, (*shape[:2], max(num, 1), 2))
        if not 0.0 < float(found.step) < np.inf:
            raise PluginFault(f"{self._name}: step must be a finite number > 0, not {found.step}")
        return Futures(position, velocity, ahead, float(found.step))

    def _checked(self, part: str, values: Any, shape: tuple[int, ...]) -> Array:
        values = np.array(values, float, order="C")
        if values.shape != shape:
            raise PluginFault(f"{self._name}: {part} has shape {values.shape} in place of {shape}")
        if not np.isfinite(values).all():
            raise PluginFault(f"{self._name}: {part} holds a number that is not finite")
        return values
