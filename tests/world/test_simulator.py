import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.world.engine import DivergedError
from mjnav.world.simulator import Simulator

COMMANDS = [(0.5, 0.3), (0.9, -1.0), (0.2, 1.5), (0.6, 0.0), (0.0, 0.0)]


def run(scenario, slices: int, *, seed: int = 4, look: bool = True) -> tuple[str, list]:
    simulator = Simulator(scenario, seed)
    readings = []
    for command in COMMANDS * 3:
        for _ in range(slices):
            simulator.advance(0.1 / slices, command)
            if look:
                simulator.state()
                readings += simulator.sense()
    return simulator.state_hash(), readings or list(simulator.sense())


@pytest.mark.parametrize("slices", [2, 5, 10, 25])
def test_the_same_commands_end_in_the_same_bits_however_time_is_sliced(clutter, engine, slices):
    scenario = clutter(engine=engine, profile="pearson")
    (whole, readings), (sliced, sliced_readings) = run(scenario, 1), run(scenario, slices)
    assert whole == sliced
    for one, other in zip(readings, sliced_readings, strict=True):
        assert one.time == other.time
        np.testing.assert_array_equal(one.scan, other.scan)
        np.testing.assert_array_equal(one.odometry, other.odometry)
        np.testing.assert_array_equal(one.pose, other.pose)
        assert one.gyro == other.gyro


def test_two_runs_of_a_seed_are_the_same_and_looking_changes_nothing(clutter, engine):
    scenario = clutter(engine=engine, profile="pearson")
    first = run(scenario, 1)[0]
    assert first == run(scenario, 1)[0] == run(scenario, 1, look=False)[0]
    assert first != run(scenario, 1, seed=5)[0]


def test_actuation_noise_holds_for_a_tenth_of_a_second_whatever_the_slicing(scene):
    scenario = scene(engine="kinematic", profile="gaussian")
    speeds = []
    for every in (0.004, 0.02, 0.1):
        simulator, trace = Simulator(scenario, 2), {}
        for _ in range(round(1.0 / every)):
            simulator.advance(every, (0.0, 0.0))
            state = simulator.state()
            trace[round(state.time, 6)] = tuple(state.robot_twist)
        speeds.append(trace)
    windows = [speeds[0][round(0.1 * k + 0.1, 6)] for k in range(10)]
    assert len(set(windows)) == 10
    for trace in speeds:
        for time, twist in trace.items():
            assert twist == windows[int(np.ceil(time / 0.1 - 1e-6)) - 1]


def test_a_command_may_change_within_a_call(scene, engine):
    together, apart = Simulator(scene(engine=engine), 0), Simulator(scene(engine=engine), 0)
    together.advance(0.1, (1.0, 0.0), switches=[(0.03, (0.0, 1.0)), (0.08, (0.5, 0.5))])
    apart.advance(0.03, (1.0, 0.0))
    apart.advance(0.05, (0.0, 1.0))
    apart.advance(0.02, (0.5, 0.5))
    assert together.time == pytest.approx(0.1)
    assert together.state_hash() == apart.state_hash()


def test_times_and_commands_that_cannot_be_are_refused(scene):
    simulator = Simulator(scene(engine="kinematic"), 0)
    with pytest.raises(InvalidValue, match=r"duration: found 0\.003; allowed: a whole number of steps of 0\.002 s"):
        simulator.advance(0.003, (0.0, 0.0))
    with pytest.raises(InvalidValue, match="finite v"):
        simulator.advance(0.1, (np.nan, 0.0))


@pytest.mark.parametrize("speed", [1e11, float("nan")])
def test_a_state_that_diverges_is_told_once_and_not_put_back(clutter, speed, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    simulator = Simulator(clutter(), 0)
    simulator.advance(0.5, (0.8, 0.0))
    simulator._engine.data.qvel[0] = speed
    with pytest.raises(DivergedError, match=r"^MuJoCo lost the physics before 0\.\d+ s: Nan, Inf or huge value in Q"):
        simulator.advance(0.1, (0.8, 0.0))
    assert not abs(simulator._engine.data.qpos).max() < 1e3
    with pytest.raises(DivergedError):
        simulator.advance(0.1, (0.8, 0.0))
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []  # MuJoCo's own MUJOCO_LOG.TXT
