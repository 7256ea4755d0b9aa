"""Nothing is compiled, loaded or imported after tick 0, whatever a run comes to."""

import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from mjnav.compile.compiled import load_kernels
from mjnav.control import names
from mjnav.filters.particles import ess
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import warm_up
from tests.attacks.first_time_work import PEOPLE, RATES, ROBOT, first_time_work, late_work, settings

# Every kind of body, and of people: on routes, under the laws of avoidance, with temperaments, coming and going. No
# fewer than there are rates.
SCENES = ("five", "hall", "lane", "table", "corridor4", "robot_crowding")


@pytest.fixture(scope="module", autouse=True)
def decided_once():
    """Every method has decided in another scene: the kernels that each of its decisions calls are none of a scene's."""
    for method in names():
        warm_up(load_scenario("crossing1", {"control.method": method, "physics.engine": "kinematic"}))


def trace(*seconds):
    return f'control.latency={{model="sampled", trace=[{", ".join(map(str, seconds))}]}}'


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_is_loaded_late_by_any_method(scene):
    shift = SCENES.index(scene)  # over the scenes, every method meets every filter and every rate
    for i, method in enumerate(names(), shift):
        rate = RATES[i % len(RATES)]
        choices = settings(
            method, ROBOT[(i + shift // 2) % len(ROBOT)], PEOPLE[i % len(PEOPLE)], rate, "sensors.rate=100"
        )
        engine = 'physics.engine="kinematic"' if i % 2 else 'physics.engine="mujoco"'
        assert late_work(scene, [*choices, engine], ticks=4) == [], method


@pytest.mark.parametrize(("robot", "people"), [("particle", "particle"), ("ekf", "kalman")])
def test_nothing_is_loaded_late_by_a_robot_that_goes_by_its_lidar(robot, people):
    filters = [f"estimation.robot.filter={robot}", f"estimation.obstacles.filter={people}"]
    carried_away = "faults.kidnap={time=0.5, pose=[8.0, -1.5, 2.0]}"
    assert late_work("hall-lidar", [*filters, carried_away, "physics.engine=kinematic"], ticks=20) == []


@pytest.mark.parametrize("rate", RATES)
def test_nothing_is_loaded_late_at_the_second_reading(rate):
    choices = settings("rkhs", ROBOT[0], PEOPLE[0], rate)
    assert late_work("crossing3", choices, ticks=2 * rate // 10 + 2) == []


@pytest.mark.parametrize(
    "choice",
    [
        trace(0.0),
        trace(0.03, 0.14),
        'control.latency={model="measured"}',
        "control.delay=0",
        "control.delay=2",
        "control.prediction=false",
        "people=[]",
        'noise.profile="none"',
        'noise.profile="bimodal"',
        'estimation.assumed_profile="none"',  # unexplained readings: the filters are spread again
    ],
)
def test_nothing_is_loaded_late_by_a_setting(choice):
    assert late_work("crossing3", [choice], ticks=15) == []


@pytest.mark.parametrize(("scene", "method"), [("hall", "mean"), ("lane", "dwa"), ("table", "mean")])
def test_nothing_is_loaded_late_at_contacts_violations_and_the_goal(scene, method):
    choices = ["stop_on_collision=false", "time_limit=25.0", f'control.method="{method}"']
    assert late_work(scene, choices) == []


def test_nothing_is_loaded_late_where_no_plan_is_feasible():
    met = ["people.0.start=[1.2, 0.0]", "people.0.velocity=[-1.4, 0.0]", "stop_on_collision=false"]
    records = []
    choices = [*met, "control.method=rkhs-plan", "physics.engine=kinematic", "time_limit=2.0"]
    assert late_work("crossing1", choices, watch=records.append) == []
    assert {record.decision.plan.feasible for record in records} == {True, False}


def test_what_is_loaded_compiled_or_imported_is_seen():
    load_kernels()
    sys.modules.pop("tabnanny", None)
    with first_time_work() as work:
        ess(np.ones(2, np.float32))  # from the cache, but for the first time ever
        njit(lambda x: x + 1)(1)
        import_module("tabnanny")
    assert {"a pass of the compiler", "<lambda>", "tabnanny"} <= set(work)
    assert any(what.startswith("ess(Array(float32") for what in work)


PROGRAM = """
import mjnav
from itertools import count
from mjnav.loop.episode import Episode
from tests.attacks.first_time_work import first_time_work
asked, blocks = count(), []
def stop():
    tick = next(asked)
    if tick == 0:
        blocks.append(first_time_work())
        blocks.append(blocks[0].__enter__())
    return tick > 25
mjnav.run("crossing1", log="a.mcap", stop=stop)
blocks[0].__exit__(None, None, None)
print(blocks[1])
"""


def test_a_process_of_its_own_has_nothing_left_to_load_at_tick_0(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert (done.stdout.splitlines()[-1:], done.stderr) == (["[]"], "")
