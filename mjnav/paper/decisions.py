"""Decisions along a run in which obstacles matter, and the controllers that decide again on them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from mjnav.control import Controller
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller
from mjnav.messages import TickRecord
from mjnav.scenarios.spec import Scenario

T = TypeVar("T")


def variant(scenario: Scenario, method: str, **parameters: Any) -> Controller:
    """The scenario's controller under another method or parameters; its own parameters stay with its own method."""
    control = scenario.control
    own = control.parameters if control.method == method else {}
    return build_controller(
        replace(scenario, control=replace(control, method=method, parameters={**own, **parameters}))
    )


def decisions_that_matter(scenario: Scenario) -> list[TickRecord]:
    """The ticks of a run that chose another candidate than the goal alone would. The method has candidates."""
    found: list[TickRecord] = []

    def watch(record: TickRecord) -> None:
        if goal_cost_excess(record) > 0.0:
            found.append(record)

    Episode(scenario, watch=watch).run()
    return found


def goal_cost_excess(record: TickRecord) -> float:
    """The goal cost of the chosen candidate above the least; 0 where the method has no costs."""
    costs = record.decision.costs
    return 0.0 if costs is None else float(costs.goal[np.argmin(costs.total)] - costs.goal.min())


def spread(items: Sequence[T], num: int) -> Iterator[T]:
    """At most `num` of the items, evenly spaced, the first and the last included."""
    for i in dict.fromkeys(np.linspace(0, len(items) - 1, num).round().astype(int).tolist() if items else ()):
        yield items[i]
