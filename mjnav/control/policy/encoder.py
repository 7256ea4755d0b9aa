"""Observations as the arrays that a learned policy takes."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mjnav.control.policy.blocks import KINDS, Frame
from mjnav.control.policy.features import Features
from mjnav.messages import Observation, RobotLimits

Array32 = NDArray[np.float32]


class Encoder:
    """Turns observations of one robot into the blocks of `features`; it keeps nothing from one to the next."""

    def __init__(self, features: Features, limits: RobotLimits):
        self.features, self._limits = features, limits
        bounds = {name: KINDS[name].bounds(features, limits) for name in sorted(features.blocks)}
        self.bounds = {name: (low.astype(np.float32), high.astype(np.float32)) for name, (low, high) in bounds.items()}

    def encode(self, observation: Observation) -> dict[str, Array32]:
        """The blocks by name, in the order of their names, each clipped to its bounds and new.

        Raises ValueError where the scan is wanted and the observation has none.
        """
        frame, blocks = Frame.of(observation), {}
        for name, (low, high) in self.bounds.items():
            values = KINDS[name].values(self.features, self._limits, observation, frame)
            blocks[name] = np.clip(values.astype(np.float32), low, high)
        return blocks


def flatten(blocks: Mapping[str, Array32]) -> Array32:
    """All blocks as one vector, in the order of their names, as Gymnasium's FlattenObservation gives it."""
    return np.concatenate([blocks[name].ravel() for name in sorted(blocks)])
