"""A scenario stepped by hand is the run of `mjnav run`, and whatever a caller does ends in order."""

from dataclasses import replace

import numpy as np
import pytest

import mjnav
from mjnav.errors import InputError, InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.simulation import Simulation, SimulationOver
from mjnav.messages import Beliefs, Decision, Detection, Status
from mjnav.robot.estimation import make_localizer, make_tracker

DETECTION = Detection(0.0, np.zeros(2), np.eye(2), 0.3, 5)
ENGINES = ("mujoco", "kinematic")


def finished(simulation: Simulation) -> str:
    """The state hash after the scenario's own controller has driven to the end."""
    while not simulation.done:
        simulation.step(simulation.decide())
    return simulation.summary["state_hash"]


# ---------------------------------------------------------------------------------- one code path


@pytest.mark.parametrize("engine", ENGINES)
def test_stepped_by_hand_a_seed_ends_in_the_state_and_the_figures_of_the_run(room, engine):
    scenario = room(f"physics.engine={engine}")
    run = Episode(scenario).run().summary
    simulation = Simulation(scenario)
    finished(simulation)
    clock = ("compute_ms", "real_time_factor")
    assert {k: v for k, v in simulation.summary.items() if k not in clock} == {
        k: v for k, v in run.items() if k not in clock
    }


def test_looking_changes_nothing(room):
    scenario = room()
    quiet, looked_at = Simulation(scenario), Simulation(scenario)
    for simulation, looks in ((quiet, False), (looked_at, True)):
        while not simulation.done:
            if looks:
                assert simulation.observe() is simulation.observe()
                assert simulation.readings[-1].time == simulation.truth.time == pytest.approx(simulation.time)
                assert repr(simulation).endswith("running)")
                assert simulation.summary["ticks"] == len(simulation.trajectory.command) == simulation.tick
                assert simulation.beliefs is simulation.beliefs
            simulation.step(0.4, 0.1)
    assert looked_at.summary["state_hash"] == quiet.summary["state_hash"]


def test_what_is_shown_cannot_be_written_to_and_stays_the_same_object_until_the_next_step(room):
    simulation = Simulation(room())
    branch = simulation.copy()
    for one in (simulation, branch):
        for array in (one.truth.robot_pose, one.beliefs.robot.particles, one.readings[-1].pose):
            with pytest.raises(ValueError, match="read-only"):
                array -= 1.0
        assert (one.truth, one.beliefs, one.readings) == (one.truth, one.beliefs, one.readings)


# ----------------------------------------------------------------------------------------- commands


@pytest.mark.parametrize(
    ("command", "key"),
    [((np.nan, 0.0), "v"), ((0.0, np.inf), "omega"), ((0.1,), "omega"), (("fast", 0.0), "v"), ((10**400, 0.0), "v"),
     ((Decision(np.nan, 0.0, Status.OK),), "v"), ((Decision(0.0, 0.0, Status.OK), 1.0), "omega"),
     ((Decision(0.0, 10**400, Status.OK),), "omega"), ((Decision(0.0, 0.0, "fine"),), "status"),
     ((Decision(0.0, 0.0, Status.OK, costs=3),), "costs")],
)  # fmt: skip
def test_a_command_that_is_none_is_refused_and_changes_nothing(room, command, key):
    simulation, other = Simulation(room("time_limit=0.2")), Simulation(room("time_limit=0.2"))
    with pytest.raises(InvalidValue, match=f"^{key}: found "):
        simulation.step(*command)
    assert finished(simulation) == finished(other)


# -------------------------------------------------------------------------------------------- ends


def test_after_its_end_it_can_be_looked_at_and_after_closing_no_more(room):
    simulation = Simulation(room("time_limit=0.2"))
    finished(simulation)
    assert (simulation.done, simulation.outcome, simulation.tick) == (True, "timeout", 2)
    assert simulation.observe().time > 0.2
    with pytest.raises(SimulationOver, match=r"^step\(\): the simulation has ended: timeout after 0.2 s$"):
        simulation.step(0.0, 0.0)
    simulation.close()
    simulation.close()
    for call in (simulation.observe, simulation.decide, simulation.copy, lambda: simulation.step(0.0, 0.0)):
        with pytest.raises(SimulationOver, match="the simulation is closed"):
            call()
    assert simulation.summary["outcome"] == "timeout"
    assert repr(simulation) == "Simulation('room', seed=0, t=0.2 s, closed)"


def test_an_exception_within_it_closes_the_log_in_order(room, tmp_path):
    def breaking(simulation: Simulation) -> None:
        with simulation:
            simulation.step(0.3, 0.0)
            assert simulation.summary["outcome"] is None
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError):
        breaking(Simulation(room(), log=tmp_path / "a.mcap"))
    log = mjnav.open_log(tmp_path / "a.mcap")
    assert (log.complete, log.result["outcome"], log.result["ticks"]) == (True, "aborted", 1)
    faults = [m.value.message for m in log.messages("/events") if m.value.name == "fault"]
    assert [text.partition(" (")[0] for text in faults] == ["ZeroDivisionError: mine"]


# -------------------------------------------------------------------------------------- estimators


def test_without_estimators_there_are_no_beliefs_and_what_they_would_say_is_null(room, tmp_path):
    with Simulation(room(), log=tmp_path / "a.mcap", estimators=False) as simulation:
        for _ in range(3):
            assert simulation.beliefs is None
            simulation.step(0.5, 0.0)
        with pytest.raises(InvalidValue, match=r"beliefs: found nothing; allowed: observe\(beliefs\)"):
            simulation.observe()
    assert simulation.summary["localization_rmse_m"] is simulation.summary["tracking_rmse_m"] is None
    log = mjnav.open_log(tmp_path / "a.mcap")
    assert (log.result["ticks"], log.result["localization_rmse_m"]) == (3, None)
    for trajectory in (simulation.trajectory, log.trajectory()):
        assert np.isnan(trajectory.estimate).all()
        assert np.isnan(trajectory.tracks).all()
        assert trajectory.command[-1].tolist() == [0.5, 0.0]


@pytest.mark.parametrize("engine", ENGINES)
def test_beliefs_of_ones_own_from_the_readings_stand_in_for_the_estimators(room, engine):
    scenario = room(f"physics.engine={engine}", "sensors.rate=5")
    localizer, tracker = make_localizer(scenario, scenario.seed), make_tracker(scenario, scenario.seed)
    simulation, beliefs = Simulation(scenario, estimators=False), None
    while not simulation.done:
        for reading in simulation.readings:
            beliefs = Beliefs(localizer.update(reading), tracker.update(reading))
        observation = simulation.observe(beliefs)
        assert simulation.observe() is observation
        assert simulation.beliefs.robot.particles.tolist() == beliefs.robot.particles.tolist()
        simulation.step(simulation.decide())
    expected = Episode(scenario).run().summary
    for figure in ("state_hash", "localization_rmse_m", "tracking_rmse_m"):
        assert simulation.summary[figure] == expected[figure]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda b: b.robot, "beliefs: found RobotBelief"),
        (lambda b: replace(b, people=None), r"beliefs\.people: found nothing; allowed: a tuple of Track"),
        (lambda b: replace(b, robot=replace(b.robot, time=np.nan)), "time must be a finite number >= 0, not nan"),
        (lambda b: replace(b, robot=replace(b.robot, mean="far")), r"beliefs\.robot: mean is no array of numbers"),
        (lambda b: replace(b, robot=replace(b.robot, particles=1e300 * b.robot.particles)), "beyond 1e\\+12"),
        (lambda b: replace(b, people=(replace(b.people[0], weights=b.people[0].weights[1:]),)), "weights has shape"),
        (lambda b: replace(b, robot=replace(b.robot, time="now")), "time must be a finite number >= 0, not now"),
        (lambda b: replace(b, robot=replace(b.robot, time=1e9)), "time: found 1000000000.0; allowed: a number from 0"),
        (lambda b: replace(b, people=(replace(b.people[0], age=None),)), "age must be a finite number >= 0, not None"),
        (lambda b: replace(b, people=(replace(b.people[0], unseen=np.inf),)), "unseen must be a finite number"),
        (lambda b: replace(b, detections=(replace(DETECTION, position=np.zeros(3)),)), "position has shape"),
        (lambda b: replace(b, detections=(replace(DETECTION, time="now"),)), "time must be a finite number"),
    ],
)
def test_beliefs_that_are_none_are_refused_and_change_nothing(room, spoil, said):
    simulation, other = Simulation(room("time_limit=0.2")), Simulation(room("time_limit=0.2"))
    with pytest.raises(InputError, match=said):
        simulation.observe(spoil(simulation.beliefs))
    assert finished(simulation) == finished(other)


def test_a_numpy_truth_in_a_belief_is_one_and_other_values_are_refused(room, tmp_path):
    with Simulation(room("time_limit=0.2"), log=tmp_path / "a.mcap") as simulation:
        robot = simulation.beliefs.robot
        simulation.observe(replace(simulation.beliefs, robot=replace(robot, recovered=np.True_)))
        with pytest.raises(InputError, match="recovered must be True or False, not np"):
            simulation.observe(replace(simulation.beliefs, robot=replace(robot, recovered=np.int64(1))))
        finished(simulation)
    assert mjnav.open_log(tmp_path / "a.mcap").complete


# ----------------------------------------------------------------------------------- scan and map


def test_an_observation_keeps_the_scan_of_a_slow_lidar_until_the_next_one_comes(room):
    simulation = Simulation(room("sensors.lidar.model=lds-01", "sensors.lidar.mount=[0.1, 0, 0.2]"))
    scans = []
    for _ in range(6):
        scans.append(simulation.observe().scan)
        simulation.step(0.3, 0.5)
    assert [scan.time for scan in scans] == pytest.approx([0.0, 0.0, 0.2, 0.2, 0.4, 0.4])
    assert scans[0].times.size == 0
    assert scans[4].times[[0, -1]] == pytest.approx([0.2, 0.39])
    assert scans[4].times.tolist() == scans[5].times.tolist()
    assert scans[4].mount.tolist() == [0.1, 0.0, 0.2]


@pytest.mark.parametrize("engine", ENGINES)
def test_casting_no_rays_changes_nothing_but_the_scan(room, engine):
    scenario = room(f"physics.engine={engine}")
    cast, blind = Simulation(scenario), Simulation(scenario, scan=False)
    assert blind.observe().scan is None
    assert blind.readings[0].scan.size == 0
    assert cast.observe().scan.ranges.size == 360
    assert finished(cast) == finished(blind)
