from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Sensors, Table
from mjnav.world.scene import DECORATION, UNSEEN, compiled, compose


def test_sizes_come_from_the_scenario(scene):
    scenario = scene(
        robot={"radius": 0.3},
        tables=(Table((3.0, 0.0), size=(1.2, 0.6), leg_radius=0.05, height=0.8),),
        pillars=(Pillar((-2.0, 0.0), 0.4, 2.0),),
        people=(Person((0.0, 2.0), ConstantVelocity((0.0, 0.0)), 0.25),),
        sensors=Sensors(lidar=LidarSpec(mount=(0.1, -0.05, 0.4))),
    )
    model = compose(scenario).compile()
    assert model.geom("robot/chassis").size[0] == 0.3
    assert model.geom("table0/leg2").size[0] == 0.05
    np.testing.assert_allclose(model.geom("table0/leg2").pos[:2], (-0.6, -0.3))
    top = model.geom("table0/top")
    assert top.pos[2] + top.size[2] == pytest.approx(0.8)
    np.testing.assert_allclose(model.geom("pillar0/pillar").size[:2], (0.4, 1.0))
    assert model.geom("person0/body").size[0] == 0.25
    assert model.body("person0/body").mass[0] == pytest.approx(70.0)
    assert model.body_subtreemass[model.body("robot/base").id] == pytest.approx(14.0)
    np.testing.assert_allclose(model.site("robot/lidar").pos, (0.1, -0.05, 0.33))
    np.testing.assert_allclose(model.site("robot/lidar").quat, (np.cos(0.2), 0.0, 0.0, np.sin(0.2)))


def test_simulations_share_a_model_where_their_bodies_are_the_same(scene):
    people = (Person((0.0, 2.0), ConstantVelocity((0.0, 0.0)), 0.25),)
    ours = scene(people=people)
    walks = (replace(people[0], behaviour=ConstantVelocity((1.0, 0.0))),)
    assert compiled(replace(ours, seed=ours.seed + 1, people=walks)) is compiled(ours)
    wider = (replace(people[0], radius=0.3),)
    assert compiled(replace(ours, people=wider)).geom("person0/body").size[0] == 0.3
    elsewhere = replace(ours, robot=replace(ours.robot, start=(0.5, 0.0, 0.0)))
    assert [compiled(one).qpos0[0] for one in (ours, elsewhere)] == [0.0, 0.5]


def test_a_turned_table_has_its_legs_where_the_scenario_says(scene):
    table = Table((1.0, 2.0), yaw=0.6)
    model = compose(scene(tables=(table,))).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    legs = [data.geom(f"table0/leg{i}").xpos[:2] for i in range(4)]
    np.testing.assert_allclose(legs, table.legs, atol=1e-9)


def test_what_is_for_the_eye_only_touches_nothing_and_hides_from_the_lidar(clutter):
    model = compose(clutter()).compile()
    decoration = model.geom_group == DECORATION
    assert decoration.any()
    assert not model.geom_contype[decoration].any()
    assert not model.geom_conaffinity[decoration].any()
    robot = [i for i in range(model.ngeom) if model.geom(i).name.startswith("robot/")]
    assert set(model.geom_group[robot]) <= {UNSEEN, DECORATION}
