"""What a robot that plans ahead weighed, from moment to moment, for pictures and films."""

from bisect import bisect_right
from typing import Any

from mjnav.errors import DamagedLogError
from mjnav.messages import PlanShown
from mjnav.recording.encode.plan import decode_plan
from mjnav.recording.read.log import Log

_SAME = 1e-6  # [s] between two moments that are one


class PlanViews:
    """All plans of a log. Raises DamagedLogError where one is not as mjnav writes it."""

    def __init__(self, log: Log):
        messages = log.messages("/plan")
        self._plans = [(1e-9 * message.time_ns, _decoded(log, message.value)) for message in messages]
        self._period = log.scenario().control.period

    def at(self, time: float) -> dict[str, Any]:
        """The plan at a time [s], as `Renderer.draw` takes it: the latest one, for a period."""
        place = bisect_right(self._plans, time + _SAME, key=lambda found: found[0]) - 1
        if place < 0 or time - self._plans[place][0] > self._period + _SAME:
            return {}
        plan = self._plans[place][1]
        return {"plan": plan.path, "fan": plan.fan, "feasible": plan.feasible}


def _decoded(log: Log, message: Any) -> PlanShown:
    try:
        return decode_plan(message)
    except ValueError as error:
        raise DamagedLogError(f"{log.path}: damaged: /plan holds {error}") from error
