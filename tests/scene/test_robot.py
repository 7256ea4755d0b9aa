"""Robots by name and by file: whose figures hold, what a log keeps, and what is said of a file that is none."""

import re
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mjnav
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits
from mjnav.scene import dumps, loads
from mjnav.scene.library import data_folder
from mjnav.scene.robot import OWN, covering, robots
from mjnav.world.scene import compose

RUN = """
schema = 1
name = "short"
time_limit = 60.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [2.0, 0.0]
"""
OTHERS = [name for name in robots() if name != OWN]


def run_of(*overrides, folder=None):
    return loads(RUN, overrides, folder=folder)


@pytest.fixture
def lab(tmp_path):
    """A folder with a robot of one's own: the Burger's."""
    for name in ("robot.toml", "robot.xml"):
        (tmp_path / name).write_text((data_folder("models") / "robots" / "burger" / name).read_text())
    return tmp_path


def test_mjnavs_own_robot_is_as_without_a_name():
    assert dumps(run_of(f'robot.model="{OWN}"')) == dumps(run_of())
    assert run_of().robot.base is None


def test_the_makers_figures_hold_where_the_run_file_says_nothing_else():
    burger = run_of("robot.model=burger", "robot.max_turn_rate=1.0")
    assert (burger.robot.radius, burger.robot.max_speed, burger.robot.preferred_speed) == (0.113, 0.22, 0.22)
    assert burger.robot.max_turn_rate == 1.0
    assert (burger.robot.drive.wheel_radius, burger.robot.drive.track_width) == (0.033, 0.16)
    assert (burger.sensors.scanner.model, burger.sensors.scanner.height) == ("lds-02", 0.182)
    ideal = run_of("robot.model=burger", 'sensors.lidar={ model="ideal" }')
    assert ideal.sensors.scanner.model == "ideal"


@pytest.mark.parametrize("name", OTHERS)
def test_every_robot_drives_by_all_that_is_on_board_and_its_log_replays(name, tmp_path):
    log = tmp_path / "drive.mcap"
    scenario = run_of(f"robot.model={name}", "control.method=rkhs-plan")
    assert mjnav.run(scenario, log=log).summary["outcome"] == "goal"
    assert mjnav.open_log(log).scenario() == scenario
    assert mjnav.replay(log).identical


@pytest.mark.parametrize("name", OTHERS)
def test_both_engines_agree_on_where_a_robot_goes(name):
    ends = []
    for engine in ("mujoco", "kinematic"):
        overrides = [f"robot.model={name}", f"physics.engine={engine}", "noise.profile=none", "time_limit=4"]
        with mjnav.Simulation(run_of(*overrides), log=False, estimators=False) as simulation:
            while not simulation.done:
                simulation.step(0.2, 0.3)
            ends.append(simulation.truth.robot_pose)
    assert ends[0] == pytest.approx(ends[1], abs=0.15 if name == "jackal" else 0.02)


def test_a_robot_of_ones_own_is_a_file_and_a_log_of_it_needs_none(lab):
    log = lab / "own.mcap"
    own = loads(RUN + 'model = "robot.toml"', ["time_limit=1"], folder=lab)
    assert own.robot.base == run_of("robot.model=burger").robot.base
    mjnav.run(own, log=log)
    for name in ("robot.toml", "robot.xml"):
        (lab / name).unlink()
    assert mjnav.replay(log).identical


def test_encoders_count_whole_ticks():
    scenario = run_of("robot.model=create3", "noise.profile=none")
    step = 2.0 * 3.141592653589793 / 508.8
    with mjnav.Simulation(scenario, log=False, estimators=False) as simulation:
        for _ in range(20):
            simulation.step(0.1, 0.0)
        speed = simulation.readings[-1].odometry[0]
    turned = speed * 0.1 / scenario.robot.drive.wheel_radius / step
    assert turned == pytest.approx(round(turned), abs=1e-6)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("burgr", "did you mean 'burger'"),
        ("none.toml", "robot.model: found 'none.toml'; allowed: a robot's file that can be read"),
    ],
)
def test_a_name_that_is_none_is_refused(model, said, tmp_path):
    with pytest.raises(InvalidValue) as told:
        loads(RUN + f'model = "{model}"', folder=tmp_path)
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("robot.toml", "wheel_radius = 0.033", "wheel_radius = 0.05", "of radius 0.05 m, as wheel_radius says, not"),
        ("robot.toml", "track_width = 0.16", "track_width = 0.3", "0.3 m apart, as track_width says, not 0.16 m"),
        ("robot.toml", "track_width = 0.16", "track_widt = 0.16", "track_widt"),
        ("robot.toml", "mjcf =", 'left_wheels = ["port"]\nmjcf =', "a wheel's hinge 'port'; its hinges are left_wheel"),
        ("robot.xml", "<freejoint", "<!-- <freejoint", "MJCF that MuJoCo compiles"),
        ("robot.xml", '<freejoint name="free"/>', "", "one body with a free joint, not 0"),
        ("robot.xml", 'name="chassis" type="cylinder" size="0.113', 'type="cylinder" size="0.3', "reaches 0.113 m, as"),
        ("robot.xml", '<velocity name="left_wheel" class="wheel" joint="left_wheel"/>', "", "one velocity actuator"),
        (
            "robot.xml",
            '<velocity name="left_wheel" class="wheel"',
            '<position name="left_wheel"',
            "one velocity actuator",
        ),
        ("robot.xml", 'axis="0 1 0"', 'axis="0 -1 0"', "a wheel's hinge 'left_wheel' along 0 1 0"),
    ],
)
def test_what_cannot_be_driven_is_said_before_anything_starts(lab, file, old, new, said):
    text = (lab / file).read_text()
    assert old in text
    (lab / file).write_text(text.replace(old, new, 1))
    with pytest.raises(InvalidValue) as told:
        mjnav.run(loads(RUN + 'model = "robot.toml"', folder=lab), log=False)
    assert "robot.model" in str(told.value)
    assert said in str(told.value)


def test_the_scenes_options_hold_and_not_those_of_the_robots_file(lab, recwarn):
    text = (lab / "robot.xml").read_text()
    options = '<option timestep="0.01" gravity="0 0 0" integrator="RK4"><flag contact="disable"/></option><default>'
    (lab / "robot.xml").write_text(text.replace("<default>", options, 1))
    model = compose(loads(RUN + 'model = "robot.toml"', folder=lab)).compile()
    shipped = compose(run_of("robot.model=burger")).compile()
    assert str(model.opt) == str(shipped.opt)
    assert not recwarn.list


def test_what_touches_the_floor_alone_and_what_stands_in_the_world_is_no_part_of_the_body(lab):
    text = (lab / "robot.xml").read_text()
    caster, body = '<geom name="caster_back" class="caster" size="0.012" pos="-0.08', "<worldbody>"
    assert caster in text
    text = text.replace(caster, caster.replace("-0.08", "-0.2"), 1)
    (lab / "robot.xml").write_text(text.replace(body, f'{body}\n<geom type="plane" size="5 5 0.1"/>', 1))
    compose(loads(RUN + 'model = "robot.toml"', folder=lab)).compile()


@pytest.mark.parametrize("radius", [0.12, 0.3])
def test_a_robot_of_a_model_stops_at_the_wall_by_the_radius_that_is_set(radius):
    wall = "[[walls]]\nfrom = [1.0, -2.0]\nto = [1.0, 2.0]\n"
    keys = ["robot.model=burger", f"robot.radius={radius}", "noise.profile=none"]
    with mjnav.Simulation(loads(RUN + wall, keys), log=False) as simulation:
        while not simulation.done and simulation.time < 10.0:
            simulation.step(0.2, 0.0)
    assert simulation.outcome == "collision"
    assert simulation.summary["min_clearance_m"] == pytest.approx(0.0, abs=0.03)


@given(st.floats(0.1, 1.0), st.floats(0.1, 1.0), st.integers(1, 20), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_every_point_of_a_box_is_in_a_disc_that_covers_it_and_none_could_be_smaller(length, width, num, u, w):
    discs = covering(length, width, num)
    assert len(discs) == num
    gaps = [hypot(u * length - ahead, w * width) - radius for ahead, radius in discs]
    assert min(gaps) <= 1e-12
    corner = min(hypot(0.5 * length - ahead, 0.5 * width) - radius for ahead, radius in discs)
    assert corner == pytest.approx(0.0, abs=1e-12)


GAP = """
[[walls]]
from = [2.0, 0.24]
to = [2.0, 2.0]
[[walls]]
from = [2.0, -2.0]
to = [2.0, -0.24]
"""


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_a_robot_of_discs_fits_through_a_gap_for_its_width_and_the_round_one_does_not(engine):
    """0.48 m between the walls' sides; a Jackal is 0.31 m wide and a circle of 0.52 m."""
    touched = []
    for discs in (3, 1):
        keys = ["robot.model=jackal", f"robot.discs={discs}", f"physics.engine={engine}", "noise.profile=none"]
        with mjnav.Simulation(loads(RUN + GAP, [*keys, "robot.goal=[4.0, 0.0]"]), log=False) as simulation:
            for _ in range(60):
                if not simulation.done:
                    simulation.step(0.5, 0.0)
            touched.append({contact.name for contact in simulation.trajectory.contacts})
    assert touched == [set(), {"wall0", "wall1"}]


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_a_robot_of_discs_may_not_turn_into_what_is_beside_it(engine):
    beside = "[[walls]]\nfrom = [-1.0, 0.27]\nto = [1.0, 0.27]\n"
    keys = ["robot.model=jackal", "robot.discs=3", f"physics.engine={engine}", "noise.profile=none"]
    with mjnav.Simulation(loads(RUN + beside, keys), log=False) as simulation:
        for _ in range(30):
            if not simulation.done:
                simulation.step(0.0, 0.5)
        heading = simulation.truth.robot_pose[2]
        assert [contact.name for contact in simulation.trajectory.contacts][:1] == ["wall0"]
    touching = 0.40  # [rad] at which 0.14 sin(a) + 0.17 = 0.22 m, the wall's side
    assert heading < touching + (0.3 if engine == "mujoco" else 0.05)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["robot.discs=3"], "robot.discs: found 3; allowed: nothing without a footprint"),
        (
            ["robot.footprint=[0.3, 0.2]"],
            "robot.footprint: found (0.3, 0.2); allowed: nothing: mjnav's own robot is round",
        ),
        (["robot.model=jackal", "robot.footprint=[0.6, 0.3]"], "at most 0.522 m from corner to corner"),
    ],
)
def test_a_footprint_that_cannot_be_is_refused(given, said):
    with pytest.raises(InvalidValue) as told:
        run_of(*given)
    assert said in str(told.value)


@pytest.mark.parametrize("mass", ["", 'mass="16.5"'])
def test_discs_weigh_what_the_one_body_does(mass, tmp_path):
    """Where the MJCF has no inertial, so that bodies weigh what their geoms do."""
    for name in ("robot.toml", "robot.xml"):
        text = (data_folder("models") / "robots" / "jackal" / name).read_text()
        text = re.sub(r"<inertial.*/>", "", text).replace('name="chassis"', f'name="chassis" {mass}')
        (tmp_path / name).write_text(text)
    weights = [
        compose(loads(RUN + f'model = "robot.toml"\ndiscs = {n}', folder=tmp_path)).compile().body_subtreemass[0]
        for n in (1, 3)
    ]
    assert weights[1] == pytest.approx(weights[0], rel=1e-12)


@pytest.mark.parametrize("cover", [((0.1, 0.0),), ((0.1,),), ((np.nan, 0.2),)])
def test_discs_by_hand_have_finite_places_and_radii(cover):
    with pytest.raises(InvalidValue, match="cover"):
        RobotLimits(cover=cover)


def test_mjnavs_own_robot_has_its_wheels_inside():
    with pytest.raises(InvalidValue, match=r"robot\.radius: .* at least 0\.2 m"):
        run_of("robot.radius=0.15")


def test_the_text_of_a_log_opens_no_file():
    with pytest.raises(InvalidValue, match="only a run file may name another file"):
        loads(RUN + 'model = "robot.toml"')
