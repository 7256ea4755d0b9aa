"""A copy of a simulation and its original go the same way, bit for bit, and leave one another alone."""

import threading

import pytest

from mjnav import control
from mjnav.control.methods.mean import Mean
from mjnav.errors import InputError, InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.simulation import Simulation

KINEMATIC = ("physics.engine=kinematic", "time_limit=0.5")
CROWD = (
    'people=[{start=[3, 0], behaviour="waypoints", waypoints=[[2.9, 0], [2, 1]], speed=1.0, loop=true},'
    '{start=[4, -1], behaviour="stop_and_go", velocity=[-0.5, 0.2], go_time=0.2, stop_time=0.1}]'
)
TOUCHING = (
    "pillars.0.position=[0.45, 0.05]",
    "control.sensing_range=0.01",
    "stop_on_collision=false",
    "time_limit=1.2",
)
CASES = {
    **{method: (method, KINEMATIC) for method in control.names()},
    "mujoco": ("rkhs", ("time_limit=0.8",)),
    "in contact": ("mean", TOUCHING),
    "people with behaviours": ("mean", (CROWD, "time_limit=0.6")),
    "latency drawn": ("mean", (*KINEMATIC, 'control.latency={model="sampled", trace=[0.02, 0.15, 0.31]}')),
    "kalman": ("mean", (*KINEMATIC, "estimation.robot.filter=ekf", "estimation.obstacles.filter=kalman")),
    "direct": ("mean", (*KINEMATIC, "estimation.robot.source=direct", "estimation.obstacles.source=direct")),
    "by lidar": ("mean", (*KINEMATIC, "estimation.robot.source=lidar", "estimation.obstacles.source=lidar")),
    "rates": ("mean", (*KINEMATIC, "sensors.rate=4", "control.rate=25")),
}


@pytest.mark.parametrize("case", CASES)
def test_from_any_tick_a_copy_ends_where_the_unbroken_run_does(room, case):
    method, overrides = CASES[case]
    scenario = room(*overrides, controller=method)
    simulation, saved = Simulation(scenario), Simulation(scenario)
    while not simulation.done:
        if simulation.tick % 3 == 1:
            simulation.decide()  # in the middle of a tick, too
        simulation, left = simulation.copy(), simulation
        left.step(0.9, -1.0)  # what one does is nothing to the other
        if simulation.tick == 2:
            saved = simulation.copy()
        simulation.step(simulation.decide())
    expected = Episode(scenario).run().summary
    assert simulation.summary["state_hash"] == expected["state_hash"]
    assert simulation.summary["control_cost"] == expected["control_cost"]
    simulation.restore(saved)
    assert simulation.tick == 2
    while not simulation.done:
        simulation.step(simulation.decide())
    assert simulation.summary["state_hash"] == expected["state_hash"]
    assert saved.tick == 2
    if case == "in contact":
        assert expected["collisions"]["pillar"] > 0


def test_a_copy_does_not_write_to_the_log(room, tmp_path):
    with Simulation(room(), log=tmp_path / "a.mcap") as simulation:
        simulation.step(0.1, 0.0)
        branch = simulation.copy()
        branch.step(0.2, 0.0)
        with pytest.raises(InvalidValue, match=r"^restore\(\): found .*; allowed: a simulation without a log"):
            simulation.restore(branch)
        branch.close()
    assert (simulation.summary["ticks"], branch.summary["ticks"]) == (1, 2)
    assert branch.summary["log"] is None
    branch = Simulation(room())
    with pytest.raises(InvalidValue, match="a simulation of the same scenario"):
        branch.restore(Simulation(room("seed=1")))
    with pytest.raises(InvalidValue, match=r"^restore\(\): found nothing; allowed: a Simulation"):
        branch.restore(None)


class Locked(Mean):
    """Holds what cannot be copied."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.lock = threading.Lock()


def test_what_cannot_be_copied_is_named(room):
    simulation = Simulation(room(controller=f"{__name__}:Locked"))
    simulation.step(simulation.decide())
    with pytest.raises(InputError, match=r"copy\(\): TypeError: cannot pickle '_thread.lock' object; .* __deepcopy__"):
        simulation.copy()
    simulation.step(simulation.decide())
