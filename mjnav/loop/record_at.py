"""One moment of a run that is not logged: what the tick at a given time saw and did."""

from collections.abc import Callable

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.estimation.base import person_names
from mjnav.loop.episode import Episode
from mjnav.loop.onboard.floor_map import FloorMap
from mjnav.messages import TickRecord
from mjnav.scenarios.spec import Scenario

ROUNDING = 1e-9  # relative


def record_at(scenario: Scenario, time: float, *, progress: Callable[[float], None] = lambda time: None) -> TickRecord:
    """The tick at `time` [s], or else the last one before it; the run goes no further.

    Raises InvalidValue for a time that is negative, or after the end of the run.
    """
    if not 0.0 <= time <= scenario.time_limit:
        raise InvalidValue("time", time, f"0 to {scenario.time_limit:g} s, the run's time limit")
    index = int(np.floor(time / scenario.control.period * (1.0 + ROUNDING)))
    latest: list[TickRecord] = []

    def watch(record: TickRecord) -> None:
        latest[:] = [record]

    def stop() -> bool:
        return bool(latest) and latest[0].tick >= index

    result = Episode(scenario, stop=stop, watch=watch, progress=progress).run()
    figures = result.run.figures
    end = figures.time_s
    if not latest or (latest[0].tick < index and end * (1.0 + ROUNDING) < time):
        raise InvalidValue("time", time, f"0 to {end:g} s: there the run ended ({figures.outcome})")
    return latest[0]


def column_names(scenario: Scenario) -> tuple[str, ...]:
    """What the columns of `CandidateCosts.cone` belong to: people, legs, pillars, walls."""
    floor = FloorMap(scenario)
    return (*person_names(len(scenario.people)), *floor.names, *floor.wall_names)
