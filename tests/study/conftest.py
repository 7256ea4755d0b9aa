"""Scenes whose risks are known in closed form, the observations and truths that go with them, and a small study."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mjnav import scene
from mjnav.messages import Observation, ObstacleSamples, WorldState
from mjnav.scene import Scenario
from mjnav.study.cells import resolve
from mjnav.study.study_file import load_study
from mjnav.study.sweep.sweep import trials
from mjnav.study.trial import Trial, run_trial

ONE_PILLAR = """
schema = 1
name = "one pillar"
time_limit = 3.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
[[pillars]]
position = [4.0, 0.05]
radius = 0.25
[noise]
profile = "gaussian"
[physics]
engine = "kinematic"
"""

ONE_PERSON = """
schema = 1
name = "one person"
time_limit = 3.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
[[people]]
start = [4.0, 0.2]
behaviour = "constant_velocity"
velocity = [-0.5, 0.0]
[physics]
engine = "kinematic"
"""


@pytest.fixture
def pillar() -> Callable[..., Scenario]:
    """A pillar nearly straight ahead; overrides as `--set` takes them."""
    return lambda *overrides, **options: scene.loads(ONE_PILLAR, overrides, **options)


@pytest.fixture
def person() -> Callable[..., Scenario]:
    """A person who comes towards the robot; overrides as `--set` takes them."""
    return lambda *overrides, **options: scene.loads(ONE_PERSON, overrides, **options)


def known_state(
    *discs: tuple[float, float, float, float, float], pose=(0.0, 0.0, 0.0), twist=(0.8, 0.0)
) -> Observation:
    """What one who knows everything observes: discs are x, y, vx, vy, radius."""
    return Observation(
        robot_pose=np.array([pose]),
        control_noise=np.zeros((1, 2)),
        twist=np.array(twist),
        obstacles=tuple(ObstacleSamples(np.array([d[:2]]), np.array([d[2:4]]), d[4]) for d in discs),
        goal=np.array([6.0, 0.0]),
    )


def true_state(*people: tuple[float, float, float, float], pose=(0.0, 0.0, 0.0)) -> WorldState:
    """The truth; people are x, y, vx, vy."""
    rows = np.array(people, float).reshape(-1, 4)
    return WorldState(1.0, np.array(pose), np.array([0.8, 0.0]), rows[:, :2], rows[:, 2:])


@pytest.fixture
def known() -> Callable[..., Observation]:
    return known_state


@pytest.fixture
def true() -> Callable[..., WorldState]:
    return true_state


FOUR_CELLS = """
schema = 1
name = "small"
scenes = ["crossing1"]
seeds = { first = 5, count = 4 }
[set]
physics.engine = "kinematic"
time_limit = 1.0
[[settings]]
name = "pearson"
[[settings]]
name = "bimodal"
set = { noise.profile = "bimodal" }
[[methods]]
controller = "rkhs"
grid = { weight = [3.0] }
[[methods]]
controller = "mean"
"""


@pytest.fixture(scope="session")
def small_study(tmp_path_factory) -> Path:
    """A study of 16 episodes that take a second together."""
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(FOUR_CELLS)
    return path


@pytest.fixture(scope="session")
def small_trials(small_study) -> list[Trial]:
    study = load_study(small_study)
    return trials(study, resolve(study))


@pytest.fixture(scope="session")
def serial_hashes(small_trials) -> dict[str, str]:
    """The state hash of each of its episodes by id, run here one after another."""
    return {row.id: str(row.figures["state_hash"]) for row in map(run_trial, small_trials)}
