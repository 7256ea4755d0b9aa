"""What a run keeps of a tick is its row of the trajectory's arrays."""

import tracemalloc
from dataclasses import fields
from itertools import count

import numpy as np
import pytest

from mjnav.loop.episode import Episode
from mjnav.messages import Trajectory
from mjnav.scene import load

pytestmark = pytest.mark.nightly

TICKS = 400


@pytest.fixture
def scenario():
    return load("hall", ["stop_on_collision=false", "physics.engine=kinematic", "robot.goal=[900.0, 0.0]"])


def size(trajectory: Trajectory) -> int:
    """Bytes of the arrays."""
    arrays = (getattr(trajectory, field.name) for field in fields(trajectory))
    return sum(value.nbytes for value in arrays if isinstance(value, np.ndarray))


@pytest.mark.parametrize("logged", [False, True])
def test_a_tick_costs_no_more_memory_than_its_row(scenario, logged, tmp_path):
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
    assert grown <= chunk_index + 1500
    assert size(result.trajectory) <= 1000 * (TICKS + 1)  # and the state in which it ended
