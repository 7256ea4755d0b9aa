import numpy as np
import pytest

from mjnav.geometry.distances import beam_angles
from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Sensors, Table, Wall
from mjnav.world.simulator import Simulator

AHEAD = 180  # the beam along the heading, of 360


def scan(scenario) -> np.ndarray:
    return Simulator(scenario, 0).sense()[0].scan


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.5])
def test_a_wall_is_where_it_is(scene, engine, heading):
    ranges = scan(scene(engine=engine, start=(0.5, 0.0, heading), walls=(Wall((3.0, -30.0), (3.0, 30.0)),)))
    along = np.cos(beam_angles(360) + heading)
    expected = np.where(along > 0.0, 2.45 / np.maximum(along, 1e-9), np.inf)
    expected[expected > 10.0] = np.inf
    np.testing.assert_allclose(ranges, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("things", "radius"),
    [
        ({"pillars": (Pillar((2.0, 0.0), 0.3),)}, 0.3),
        ({"people": (Person((2.0, 0.0), ConstantVelocity((0.0, 0.0)), 0.35),)}, 0.35),
        ({"tables": (Table((2.5, 0.5), size=(1.0, 1.0), leg_radius=0.04),)}, 0.04),
    ],
    ids=["pillar", "person", "leg"],
)
def test_a_disc_is_seen_as_a_disc(scene, engine, things, radius):
    ranges = scan(scene(engine=engine, **things))
    angles = beam_angles(360)
    inside = np.abs(2.0 * np.sin(angles)) < radius - 1e-9
    near = inside & (np.abs(angles) < 0.5 * np.pi)
    expected = 2.0 * np.cos(angles) - np.sqrt(np.maximum(radius**2 - (2.0 * np.sin(angles)) ** 2, 0.0))
    np.testing.assert_allclose(ranges[near], expected[near], atol=1e-6)
    assert ranges[AHEAD] == pytest.approx(2.0 - radius, abs=1e-9)


def test_what_is_lower_than_the_lidar_is_not_seen(scene, engine):
    low = scene(
        engine=engine,
        walls=(Wall((2.0, -2.0), (2.0, 2.0), height=0.33 - 0.01),),
        pillars=(Pillar((-2.0, 0.0), 0.3, 0.33 - 0.01),),
    )
    assert np.isinf(scan(low)).all()


@pytest.mark.parametrize("start", [(0.0, 0.2, 0.4), (0.9, 0.4, -2.8), (2.3, -0.9, 1.7)])
def test_both_engines_see_the_same_room_from_a_lidar_anywhere_on_the_body(clutter, start):
    """Walls, legs, a pillar and people, one of whom is away, from a lidar off the centre that looks aside."""
    lidar = LidarSpec(
        "utm-30lx", mount=(0.12, -0.07, 0.5), spread=0.0, bias=0.0, missing=0.0, mixed=0.0, resolution=0.0
    )
    ranges = []
    for engine in ("mujoco", "kinematic"):
        scenario = clutter(engine=engine, start=start, sensors=Sensors(lidar=lidar))
        simulator = Simulator(scenario, 0)
        simulator._engine.remove(1)
        ranges.append(simulator._engine.cast(np.array(lidar.mount), scenario.sensors.scanner.angles, 30.0))
    np.testing.assert_allclose(ranges[0], ranges[1], atol=1e-6)
    assert np.isinf(ranges[0]).any()
    assert np.isfinite(ranges[0]).sum() > 500
