"""Logs of a made-up method that plans ahead."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mjnav.log import Recorder
from mjnav.messages import PlanShown
from tests.log.conftest import MadeUpRun, make_scenario

NUM_TICKS = 4
VIOLATION = np.array([0.0, 0.0, 0.05, 0.999, 1.0, 2.0, 0.0, 0.0])  # half of them at 0, a quarter at a contact


def written(path: Path, *, plans: bool = True) -> list[PlanShown | None]:
    """Writes a log of NUM_TICKS, all but the second with a plan, the last not feasible; gives the plans.

    Without `plans` it is one of a method that has none.
    """
    run, records = MadeUpRun(num_people=2, num_candidates=30), []
    with Recorder(path, make_scenario(2), {"scene": "made-up", "controller": "planner"}, "<mujoco/>") as recorder:
        for tick in range(NUM_TICKS):
            record = run.record(tick) if tick == 1 or not plans else run.planned(tick)
            if (plan := record.decision.plan) is not None:
                plan = replace(plan, violation=VIOLATION, feasible=tick != NUM_TICKS - 1)
                record = replace(record, decision=replace(record.decision, plan=plan))
            recorder.write(record)
            recorder.write_timing(run.timing(tick))
            records.append(record)
        recorder.finish(run.truth(NUM_TICKS), {"outcome": "goal"})
    return [record.decision.plan for record in records]
