"""The published crowds through the normal loop: where people are, what the robot hears, how a run ends and is kept."""

import dataclasses

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.loop.events import Referee
from mjnav.loop.prepare import load_scenario
from mjnav.messages import Contact
from mjnav.motion.published_crowds import CROWDS, PublishedCrowd
from mjnav.scene.load import dumps, loads, with_seed
from mjnav.scene.spec import Scenario


@pytest.mark.parametrize("name", CROWDS)
def test_the_loop_moves_people_as_the_crowd_does_and_tells_the_robot_the_truth(name):
    crowd, wanted, absent, told = PublishedCrowd(name, 9), None, set(), set()
    scenario = load_scenario(name, {"stop_on_collision": False, "robot.goal_tolerance": 0.01}, seed=9)
    with mjnav.Simulation(scenario, controller="mean", scan=False) as simulation:
        sight = simulation.scenario.sensors.detection_range or np.inf
        assert simulation.scenario.robot.start[:2] == tuple(crowd.robot_pose[:2])
        while True:
            truth, touched, replaced = simulation.truth, (), []
            if wanted is not None:
                touched, replaced = crowd.move(wanted, truth.robot_pose[:2])
            there = np.delete(np.arange(len(crowd.position)), replaced)
            assert np.isnan(truth.people_position[replaced]).all()
            np.testing.assert_array_equal(truth.people_position[there], crowd.position[there])
            np.testing.assert_array_equal(truth.people_velocity[there], crowd.velocity[there])
            assert {contact.name for contact in truth.contacts} == {f"person{i}" for i in np.flatnonzero(touched)}
            if simulation.done:
                break
            gaps = np.linalg.norm(crowd.position - truth.robot_pose[:2], axis=1) - crowd.radius - 0.3
            beliefs = simulation.beliefs
            assert {track.name for track in beliefs.people} == {f"person{i}" for i in there if gaps[i] <= sight}
            np.testing.assert_allclose(beliefs.robot.mean, truth.robot_pose, atol=1e-12)
            for track in beliefs.people:
                i = int(track.name.removeprefix("person"))
                told |= absent & {i}
                assert track.radius == crowd.radius[i]
                np.testing.assert_allclose(track.mean, [*crowd.position[i], *crowd.velocity[i]], atol=1e-12)
            absent.update(replaced)
            wanted = crowd.velocities()
            simulation.step(0.25, 0.05)
    assert told or name != "crowdnav-plus"  # of newcomers


def test_a_copy_goes_on_to_the_same_end_and_noise_hides_the_velocities():
    scenario = load_scenario("crowdnav-plus", {"noise.profile": "pearson", "stop_on_collision": False}, seed=4)
    with mjnav.Simulation(scenario, controller="orca", scan=False) as simulation:
        for _ in range(30):
            assert all(reading.people_velocity is None for reading in simulation.readings)
            simulation.step(simulation.decide())
        twin = simulation.copy()
        for one in (simulation, twin):
            for _ in range(60):
                one.step(0.5, 0.1)
        np.testing.assert_array_equal(simulation.truth.people_position, twin.truth.people_position)
        assert simulation.summary["state_hash"] == twin.summary["state_hash"]


def test_metrics_from_a_log_are_those_in_memory_where_radii_change(tmp_path):
    path = tmp_path / "run.mcap"
    overrides = {"stop_on_collision": False, "robot.goal_tolerance": 0.01}
    result = mjnav.run(load_scenario("crowdnav-plus", overrides, seed=9), controller="mean", log=path)
    radius = result.trajectory.people_radius
    assert radius is not None
    assert (np.ptp(radius, axis=0) > 0.0).sum() > 3  # newcomers
    log = mjnav.open_log(path)
    for field in dataclasses.fields(result.trajectory):
        if "people" in field.name:
            found, expected = (getattr(one, field.name) for one in (log.trajectory(), result.trajectory))
            np.testing.assert_array_equal(found, expected)
    assert mjnav.replay(path).complete
    route, people = result.trajectory.robot_pose[:, None, :2], result.trajectory.people_position
    gaps = np.linalg.norm(people - route, axis=-1) - radius - 0.3
    assert result.summary["min_human_distance_m"] <= np.nanmin(gaps) + 1e-12
    assert result.summary["layout"] == "case 9"  # two cases are two layouts
    assert result.summary["mean_human_distance_m"] == pytest.approx(np.nanmin(gaps, axis=1).mean(), rel=1e-9)


@pytest.mark.parametrize("name", CROWDS)
def test_a_case_is_the_runs_seed_and_survives_a_dump(name):
    scenario = load_scenario(name, seed=3)
    assert scenario.published.case == 3
    assert loads(dumps(scenario)) == scenario
    again = loads(dumps(scenario, draft=True))
    assert again == scenario
    assert with_seed(again, 8) == load_scenario(name, seed=8)
    fixed = load_scenario(name, {"published.case": 8}, seed=3)
    assert fixed.people == load_scenario(name, seed=8).people
    assert fixed.seed == 3


def test_the_time_limit_comes_first_where_it_did_in_the_original():
    outcomes = []
    for name in ("crowdnav", "crowdnav-plus"):
        scenario: Scenario = load_scenario(name, seed=0)
        with mjnav.Simulation(scenario, scan=False) as simulation:
            contact = (Contact("person", "person0", 0.0, scenario.time_limit),)
            last = dataclasses.replace(simulation.truth, time=scenario.time_limit, contacts=contact)
        outcomes.append(Referee(scenario).outcome(last, None, on_last_leg=True))
    assert outcomes == ["collision", "timeout"]


@pytest.mark.parametrize(
    ("key", "value", "advice"),
    [
        ("published.crowd", "crowdnv", "did you mean 'crowdnav'"),
        ("physics.engine", "mujoco", '"kinematic" beside'),
        ("people_see_robot", True, "false or nothing"),
        ("robot.goal", [1.0, 1.0], "the case gives"),
        ("robot.start", [1.0, 1.0, 0.0], "the case gives"),
        ("robot.radius", 0.25, "0.3 beside"),
        ("pillars", [{"position": [0.0, 0.0], "radius": 0.2}], "none beside"),
        ("people", [{"start": [0.0, 0.0], "behaviour": "constant_velocity", "velocity": [1.0, 0.0]}], "the case gives"),
    ],
)
def test_what_does_not_fit_a_published_crowd_is_refused(key, value, advice):
    with pytest.raises(InvalidValue, match=key) as error:
        load_scenario("crowdnav", {key: value})
    assert advice in str(error.value)


def test_beyond_the_detection_range_nobody_is_detected():
    with mjnav.Simulation(load_scenario("hall", {"sensors.detection_range": 4.0}), scan=False) as simulation:
        truth, people = simulation.truth, simulation.scenario.people
        gaps = np.linalg.norm(truth.people_position - truth.robot_pose[:2], axis=1) - simulation.scenario.robot.radius
        gaps -= [person.radius for person in people]
        assert (gaps > 4.0).any()
        np.testing.assert_array_equal(np.isnan(simulation.readings[0].detections[:, 0]), gaps > 4.0)
