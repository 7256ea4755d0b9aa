"""Decisions beyond the robot's limits are clipped, and the log says so."""

import pytest

import mjnav
from mjnav import scene
from mjnav.control.parameters import Parameters
from mjnav.messages import Decision, Status
from mjnav.metrics.summary import summarise

SCENE = """
schema = 1
name = "open"
time_limit = 1.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
min_speed = 0.4
max_turn_rate = 1.2
[physics]
engine = "kinematic"
[control]
method = "{method}"
"""


class Chosen:
    """Decides the same at every tick."""

    parameters_type = Parameters
    choice = (0.5, 0.0)

    def __init__(self, robot_limits, period, parameters):
        self.parameters = parameters

    def decide(self, observation):
        return Decision(*self.choice, Status.OK)

    def closest_cone(self, observation, decision):
        return None


class Wild(Chosen):
    choice = (50.0, -1e300)


class Flat(Chosen):
    choice = (1.0, -1.2)


class Halting(Chosen):
    choice = (0.0, 0.0)


class Reversing(Chosen):
    choice = (-0.1, 0.0)


def run(monkeypatch, kind, **options):
    monkeypatch.setattr("mjnav.control.registry.find", lambda *_: kind)
    return mjnav.run(scene.loads(SCENE.format(method=f"own:{kind.__name__}")), **options)


def test_a_decision_beyond_the_limits_is_clipped_to_them(monkeypatch, tmp_path):
    path = tmp_path / "wild.mcap"
    wild, flat = run(monkeypatch, Wild, log=path), run(monkeypatch, Flat)
    assert wild.summary["state_hash"] == flat.summary["state_hash"]
    assert wild.summary["control_cost"] == flat.summary["control_cost"] > 0.0
    assert (wild.trajectory.decision == [1.0, -1.2]).all()
    assert wild.summary["clipped_ticks"] == wild.summary["ticks"] == 10
    assert flat.summary["clipped_ticks"] == 0


def test_the_log_has_the_wish_beside_the_command_and_one_event(monkeypatch, tmp_path):
    path = tmp_path / "wild.mcap"
    result = run(monkeypatch, Wild, log=path)
    log = mjnav.open_log(path)
    decisions = [message.value for message in log.messages("/decision")]
    assert all((d["v"], d["omega"], d["wish"]) == (1.0, -1.2, {"v": 50.0, "omega": -1e300}) for d in decisions)
    events = [message.value.message for message in log.messages("/events") if message.value.name == "clipped"]
    assert len(events) == 1
    assert events[0].startswith("the controller chose 50 m/s, -1e+300 rad/s, which is beyond the robot's limits; ")
    again = summarise(log.trajectory(), log.scenario(), outcome="timeout")
    assert {key: result.summary[key] for key in again} == again


@pytest.mark.parametrize(("kind", "clipped"), [(Halting, 0), (Reversing, 10)])
def test_a_robot_with_a_least_speed_may_stop_but_not_reverse(monkeypatch, kind, clipped):
    result = run(monkeypatch, kind)
    assert result.summary["clipped_ticks"] == clipped
    assert (result.trajectory.command == 0.0).all()
