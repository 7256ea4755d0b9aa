"""What a run keeps of a tick is its row of the trajectory's arrays; longer studies: long_run.py."""

import tracemalloc
from collections import deque
from dataclasses import fields
from itertools import count

import numpy as np
import pytest

from mjnav.log.read.trajectory import TrajectoryBuilder
from mjnav.loop.episode import Episode
from mjnav.messages import TickRecord, TickTiming, Trajectory
from mjnav.metrics.summary import summarise
from mjnav.metrics.timing import compute_ms
from mjnav.scene import load

pytestmark = pytest.mark.nightly

HOUR = 36_000  # ticks
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


def test_an_hour_of_ticks_and_its_figures_take_less_than_50_MB(scenario):
    records: deque[TickRecord] = deque(maxlen=1)
    asked = count()
    Episode(scenario, stop=lambda: next(asked) >= 3, watch=records.append).run()
    builder = TrajectoryBuilder()
    for tick in range(HOUR):
        builder.add(records[0])
        builder.add_timing(TickTiming(tick, (1, 2, 3, 4, 5), 0, False))
    tracemalloc.start()
    try:
        trajectory = builder.finish(records[0].truth)
        summarise(trajectory, scenario, outcome="timeout")
        compute_ms(trajectory.timing)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(trajectory.command) == HOUR
    assert size(trajectory) + peak < 45e6
