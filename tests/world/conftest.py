from collections.abc import Callable

import pytest

from mjnav.scene.spec import Noise, Person, Physics, Pillar, Robot, Scenario, Table, Wall, Waypoints

ENGINES = ("mujoco", "kinematic")


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def scene() -> Callable[..., Scenario]:
    """A scenario without noise unless told otherwise, the robot at the origin unless told otherwise."""

    def make(
        *,
        engine: str = "mujoco",
        profile: str = "none",
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        robot: dict | None = None,
        timestep: float = 0.002,
        **fields,
    ) -> Scenario:
        return Scenario(
            name="test",
            robot=Robot(start=start, goal=(5.0, 0.0), **(robot or {})),
            noise=Noise(profile=profile),
            physics=Physics(engine=engine, timestep=timestep),
            **fields,
        )

    return make


@pytest.fixture
def clutter(scene: Callable[..., Scenario]) -> Callable[..., Scenario]:
    """A room of one thing of each kind and two people who walk back and forth."""

    def make(**fields) -> Scenario:
        return scene(
            walls=(Wall((-1.0, -1.5), (4.0, -1.5)), Wall((4.0, -1.5), (4.0, 1.5)), Wall((-1.0, 1.5), (4.0, 1.5))),
            tables=(Table((1.6, 0.9), size=(1.0, 0.6)),),
            pillars=(Pillar((1.5, -0.7)),),
            people=(
                Person((3.0, 0.0), Waypoints(((0.5, 0.1), (3.0, 0.0)))),
                Person((3.2, -0.8), Waypoints(((0.2, -0.6), (3.2, -0.8)))),
            ),
            **fields,
        )

    return make
