"""A controller cannot change the run behind the loop's back, and neither can what watches it."""

from contextlib import suppress
from dataclasses import FrozenInstanceError, fields, is_dataclass, replace

import numpy as np
import pytest

import mjnav
from mjnav import load_scenario
from mjnav.control import Decision, Status
from mjnav.control.methods.cvar import Cvar
from mjnav.control.parameters import Parameters
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import RealTimePacer
from mjnav.messages import RobotLimits, TickRecord


def attempts(array):
    """Every way to write to an array or to what it stands on."""
    yield lambda: array.__setitem__(..., 7.0)
    yield lambda: array.sort()
    yield lambda: array.__iadd__(1.0)
    yield lambda: array.setflags(write=True)
    yield lambda: setattr(array.flags, "writeable", True)
    yield lambda: memoryview(array).cast("B").__setitem__(0, 1)
    yield lambda: np.frombuffer(array).__setitem__(..., 7.0)
    yield lambda: np.copyto(array.view(), 7.0)
    yield lambda: np.ndarray(array.shape, array.dtype, array).__setitem__(..., 7.0)


def attack(value, *, rename=True, seen=None):
    """Writes to everything that can be reached from a value; returns how often that was possible.

    `rename` also gives messages other fields and arrays another shape: objects that nobody else may hold.
    """
    seen = {} if seen is None else seen
    if id(value) in seen or value is None or isinstance(value, (str, int, float)):
        return 0
    seen[id(value)] = value
    parts, done = [], 0
    if isinstance(value, np.ndarray):
        for attempt in attempts(value):
            with suppress(ValueError, TypeError, AttributeError):
                attempt()
                done += value.size > 0
        parts = [value.base]
        if rename:
            value.shape = (value.size,)
    elif is_dataclass(value):
        parts = [getattr(value, field.name) for field in fields(value)]
        for field in fields(value):
            with suppress(FrozenInstanceError):
                setattr(value, field.name, None)
                done += 1
            if rename:
                object.__setattr__(value, field.name, None)
    elif isinstance(value, (tuple, list)):
        parts = value
    return done + sum(attack(part, rename=rename, seen=seen) for part in parts)


class Plain(Cvar):
    """Decides as it should."""


class Attacker(Cvar):
    """Decides the same, and then writes to all that it was given, and to what it returned before."""

    written = 0
    returned: Decision | None = None

    def decide(self, observation):
        before, self.returned = self.returned, super().decide(observation)
        if before is not None:
            for name in ("v", "omega", "goal", "cone", "lane", "total"):
                getattr(before.costs, name)[...] = np.nan
        return self.returned

    def closest_cone(self, observation, decision):
        found = super().closest_cone(observation, decision)
        type(self).written += attack(observation) + attack(decision, rename=False)
        return found


@pytest.fixture
def scenario():
    """All that an observation may hold: people, legs, walls, lanes, a route with a corner."""
    overrides = ["time_limit=1.5", "robot.waypoints=[[0.5, 0.1], [6, 0]]", "robot.goal_tolerance=0.3"]
    overrides += ["walls=[{from=[-1, -2], to=[8, -2]}]", "tables=[{position=[4, 1]}]"]
    return lambda name: load_scenario("lane", overrides, controller=f"{__name__}:{name}", seed=4)


def test_a_controller_that_writes_to_all_it_can_reach_changes_nothing(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(Attacker, "written", 0)
    runs = {
        name: Episode(scenario(name), log=tmp_path / f"{name}.mcap", pacer=RealTimePacer(0.1)).run()
        for name in ("Plain", "Attacker")
    }
    plain, attacked = runs.values()
    assert Attacker.written == 0
    assert attacked.summary["ticks"] == 15
    assert attacked.summary["state_hash"] == plain.summary["state_hash"]
    logs = [mjnav.open_log(tmp_path / f"{name}.mcap") for name in runs]
    plain, attacked = (
        [(m.topic, m.sequence, str(m.value)) for m in log.messages("/decision", "/command", "/candidates", "/cone")]
        for log in logs
    )
    assert len(plain) == 60
    assert plain == attacked


class Greedy:
    """Gives its robot wings."""

    parameters_type = Parameters

    def __init__(self, limits, period, parameters):
        self.parameters = parameters
        object.__setattr__(limits, "max_speed", 50.0)

    def decide(self, observation):
        object.__setattr__(self.parameters, "samples", 1 + self.parameters.samples)
        return Decision(np.array(50.0), 0, Status.OK)

    def closest_cone(self, observation, decision):
        return None


class Fast(Greedy):
    """Drives as fast as a robot without wings."""

    def decide(self, observation):
        return Decision(RobotLimits().max_speed, 0.0, Status.OK)


def test_its_limits_and_parameters_are_copies_and_a_command_beyond_the_limits_does_not_count(scenario):
    seen = []
    made = scenario("Greedy")
    result = Episode(made, watch=seen.append).run()
    assert result.trajectory.command.max() == made.robot.limits.max_speed == RobotLimits().max_speed
    assert {len(record.observation.robot_pose) for record in seen} == {Parameters().samples}
    assert type(seen[0].decision.v) is float
    within = mjnav.run(scenario("Fast"))
    for key in ("state_hash", "control_cost"):
        assert result.summary[key] == within.summary[key], key
    assert result.summary["clipped_ticks"] == result.summary["ticks"]
    assert within.summary["clipped_ticks"] == 0


def test_a_watcher_cannot_write_either(scenario):
    seen: list[int] = []

    def watch(record: TickRecord):
        seen.append(attack(record))

    made = replace(scenario("Plain"), time_limit=0.5)
    watched, alone = mjnav.run(made, watch=watch), mjnav.run(made)
    assert seen == [0] * 5
    assert watched.summary["state_hash"] == alone.summary["state_hash"]
    for field in fields(alone.trajectory):
        if field.name != "timing":
            np.testing.assert_array_equal(
                getattr(watched.trajectory, field.name), getattr(alone.trajectory, field.name)
            )


def test_who_steps_a_simulation_by_a_shipped_method_changes_nothing_through_what_it_observes(scenario):
    ends = []
    for spoils in (False, True):
        with mjnav.Simulation(replace(scenario("Plain"), control=load_scenario("lane").control)) as simulation:
            while simulation.tick < 4:
                assert not (spoils and attack(simulation.observe()))
                simulation.step(simulation.decide())
            ends.append(simulation.summary["state_hash"])
    assert ends[0] == ends[1]
