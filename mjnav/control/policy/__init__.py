"""Learned policies: what they see of an observation, how their actions are scaled, and how they run as controllers.

The Gymnasium environments encode by the same code, so a policy sees the same arrays in training and in `mjnav run`.
Nothing here needs Gymnasium.
"""

from mjnav.control.policy.actions import Actions
from mjnav.control.policy.controller import PolicyController
from mjnav.control.policy.encoder import Encoder, flatten
from mjnav.control.policy.features import Features

__all__ = ["Actions", "Encoder", "Features", "PolicyController", "flatten"]
