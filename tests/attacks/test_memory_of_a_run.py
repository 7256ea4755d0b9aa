"""What a run keeps of a tick is its row of the trajectory's arrays; longer studies: long_run.py."""

import tracemalloc
from dataclasses import fields
from itertools import count

import numpy as np
import pytest

from mjnav.loop.episode import Episode
from mjnav.messages import Trajectory
from mjnav.scenarios import load

SPARE = 1.125  # arrays grow by an eighth
POINTER = 8  # [bytes] of a tick's status, of which there are few
TICKS = 400


def row_size(trajectory: Trajectory) -> float:
    """Bytes a tick of the arrays."""
    arrays = (getattr(trajectory, field.name) for field in fields(trajectory))
    return sum(value.nbytes for value in arrays if isinstance(value, np.ndarray)) / len(trajectory.command) + POINTER


@pytest.mark.parametrize("logged", [False, True])
def test_a_tick_costs_no_more_memory_than_its_row(logged, tmp_path):
    scenario = load("hall", ["stop_on_collision=false", "physics.engine=kinematic", "robot.goal=[900.0, 0.0]"])
    asked, held = count(), {}

    def stop() -> bool:
        tick = next(asked)
        if tick in (TICKS // 2, TICKS):
            held[tick] = tracemalloc.get_traced_memory()[0]
        return tick >= TICKS

    episode = Episode(scenario, stop=stop, log=tmp_path / "a.mcap" if logged else None)
    tracemalloc.start()
    try:
        result = episode.run()
    finally:
        tracemalloc.stop()
    grown = (held[TICKS] - held[TICKS // 2]) / (TICKS - TICKS // 2)
    chunk_index = 1500 * logged  # what the file's end says of each chunk, of which a tick is a third or so
    assert grown <= SPARE * row_size(result.trajectory) + chunk_index + 300
