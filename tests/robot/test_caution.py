"""A robot that does not know enough drives more slowly or stops, and drives on when it knows again."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import mjnav
from mjnav.loop.episode import Episode
from mjnav.messages import Beliefs, Decision, RobotBelief, Status
from mjnav.robot.caution import CONFLICTS, FIRST_REST, MAX_HEADING_STD, MAX_POSITION_STD, PATIENCE, Caution
from mjnav.robot.estimation.base import robot_belief
from mjnav.robot.sanity import Sanity
from mjnav.scene.load import load
from mjnav.scene.spec import Scenario
from mjnav.world.simulator import Simulator

QUICK = {"physics.engine": "kinematic", "control.method": "mean"}
DIRECT = {"estimation.robot.source": "direct", "estimation.obstacles.source": "direct"}
BY_LIDAR = {
    "estimation.robot.source": "lidar",
    "estimation.robot.filter": "ekf",
    "estimation.obstacles.source": "lidar",
}
STILL = {**QUICK, **BY_LIDAR, "noise.profile": "none", "people": []}
DRIVE = Decision(0.8, 0.1, Status.OK)


@pytest.mark.parametrize("sources", [{}, DIRECT])
def test_without_faults_the_decision_of_a_robot_that_does_not_go_by_its_lidar_stands(sources):
    with mjnav.Simulation(load("crossing1", {**QUICK, **sources, "time_limit": 2})) as simulation:
        while not simulation.done:
            assert not simulation.decide().caution
            simulation.step(simulation.decide())
    assert simulation.summary["cautious_ticks"] == 0


@pytest.mark.parametrize(
    ("channel", "sources"), [("pose", {}), ("pose", DIRECT), ("detections", {}), ("detections", DIRECT)]
)
def test_a_robot_without_what_it_goes_by_brakes_in_time_says_why_and_drives_on(channel, sources):
    faults = {f"faults.{channel}.dropout": {"from": 1.0, "to": 3.0}}
    scenario = load(
        "crossing1", {**QUICK, **sources, **faults, "time_limit": 4, "noise.actuation.v.distribution": "zero"}
    )
    records = []
    result = Episode(scenario, watch=records.append).run()
    t = result.trajectory
    stopped = np.array([record.decision.caution != "" for record in records])
    times = t.time[:-1]
    # The latest usable part is that of 0.9 s; at 3.0 s the next one comes.
    assert (stopped == ((times > 0.9 + PATIENCE + 1e-6) & (times < 3.0 - 1e-6))).all()
    assert all(record.decision.status == Status.STOPPED for record in records if record.decision.caution)
    assert (t.command[stopped][1:] == 0.0).all()
    speed = t.robot_twist[:, 0]
    assert np.diff(speed).min() >= -scenario.robot.max_acceleration * scenario.control.period - 1e-9
    assert abs(speed[int(np.flatnonzero(stopped)[-1])]) < 1e-9
    assert speed[-1] > 0.2
    told = [event.text for record in records for event in record.events if event.name in ("caution", "sensor")]
    assert len([text for text in told if "the robot stops" in text and channel in text]) == 1
    assert result.summary["cautious_ticks"] == stopped.sum()


def told(scenario: Scenario, pose: np.ndarray, **fields) -> tuple[Caution, RobotBelief]:
    """Caution after the first reading of a scene, with the robot believed to be at a pose."""
    sanity = Sanity(scenario)
    caution = Caution(scenario, sanity)
    reading = sanity.checked(replace(Simulator(scenario, 1).sense()[0], **fields))
    belief = robot_belief(0.0, pose[None])
    caution.follow(reading, Beliefs(belief, ()))
    return caution, belief


def test_the_robot_drives_no_faster_than_lets_it_stop_before_what_the_map_misses():
    pillar = {"pillars": [{"position": [1.0, 0.0], "radius": 0.2}], "estimation.map.missing": ["pillar0"]}
    scenario = load("crossing1", {**STILL, **pillar})
    caution, belief = told(scenario, np.zeros(3))
    found = caution.limited(replace(DRIVE, v=1.0, omega=0.0), belief, 0.1)
    way, delay, a = 1.0 - 0.2 - 0.22, 0.2, 1.0

    def needed(v: float) -> float:
        return v * v / (2.0 * a) + v * delay

    assert needed(found.v) <= way < needed(found.v + 1.0 / 8.0)
    assert found.wish == (1.0, 0.0)
    assert not found.clipped
    assert found.status == Status.OK


def test_until_a_slower_decision_takes_effect_the_robot_drives_on_as_fast_as_before():
    pillar = {"pillars": [{"position": [1.0, 0.0], "radius": 0.2}], "estimation.map.missing": ["pillar0"]}
    scenario = load("crossing1", {**STILL, **pillar})
    slow, late = replace(DRIVE, v=0.2, omega=0.0), 0.6  # 0.7 s until the next: 0.14 m at 0.2 m/s, 0.61 at 0.875 m/s
    caution, belief = told(scenario, np.zeros(3))
    assert caution.limited(slow, belief, late).v == 0.2
    assert caution.limited(slow, belief, late, 0.875).v == 0.0
    assert caution.limited(slow, belief, late, -0.875).v == 0.0


@pytest.mark.parametrize(("place", "stays"), [((0.0, 0.0, 0.0), False), ((2.0, 1.0, 1.0), True)])
def test_a_robot_that_does_not_see_what_its_map_has_around_it_stays(place, stays):
    """It was carried away: where it believes to be the walls would be elsewhere."""
    corners = [[-3.0, -2.0], [4.0, -2.0], [4.0, 3.0], [-3.0, 3.0], [-3.0, -2.0]]
    walls = [{"from": a, "to": b} for a, b in pairwise(corners)]
    caution, belief = told(load("crossing1", {**STILL, "robot.goal": [3.0, 0.0], "walls": walls}), np.array(place))
    found = caution.limited(replace(DRIVE, v=0.1), belief, 0.1)
    assert (found.v == 0.0) == stays
    assert ("map" in found.caution) == stays


@pytest.mark.parametrize(
    ("spread", "stays"),
    [
        ((0.9 * MAX_POSITION_STD, 0.0, 0.0), False),
        ((1.1 * MAX_POSITION_STD, 0.0, 0.0), True),
        ((0.9 * MAX_POSITION_STD, 0.9 * MAX_POSITION_STD, 0.0), True),  # aslant it is wider than along x and y
        ((0.0, 0.0, 1.1 * MAX_HEADING_STD), True),
    ],
)
def test_a_robot_that_does_not_know_where_it_is_stays(spread, stays):
    scenario = load("crossing1", STILL)
    caution, _ = told(scenario, np.zeros(3))
    belief = robot_belief(0.0, np.array([spread, [-s for s in spread]]))
    assert (caution.limited(DRIVE, belief, 0.1).v == 0.0) == stays


def test_where_wheels_and_gyro_contradict_each_other_the_robot_rests_for_twice_as_long_each_time():
    scenario = load("crossing1", STILL)
    sanity = Sanity(scenario)
    caution = Caution(scenario, sanity)
    first = Simulator(scenario, 1).sense()[0]
    rests, before = [], False
    for k in range(100):
        time = 0.1 * k
        slips = not before  # while it drives one wheel slips
        odometry = np.array([0.5, 1.0 if slips else 0.0])
        reading = replace(first, time=time, interval=0.1 if k else 0.0, odometry=odometry, gyro=0.0)
        belief = robot_belief(time, np.zeros((1, 3)))
        caution.follow(sanity.checked(reading), Beliefs(belief, ()))
        rests.append(caution.limited(DRIVE, belief, time + 0.1).v == 0.0)
        before = rests[-1]
    changes = np.flatnonzero(np.diff(rests)) + 1
    assert changes[0] == CONFLICTS - 1
    lengths = 0.1 * np.diff(changes)[::2]
    np.testing.assert_allclose(lengths[:3], FIRST_REST * np.array([1.0, 2.0, 4.0]))


@pytest.mark.parametrize(
    ("fault", "sources"),
    [("pose.nan", {}), ("detections.stuck", {}), ("pose.dropout", DIRECT), ("lidar.nan", BY_LIDAR)],
)
def test_who_walks_into_a_robot_that_knows_nothing_finds_it_standing(fault, sources):
    person = {"start": [7.0, 0.0], "behaviour": "constant_velocity", "velocity": [-1.0, 0.0]}
    keys = {"people": [person], "time_limit": 6, f"faults.{fault}.from": 1.0}
    simulation = mjnav.Simulation(load("crossing1", {**QUICK, **sources, **keys}))
    while not simulation.done:
        simulation.step(simulation.decide())
    figures = simulation.summary
    assert figures["outcome"] == "collision"
    assert (figures["collisions_moving"], figures["collisions_at_rest"]) == (0, 1)
