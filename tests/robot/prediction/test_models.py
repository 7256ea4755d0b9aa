"""What holds of every model of prediction."""

from dataclasses import replace

import pytest

import mjnav
from mjnav.scene.prediction import MODELS, Prediction

QUICK = {"physics.engine": "kinematic", "time_limit": 2.0}


@pytest.mark.parametrize("model", ["mixture", "social_force"])
def test_no_model_changes_what_else_is_drawn(model):
    scene = mjnav.load_scenario("crossing1", QUICK)
    other = replace(scene, prediction=Prediction(model=MODELS[model]()))
    with mjnav.Simulation(scene) as plain, mjnav.Simulation(other) as predicted:
        for k in range(15):
            a, b = plain.observe(), predicted.observe()
            assert (a.robot_pose == b.robot_pose).all()
            assert (a.control_noise == b.control_noise).all()
            assert b.obstacles[0].future.shape == (25, 12, 2)
            assert (plain.beliefs.people[0].particles == predicted.beliefs.people[0].particles).all()
            for simulation in (plain, predicted):
                simulation.step(0.5, 0.1 * (k % 3))


@pytest.mark.parametrize("model", ["mixture", "social_force"])
def test_a_log_says_the_model_and_is_repeated_with_it(model, tmp_path):
    mjnav.run(mjnav.load_scenario("crossing1", {**QUICK, "prediction.model": model}), log=tmp_path / "a.mcap")
    log = mjnav.open_log(tmp_path / "a.mcap")
    assert log.run["prediction"] == model
    fans = [
        entity
        for message in log.messages("/scene")
        for entity in message.value.entities
        if entity.id == "person0_future"
    ]
    assert len(fans) == 20  # one a tick
    assert {(len(fan.lines), len(fan.lines[0].points)) for fan in fans} == {(8, 13)}
    assert mjnav.replay(log).identical


@pytest.mark.parametrize("model", ["mixture", "social_force"])
def test_a_branch_goes_on_as_its_origin(model):
    with mjnav.Simulation(mjnav.load_scenario("crossing1", {**QUICK, "prediction.model": model})) as simulation:
        for _ in range(5):
            simulation.step(simulation.decide())
        twin = simulation.copy()
        for one in (simulation, twin):
            while not one.done:
                one.step(one.decide())
        assert simulation.summary["state_hash"] == twin.summary["state_hash"]
