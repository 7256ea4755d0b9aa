"""Rooms for the loop: small, and with as much noise as a test asks for."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from mjnav import scene
from mjnav.scene import Scenario

ROOM = """
schema = 1
name = "room"
time_limit = 1.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
[[walls]]
from = [-1.0, -2.0]
to = [8.0, -2.0]
[[tables]]
position = [4.0, 1.0]
[[pillars]]
position = [3.0, -1.0]
[[people]]
start = [5.0, -0.2]
behaviour = "constant_velocity"
velocity = [-0.6, 0.0]
"""

EMPTY = """
schema = 1
name = "empty"
time_limit = 30.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [3.0, 0.0]
[physics]
engine = "kinematic"
"""

Make = Callable[..., Scenario]
LOOK = 1000  # [ns] that a look at the clock takes; a clock that stood still would be spun on for ever


@dataclass
class FakeClock:
    """Moves by what a look costs, by what is slept (and `oversleep`), and by what a test adds [ns]."""

    now: int = 5_000_000_000
    oversleep: int = 0
    look: int = LOOK

    def __call__(self) -> int:
        self.now += self.look
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += round(seconds * 1e9) + self.oversleep


@pytest.fixture
def slow_clock() -> FakeClock:
    """A clock by which every tick takes too long."""
    return FakeClock(look=30_000_000)


@pytest.fixture
def clock() -> FakeClock:
    """A clock that only moves when it is told to."""
    return FakeClock()


@pytest.fixture
def room() -> Make:
    """A furnished room with one person; overrides as `--set` takes them."""
    return lambda *overrides, **options: scene.loads(ROOM, overrides, **options)


@pytest.fixture
def empty() -> Make:
    """Open floor in the kinematic engine; overrides as `--set` takes them."""
    return lambda *overrides, **options: scene.loads(EMPTY, overrides, **options)
