"""The people of a scene without the robot, and what it cost them."""

from dataclasses import replace

import numpy as np

import mjnav
from mjnav.scene.spec import Person
from mjnav.settings.plugins import BehaviourPlugin


class Aside:
    """Walks to the right, and aside while the robot is within 3 m."""

    def __init__(self, scenario, person, rng, parameters):
        self._person = person

    def velocity(self, world):
        near = np.hypot(*(world.robot_pose[:2] - world.people_position[self._person])) < 3.0
        return (0.0, 1.0) if near else (1.0, 0.0)


def scene(engine, *people):
    scenario = mjnav.load_scenario("crossing1", (f"physics.engine={engine}", "time_limit=2"), seed=4)
    return replace(scenario, people=people, stop_on_collision=False)


def test_who_steps_aside_for_the_robot_is_elsewhere_and_the_run_is_the_same():
    start = mjnav.load_scenario("crossing1").robot.start
    scenario = scene("kinematic", Person((start[0], start[1] + 2.0), BehaviourPlugin.of(Aside)))
    without, asked = mjnav.run(scenario), mjnav.run(scenario, detour=True)
    assert without.summary["state_hash"] == asked.summary["state_hash"]
    assert without.summary["detour"] == {"path_m": None, "delay_s": None, "displacement_m": None}
    assert asked.summary["detour"]["displacement_m"] > 0.5
    assert asked.summary["detour"]["path_m"] is None  # there is no waypoint


def test_a_behaviour_that_breaks_without_the_robot_leaves_the_result_and_says_so():
    class Broken(Aside):
        def velocity(self, world):
            return (1.0, 0.0) if abs(world.robot_pose[0]) < 100.0 else (np.nan, 0.0)

    result = mjnav.run(scene("kinematic", Person((0.0, 9.0), BehaviourPlugin.of(Broken))), detour=True)
    assert result.summary["ticks"] == 20
    assert result.summary["detour"]["displacement_m"] is None
    (fault,) = result.metrics.faults
    assert fault.startswith("detour: the people without the robot: ")
