"""Source text of controllers that hang, or end their process, at 0.45 s."""

HANGING = """
import os
from mjnav.control.methods.mean import Mean

class Hung(Mean):
    def decide(self, observation):
        while observation.time > 0.45:
            pass
        return super().decide(observation)

class Native(Mean):
    def decide(self, observation):
        return sum(iter(int, 1)) if observation.time > 0.45 else super().decide(observation)

class Exiting(Mean):
    def decide(self, observation):
        os._exit(0) if observation.time > 0.45 else None
        return super().decide(observation)
"""
