"""Plug-ins of every kind in a run: their seeds, what they may touch, what they may return."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue, MjnavError
from mjnav.messages import Decision, Status
from mjnav.noise import Gaussian
from mjnav.robot.estimation.base import robot_belief
from mjnav.robot.prediction import Crowd, Futures
from mjnav.scene import dumps
from mjnav.scene.load import loads

QUICK = {"physics.engine": "kinematic", "time_limit": 0.5}


class Fixes:
    """A localizer that believes every pose reading; `spoil` changes what it returns."""

    asked = 0

    def __init__(self, scenario, seed, parameters):
        self.num = scenario.estimation.robot.particles

    def spoil(self, belief):
        return belief

    def update(self, reading):
        type(self).asked += 1
        for array in (reading.pose, reading.detections, reading.odometry):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 7.0
        return self.spoil(robot_belief(reading.time, np.tile(reading.pose, (self.num, 1))))


class Drawn:
    """A behaviour that walks where its generator says."""

    def __init__(self, scenario, person, rng, parameters):
        self.rng = rng

    def velocity(self, world):
        with pytest.raises(ValueError, match="read-only"):
            world.robot_pose[0] = 100.0
        return 0.1 * self.rng.standard_normal(2)


def test_no_tick_of_a_warm_up_reaches_an_object_of_the_users(monkeypatch):
    monkeypatch.setattr(Fixes, "asked", 0)
    result = mjnav.run(mjnav.load_scenario("crossing1", QUICK, localizer=Fixes))
    assert Fixes.asked == len(result.trajectory.status) == 5


def test_a_behaviour_has_its_own_stream_a_person_that_follows_the_seed():
    scene = mjnav.load_scenario("hall", {**QUICK, "people.0.behaviour": Drawn, "people.1.behaviour": Drawn})
    first, again, other = (mjnav.run(scene, seed=seed) for seed in (1, 1, 2))
    assert first.summary["state_hash"] == again.summary["state_hash"]
    velocity = first.trajectory.people_velocity
    assert not np.allclose(velocity[:, 0], velocity[:, 1])
    assert not np.allclose(velocity[:, 0], other.trajectory.people_velocity[:, 0])


@dataclass(frozen=True)
class Counting:
    count: int = 3


def test_a_behaviour_has_no_parameter_that_is_called_count_which_says_how_many_are_drawn(monkeypatch):
    monkeypatch.setattr(Drawn, "parameters_type", Counting, raising=False)
    with pytest.raises(InvalidValue, match=r"people.0.behaviour.*parameters that are not called count"):
        mjnav.load_scenario("crossing1", {**QUICK, "people.0.behaviour": Drawn})


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda self, b: replace(b, weights=b.weights * 0.5), "weights must be >= 0 and sum to 1: the least is"),
        (lambda self, b: replace(b, particles=b.particles[:, :2]), "particles has shape (500, 2) in place of (500, 3)"),
        (lambda self, b: replace(b, particles=b.particles * 1e300), "particles holds a number beyond 1e+12"),
        (lambda self, b: b.mean, "update() returned a ndarray in place of a RobotBelief"),
        (lambda self, b: 1 / 0, "ZeroDivisionError: division by zero"),
    ],
)
def test_a_belief_that_is_none_ends_the_run_with_an_event(spoil, said, monkeypatch, tmp_path):
    monkeypatch.setattr(Fixes, "spoil", spoil)
    with pytest.raises(MjnavError) as raised:
        mjnav.run(mjnav.load_scenario("crossing1", QUICK, localizer=Fixes), log=tmp_path / "a.mcap")
    assert said in str(raised.value)
    assert raised.value.result.summary["outcome"] == "aborted"
    events = [message.value for message in mjnav.open_log(tmp_path / "a.mcap").messages("/events")]
    assert any(said in str(event) for event in events)


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (None, "None (NoneType) in place of a Decision"),
        (Decision(10**400, 0.0, Status.OK), "a Decision that cannot be used: v: found 1000"),
        (Decision(0.0, 0.0, "ok"), "a Decision that cannot be used: status: found 'ok'; allowed: a Status: OK,"),
    ],
)
def test_a_decision_that_is_none_ends_the_run_and_names_the_class(returned, said):
    class Odd:
        def decide(self, observation):
            return returned

    with pytest.raises(MjnavError) as raised:
        mjnav.run(mjnav.load_scenario("crossing1", QUICK), controller=Odd())
    assert f"{__name__}:test_a_decision_that_is_none_ends_the_run_and_names_the_class.<locals>.Odd()" in str(
        raised.value
    )
    assert f"decide() returned {said}" in str(raised.value)


@pytest.mark.parametrize("returned", [("1", "0"), (1.0 + 2.0j, 0.0), (True, False)])
def test_what_a_plug_in_returns_is_made_of_real_numbers(returned, monkeypatch):
    monkeypatch.setattr(Drawn, "velocity", lambda self, world: returned)
    with pytest.raises(MjnavError, match=r"velocity\(\) is no array of numbers \(.* in place of real numbers\)"):
        mjnav.run(mjnav.load_scenario("crossing1", {**QUICK, "people.0.behaviour": Drawn}))
    monkeypatch.setattr(Narrow, "sample", lambda self, rng, size: np.resize(returned, size))
    with pytest.raises(MjnavError, match=r"sample\(\) raised TypeError: .* in place of real numbers"):
        mjnav.run(mjnav.load_scenario("crossing1", {**QUICK, "noise.gyro": Narrow()}))


class Narrow:
    """Noise without a dataclass, given as an object."""

    mean, std, support = 0.0, 0.01, (-0.02, 0.02)

    def sample(self, rng, size):
        return rng.uniform(-0.02, 0.02, size)

    def logpdf(self, x):
        return np.where(np.abs(x) <= 0.02, np.log(25.0), -np.inf)


def test_a_distribution_may_be_an_object_and_a_scenario_with_it_is_written_by_name():
    scene = mjnav.load_scenario("crossing1", {**QUICK, "noise.gyro": Narrow(), "noise.pose.x": Gaussian(std=0.1)})
    text = dumps(scene)
    assert f'distribution = "{__name__}:Narrow()"' in text
    assert dumps(loads(text)) == text  # and read again: that imports nothing
    assert mjnav.run(scene).summary["ticks"] == 5
    with pytest.raises(InvalidValue, match="the distribution itself, handed over in Python"):
        mjnav.run(loads(text))


class Stays:
    """Everybody stays where they are; `spoil` changes what it returns."""

    def __init__(self, scenario, seed, parameters):
        self.num = scenario.prediction.num_steps

    def spoil(self, futures):
        return futures

    def predict(self, crowd: Crowd):
        with pytest.raises(ValueError, match="read-only"):
            crowd.samples[...] = 0.0
        paths = np.repeat(crowd.samples[:, :, None, :2], self.num + 1, axis=2)
        return self.spoil(Futures.along(paths, 0.4))


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda f: None, "predict() returned a NoneType in place of Futures"),
        (lambda f: replace(f, ahead=f.ahead[:, :3]), "ahead has shape (1, 3, 12, 2) in place of (1, 25, 12, 2)"),
        (lambda f: replace(f, position=f.position * np.nan), "position holds a number that is not finite"),
        (lambda f: replace(f, step=0.0), "step must be a finite number > 0, not 0.0"),
    ],
)
def test_a_future_that_is_none_ends_the_run(spoil, said, monkeypatch):
    monkeypatch.setattr(Stays, "spoil", lambda self, futures: spoil(futures))
    with pytest.raises(MjnavError) as raised:
        mjnav.run(mjnav.load_scenario("crossing1", {**QUICK, "prediction.model": Stays}))
    assert said in str(raised.value)
