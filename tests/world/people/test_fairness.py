"""People who see the robot are fair to it: they go round one that stands, and do not turn round at once."""

import numpy as np
import pytest

import mjnav
from mjnav.scene.spec import Orca, Person, SocialForce
from mjnav.world.simulator import Simulator

LAWS = ("orca", "moussaid_2009", "moussaid", "helbing")
NOT_AFTER_THE_ROBOT = ("regular", "yields", "impassive", "scared")


def parked(law: str, temperament: str, seed: int) -> bool:
    """Whether anybody touches a robot that stands for 30 s in the middle of a crowd."""
    keys = {"behaviour": "orca"} if law == "orca" else {"behaviour": "social_force", "form": law}
    overrides = {f"people.0.{key}": value for key, value in {**keys, "temperament": temperament}.items()}
    middle = {"robot.start_area": [[5.0, -1.5], [9.0, 1.5]], "physics.engine": "kinematic", "noise.profile": "none"}
    simulator = Simulator(mjnav.load_scenario("crowds", {"seed": seed, **middle, **overrides}), seed, lidar=False)
    for _ in range(30):
        simulator.advance(1.0, (0.0, 0.0))
        if any(contact.kind == "person" for contact in simulator.state().contacts):
            return True
    return False


def test_a_parked_robot_is_touched_in_at_most_one_run_in_twenty():
    kinds = [(law, temperament) for law in LAWS for temperament in NOT_AFTER_THE_ROBOT]
    runs = [parked(*kind, (3 * i + k) % 12) for i, kind in enumerate(kinds) for k in range(3)]
    assert sum(runs) <= 0.05 * len(runs)


@pytest.mark.parametrize("behaviour", [Orca, SocialForce])
def test_who_turns_back_slows_down_and_speeds_up_as_walkers_do(scene, behaviour):
    def greatest(**keys):
        person = Person((0.0, 5.0), behaviour(waypoints=((1.0, 5.0), (0.0, 5.0)), speed=1.3, **keys))
        simulator, velocity = Simulator(scene(engine="kinematic", people=(person,)), 0), []
        for _ in range(400):
            simulator.advance(0.02, (0.0, 0.0))
            velocity.append(simulator.state().people_velocity[0])
        return np.hypot(*np.diff(velocity, axis=0).T).max() / 0.02

    assert greatest() <= 2.5 + 1e-6
    assert greatest(acceleration=1000.0) > 4.0
