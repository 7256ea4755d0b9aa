import numpy as np
import pytest

from mjnav.scene.spec import ConstantVelocity, Person, Sensors
from mjnav.world.simulator import Simulator


@pytest.mark.parametrize("control_rate", [1.0, 5.0, 10.0, 20.0, 50.0, 100.0])
@pytest.mark.parametrize("sensor_rate", [10.0, 25.0])
def test_readings_come_at_the_sensors_rate_whatever_the_control_rate(scene, control_rate, sensor_rate):
    scenario = scene(engine="kinematic", sensors=Sensors(rate=sensor_rate, lidar_beams=4))
    simulator = Simulator(scenario, 0)
    readings = list(simulator.sense())
    assert [reading.time for reading in readings] == [0.0]
    for _ in range(round(2.0 * control_rate)):
        simulator.advance(1.0 / control_rate, (0.5, 0.0))
        new = simulator.sense()
        assert all(reading.time <= simulator.time for reading in new)
        readings += new
    times = [reading.time for reading in readings]
    np.testing.assert_allclose(times, np.arange(len(times)) / sensor_rate, atol=1e-9)
    assert len(times) == 2 * sensor_rate + 1
    np.testing.assert_allclose([reading.interval for reading in readings[1:]], 1.0 / sensor_rate)
    assert readings[0].interval == 0.0
    assert simulator.sense() == ()


def test_encoders_without_noise_match_the_motion(scene, engine):
    simulator = Simulator(scene(engine=engine), 0)
    simulator.sense()
    for _ in range(20):
        simulator.advance(0.1, (0.7, 0.5))
    heading = simulator.state().robot_pose[2]
    readings = simulator.sense()
    odometry = np.array([reading.odometry for reading in readings])
    gyro = np.array([reading.gyro for reading in readings])
    assert gyro.sum() * 0.1 == pytest.approx(heading, abs=1e-9)
    assert odometry[:, 1].sum() * 0.1 == pytest.approx(heading, abs=0.005)
    np.testing.assert_allclose(odometry[-1], [0.7, 0.5], atol=0.005)


def test_without_noise_pose_and_detections_are_the_truth(scene, engine):
    people = (Person((2.0, 1.0), ConstantVelocity((0.5, 0.0))), Person((2.0, -1.0), ConstantVelocity((-0.2, 0.1))))
    simulator = Simulator(scene(engine=engine, people=people), 0)
    for _ in range(7):
        simulator.advance(0.1, (0.3, -0.4))
    reading, state = simulator.sense()[-1], simulator.state()
    assert reading.time == state.time
    np.testing.assert_allclose(reading.pose, state.robot_pose, atol=1e-12)
    np.testing.assert_array_equal(reading.detections, state.people_position)
