"""Every figure of a run by its name: the summary, the columns of a sweep, tables and the docs are made from this table.

A name is a key of `mjnav run --json`, and a column of a sweep; keys of inner tables are joined by "_".
"""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.errors import InvalidValue
from mjnav.metrics.definitions.knowledge import COMPUTING, CONSISTENCY, DECISIONS, KNOWLEDGE
from mjnav.metrics.definitions.outcome import (
    HIGHER,
    INTEGER,
    LOWER,
    MOTION,
    NUMBER,
    OUTCOME,
    PATH,
    PEOPLE,
    STRING,
    TRUTH,
    Definition,
)

__all__ = ["DERIVED", "FIGURES", "GROUPS", "HIGHER", "INTEGER", "LOWER", "NUMBER", "STRING", "TRUTH", "Definition"]

# name that `mjnav compare --figure` takes -> the figures of the group
GROUPS: Mapping[str, Mapping[str, Definition]] = MappingProxyType(
    {
        "ending": OUTCOME,
        "path": PATH,
        "motion": MOTION,
        "social": PEOPLE,
        "decisions": DECISIONS,
        "knowledge": KNOWLEDGE,
        "consistency": CONSISTENCY,
        "computing": COMPUTING,
    }
)


def _joined(groups: Mapping[str, Mapping[str, Definition]]) -> Mapping[str, Definition]:
    """All groups in one table. Raises InvalidValue for a name that two have."""
    found: dict[str, Definition] = {}
    for group in groups.values():
        for name, definition in group.items():
            if name in found or name in groups:
                raise InvalidValue("name", name, "a name that no other figure or group has")
            found[name] = definition
    return MappingProxyType(found)


FIGURES = _joined(GROUPS)
# What `compare` computes from the columns of many episodes.
DERIVED: Mapping[str, Definition] = MappingProxyType(
    {
        "collision": Definition(
            text="the robot touched a person, a table, a wall or a pillar", type=TRUTH, better=LOWER, over_all=True
        ),
        "fault": Definition(
            text="the robot touched a person, and it was its fault: robot_at_fault is above 0",
            type=TRUTH, better=LOWER, over_all=True, words="person hit by the robot's fault",
        ),
        "collision_moving": Definition(
            text="the robot touched a person while it moved: collisions_moving is above 0",
            type=TRUTH, better=LOWER, over_all=True, words="person hit by the robot while moving",
        ),
        "collision_at_rest": Definition(
            text="a person touched the robot while it stood: collisions_at_rest is above 0",
            type=TRUTH, over_all=True, words="person walked into the robot at rest",
        ),
        "collision_thing": Definition(
            text="the robot touched a table, a wall or a pillar",
            type=TRUTH, better=LOWER, over_all=True, words="thing hit",
        ),
        "win_ratio": Definition(
            text="pairs of the same seed in which the method did better than the reference, over those in which it did "
            "worse: a contact is worst, then a goal not reached in time; of two successes the cost that --win-by names "
            "decides, time_s by default",
            better=HIGHER, null="no pair that the method lost", source="Pocock et al. (2012)",
        ),
        "infeasible_share": Definition(
            text="share of all ticks at which nothing met the constraints: the sum of infeasible_ticks over the sum of "
            "ticks",
            better=LOWER, words="ticks without a control",
        ),
        "decision_ms": Definition(
            text="wall time of a decision: median over episodes of compute_ms_control_p50",
            unit="ms", better=LOWER, words="time of a decision",
        ),
        "decision_p99_ms": Definition(
            text="wall time that 99 % of an episode's decisions keep below: median over episodes of "
            "compute_ms_control_p99",
            unit="ms", better=LOWER, words="time of a decision, p99",
        ),
    }
)  # fmt: skip
