"""People who enter, leave and come again: nobody is where nobody is, and newcomers wait for a free place."""

import numpy as np
import pytest

import mjnav
from mjnav.scene.people import Trip
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, SocialForce, Waypoints
from mjnav.world.simulator import Simulator

FAR = (0.0, -8.0, 0.0)
STANDING = ConstantVelocity((0.0, 0.0))
FROM, TO = ((0.0, 0.0), (3.0, 1.0)), ((0.0, 3.0), (3.0, 4.0))
AGAIN = {"loop": False, "at_end": "again", "trips": (Trip(FROM, TO),), "again_within": 0.5, "speed": 2.0}


def there(simulator: Simulator) -> list[bool]:
    state = simulator.state()
    np.testing.assert_array_equal(np.isnan(state.people_position), np.isnan(state.people_velocity))
    return (~np.isnan(state.people_position[:, 0])).tolist()


def test_people_are_there_from_enters_until_leaves(scene, engine):
    people = (Person((0.0, 0.0), ConstantVelocity((0.5, 0.0)), enters=0.5, leaves=1.0), Person((5.0, 0.0), STANDING))
    simulator = Simulator(scene(engine=engine, start=FAR, people=people), 0)
    found = []
    for _ in range(12):
        found.append(there(simulator)[0])
        assert there(simulator)[1]
        simulator.advance(0.1, (0.0, 0.0))
    assert found == [False] * 5 + [True] * 5 + [False] * 2
    readings = simulator.sense()
    assert [bool(np.isfinite(reading.detections[0, 0])) for reading in readings] == [False] * 6 + [True] * 5 + [
        False
    ] * 2  # a reading of the moment is made before somebody comes or goes


def test_the_lidar_does_not_see_the_absent_nor_does_the_robot_touch_them(scene, engine):
    people = (Person((1.5, 0.0), STANDING, enters=30.0), Person((1.2, 0.8), STANDING, leaves=0.02))
    with_absent, alone = (Simulator(scene(engine=engine, people=p), 0) for p in (people, ()))
    for simulator in (with_absent, alone):
        simulator.advance(3.0, (0.8, 0.0))
    np.testing.assert_array_equal(with_absent.sense()[-1].scan, alone.sense()[-1].scan)
    assert with_absent.state().contacts == ()
    assert with_absent.state().robot_pose[0] > 1.9
    assert there(with_absent) == [False, False]


def test_a_newcomer_waits_until_people_and_robot_have_gone(scene, engine):
    people = (
        Person((0.0, 0.0), ConstantVelocity((1.0, 0.0))),
        Person((0.1, 0.0), STANDING, enters=0.1),
        Person((0.0, -7.9), STANDING, enters=0.1),
    )
    simulator = Simulator(scene(engine=engine, start=FAR, people=people, robot={"min_speed": -1.0}), 0)
    came = np.full(3, np.inf)
    for k in range(60):
        simulator.advance(0.04, (0.5, 0.0))
        came = np.minimum(came, np.where(there(simulator), 0.04 * k, np.inf))
    # 0.6 m between centres and 0.1 m of room at 1 m/s; 0.52 m and 0.5 m at 0.5 m/s
    assert 0.7 <= came[1] < 1.0
    assert 1.9 <= came[2] < 2.4


@pytest.mark.parametrize("behaviour", [Waypoints, SocialForce])
def test_trips_begin_and_end_in_their_areas_clear_of_furniture_and_robot_and_are_drawn_by_seed(scene, behaviour):
    walk = behaviour(waypoints=((1.0, 2.0),), clear_of_robot=1.5, **AGAIN)
    person, pillar = Person((1.0, 0.0), walk), Pillar((1.5, 0.5), 0.3)
    scenario = scene(engine="kinematic", start=(0.0, 0.0, 0.0), people=(person,), pillars=(pillar,))
    paths = []
    for seed in (1, 1, 2):
        simulator, path = Simulator(scenario, seed, lidar=False), []
        for _ in range(1000):
            simulator.advance(0.02, (0.0, 0.0))
            path.append(simulator.state().people_position[0])
        readings = np.array([reading.detections[0, 0] for reading in simulator.sense()])
        paths.append(np.array(path))
        away = np.isnan(paths[-1][:, 0])
        starts = paths[-1][1:][away[:-1] & ~away[1:]]
        assert len(starts) >= 3
        assert (starts >= np.array(FROM[0]) - 1e-9).all()
        assert (starts <= np.array(FROM[1]) + 1e-9).all()
        assert np.hypot(*starts.T).min() >= 1.5
        assert np.hypot(*(starts - pillar.position).T).min() >= 0.6
        ends = paths[-1][:-1][~away[:-1] & away[1:]]
        assert ends[1:, 1].min() > 2.4  # within 0.5 m of a goal, and a step
        assert np.isnan(readings).sum() >= len(starts)  # each absence is seen
    np.testing.assert_array_equal(paths[0], paths[1])
    assert not np.array_equal(paths[0], paths[2], equal_nan=True)


TOML = """
schema = 1
name = "gate"
time_limit = 2.5
physics.engine = "kinematic"
robot = { start = [0.0, 0.0, 0.0], goal = [9.0, 0.0] }
[[people]]
start = [4.0, 1.5]
enters = 0.4
leaves = 1.5
behaviour = "constant_velocity"
velocity = [0.0, -0.5]
[[people]]
start = [6.0, 2.0]
behaviour = "waypoints"
waypoints = [[6.0, 4.0]]
at_end = "again"
again_within = 1.0
clear_of_robot = 1.0
trips = [{ from = [[5, 1], [8, 2]], to = [[5, 4], [8, 5]] }]
"""


@pytest.mark.parametrize(
    "estimator", ['estimation.obstacles.filter="particle"', 'estimation.obstacles.filter="kalman"',
                  'estimation.obstacles.source="direct"']
)  # fmt: skip
def test_tracks_follow_who_comes_and_goes_in_logs_and_replays_too(estimator, tmp_path):
    (tmp_path / "gate.toml").write_text(TOML)
    scenario = mjnav.load_scenario(tmp_path / "gate.toml", [estimator])
    result = mjnav.run(scenario, log=tmp_path / "a.mcap")
    trajectory = result.trajectory
    tracked = np.isfinite(trajectory.tracks[..., 0])
    present = np.isfinite(trajectory.people_position[:-1, :, 0])
    assert 0 < present[:, 0].sum() < len(present)
    assert 0 < present[:, 1].sum() < len(present)
    # A track begins with the first reading of somebody and ends with the first without.
    for p in range(2):
        assert tracked[1:, p].tolist() in (present[1:, p].tolist(), present[:-1, p].tolist())
    new = np.flatnonzero(~tracked[:-1, 1] & tracked[1:, 1]) + 1
    error = trajectory.tracks[new, 1, :2] - trajectory.people_position[new, 1]
    assert np.abs(error).max() < 0.6  # of its own place, not of where somebody was before
    assert mjnav.open_log(tmp_path / "a.mcap").trajectory() is not None
    events = [message.value.message for message in mjnav.open_log(tmp_path / "a.mcap").messages("/events")]
    assert [event for event in events if "person0" in event] == ["person0 enters", "person0 leaves"]
    assert mjnav.replay(tmp_path / "a.mcap").identical
