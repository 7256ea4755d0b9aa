"""Figures of a run: pure functions of a trajectory and its scenario, from memory and from a log alike."""

from mjnav.metrics.own import Figure, Measured, Metric, OwnMetrics
from mjnav.metrics.summary import summarise

__all__ = ["Figure", "Measured", "Metric", "OwnMetrics", "summarise"]
