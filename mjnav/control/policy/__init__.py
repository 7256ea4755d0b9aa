"""Learned policies: what they see of an observation, how their actions are scaled, and how they run as controllers.

The Gymnasium environments encode by the same code, so a policy sees the same arrays in training and in `mjnav run`.
Nothing here needs Gymnasium.
"""

from mjnav.control.policy.blocks import Features
from mjnav.control.policy.controller import Actions, Encoder, PolicyController, flatten

__all__ = ["Actions", "Encoder", "Features", "PolicyController", "flatten"]
