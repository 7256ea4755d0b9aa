import numpy as np
import pytest

from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Table, Wall
from mjnav.world import mujoco_engine
from mjnav.world.simulator import Simulator

STANDING = ConstantVelocity((0.0, 0.0))
AHEAD = {
    "person": {"people": (Person((9.0, 9.0), STANDING), Person((1.5, 0.0), STANDING))},
    "table": {"tables": (Table((9.0, 9.0)), Table((1.9, 0.4), size=(0.8, 0.8)))},
    "wall": {"walls": (Wall((8.0, 8.0), (9.0, 8.0)), Wall((1.2, -1.0), (1.2, 1.0)))},
    "pillar": {"pillars": (Pillar((9.0, 9.0)), Pillar((1.5, 0.05)))},
}


@pytest.mark.parametrize("kind", AHEAD)
def test_a_contact_names_what_the_robot_ran_into(scene, engine, kind):
    simulator = Simulator(scene(engine=engine, **AHEAD[kind]), 0)
    seen = []
    for _ in range(30):
        simulator.advance(0.1, (0.8, 0.0))
        seen += simulator.state().contacts
    assert {(contact.kind, contact.name) for contact in seen} == {(kind, f"{kind}1")}
    assert 0.8 < seen[0].time < 2.2
    if engine == "mujoco":
        assert max(contact.force for contact in seen) > 5.0
    else:
        assert all(contact.force == 0.0 for contact in seen)


@pytest.mark.parametrize("seed", range(6))
def test_steps_taken_in_batches_miss_no_contact(clutter, monkeypatch, seed):
    """Against the same run with every step looked at."""
    rng = np.random.default_rng(seed)
    commands = [(rng.uniform(0.3, 1.0), rng.uniform(-1.5, 1.5)) for _ in range(25)]
    heading = rng.uniform(-1.0, 1.0)

    def run() -> tuple[list, str]:
        simulator, contacts = Simulator(clutter(start=(0.0, 0.0, heading), profile="pearson"), seed), []
        for command in commands:
            simulator.advance(0.2, command)
            contacts += simulator.state().contacts
        return contacts, simulator.state_hash()

    batched = run()
    monkeypatch.setattr(mujoco_engine.MujocoEngine, "_is_untouched", lambda self, duration: False)
    each = run()
    assert each == batched
    assert each[0]


def test_a_pass_at_two_millimetres_is_no_contact(scene, engine):
    simulator = Simulator(scene(engine=engine, pillars=(Pillar((1.0, 0.422)),)), 0)
    for _ in range(25):
        simulator.advance(0.1, (1.0, 0.0))
        assert simulator.state().contacts == ()
    assert simulator.state().robot_pose[0] > 1.5
