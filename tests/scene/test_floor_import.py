"""Worlds of Gazebo: what of an SDF file stands in a run file, and where."""

from math import cos, pi, sin

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.geometry.floor import Floor
from mjnav.scene.bodies import Box, Wall, wall_box
from mjnav.scene.floor_import import THICK, box_walls, read_world
from mjnav.scene.load import load

WAY = {"robot.start": [0.0, 0.0, 0.0], "robot.goal": [4.0, 0.0]}


def collision(geometry: str, pose: str = "") -> str:
    return f"<collision name='c'>{pose}<geometry>{geometry}</geometry></collision>"


def cylinder(radius: float = 0.1, length: float = 1.0) -> str:
    return f"<cylinder><radius>{radius}</radius><length>{length}</length></cylinder>"


def box(x: float, y: float, z: float = 1.0) -> str:
    return f"<box><size>{x} {y} {z}</size></box>"


def model(inside: str, name: str = "m", static: str = "<static>true</static>") -> str:
    return f"<model name='{name}'>{static}{inside}</model>"


def link(inside: str, pose: str = "") -> str:
    return f"<link name='l'>{pose}{inside}</link>"


def pose(text: str, attributes: str = "") -> str:
    return f"<pose {attributes}>{text}</pose>"


def world(*models: str, around: str = "") -> bytes:
    return f"<sdf version='1.6'><world name='w'>{''.join(models)}{around}</world></sdf>".encode()


def test_poses_of_models_links_and_collisions_add_up():
    inner = link(collision(cylinder(), pose("1 0 0 0 0 0")), pose(f"0 2 0 0 0 {pi / 2}"))
    outer = pose(f"10 0 0.5 0 0 {pi / 2}", "frame=''") + model(pose("3 0 0 0 0 0") + inner, "inner", "")
    (pillar,) = read_world(world(model(outer))).pillars
    # In the inner model (0, 2) + (0, 1); in the outer (3, 3); turned by a right angle (-3, 3); in the world (7, 3).
    assert pillar == {"position": [7.0, 3.0], "radius": 0.1, "height": 1.0}


def test_degrees_are_read_and_a_saved_state_moves_its_models():
    turned = link(collision(box(2.0, 0.1)), pose("0 0 0.5 0 0 90", "degrees='true'"))
    state = f"<state><model name='m'>{pose('5 1 0 0 0 0')}</model></state>"
    (wall,) = read_world(world(model(pose("1 1 0 0 0 0") + turned), around=state)).walls
    np.testing.assert_allclose([wall["from"], wall["to"]], [[5.0, 0.0], [5.0, 2.0]], atol=1e-9)
    assert (wall["thickness"], wall["height"]) == (0.1, 1.0)


LEFT_OUT = {
    "a mesh": (model(link(collision("<mesh><uri>a.dae</uri></mesh>"))), "m: a mesh, neither a cylinder nor a box"),
    "a sphere": (model(link(collision("<sphere><radius>1</radius></sphere>"))), "m: a sphere, neither"),
    "no geometry": (model(link("<collision name='c'/>")), "m: a collision without geometry"),
    "a model that moves": (model(link(collision(cylinder())), static=""), "m: it is not static"),
    "an include": ("<include><uri>model://sun</uri></include>", "model://sun: another file"),
    "a tilted one": (model(pose("0 0 0 0.5 0 0") + link(collision(cylinder()))), "m: a pose that is not upright"),
    "one on its head": (model(pose("0 0 0 3.14159265 0 0") + link(collision(cylinder()))), "m: a pose that is not"),
    "a named frame": (model(link(collision(cylinder(), pose("0 0 0 0 0 0", "relative_to='a'")))), "in the frame 'a'"),
    "a short pose": (model(pose("1 2") + link(collision(cylinder()))), "m: <pose>1 2</pose> in place of 6 finite"),
    "a pose of nan": (model(pose("nan 0 0 0 0 0") + link(collision(cylinder()))), "in place of 6 finite numbers"),
    "a negative radius": (model(link(collision(cylinder(-1.0)))), "m: a cylinder whose radius is not at least 0.001"),
    "a box of two sides": (model(link(collision("<box><size>1 1</size></box>"))), "<size>1 1</size> in place of 3"),
    "a lamp": (model(pose("0 0 3 0 0 0") + link(collision(box(1, 1)))), "m: a box 2.5 m above the floor"),
}


@pytest.mark.parametrize("case", LEFT_OUT)
def test_what_cannot_stand_in_a_run_file_is_left_out_and_named(case):
    text, reason = LEFT_OUT[case]
    found = read_world(world(text, model(link(collision(cylinder())), "sound")))
    assert (len(found.pillars), len(found.walls), len(found.left_out)) == (1, 0, 1)
    assert reason in found.left_out[0]


def test_the_floor_and_what_lies_within_it_are_neither_there_nor_missed():
    plane = "<plane><normal>0 0 1</normal><size>9 9</size></plane>"
    found = read_world(world(model(link(collision(plane) + collision(box(9, 9, 1), pose("0 0 -0.5 0 0 0"))))))
    assert (found.pillars, found.walls, found.left_out) == ([], [], [])


BOMB = b"<!DOCTYPE a [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;&a;&a;'>]>" + world(model("&b;"))
REFUSED = {
    "a DOCTYPE": (BOMB, "found 'a DOCTYPE'; allowed: SDF, which has none"),
    "a DOCTYPE in UTF-16": (BOMB.decode().encode("utf-16"), "a DOCTYPE"),
    "no XML": (b"solid", "XML (syntax error: line 1, column 0)"),
    "an unknown encoding": (b"<?xml version='1.0' encoding='made-up'?><sdf/>", "XML"),
    "no world": (b"<sdf version='1.6'><model name='m'/></sdf>", "found '<sdf>'; allowed: SDF: <sdf> with a <world>"),
    "another kind of XML": (b"<mujoco><worldbody/></mujoco>", "found '<mujoco>'"),
    "models too deep": (world(model("<model>" * 30 + "</model>" * 30)), "at most 20 models in one another"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_world_is_refused(case):
    data, said = REFUSED[case]
    with pytest.raises(InvalidValue) as refused:
        read_world(data)
    assert said in str(refused.value)


@pytest.mark.parametrize("size", [(2.0, 0.1), (0.1, 2.0), (THICK, 5.0), (1.0, 1.0), (0.3, 2.0), (0.21, 0.21)])
def test_the_walls_of_a_box_have_its_outline_and_stay_within_it(size):
    centre, yaw = (1.0, -2.0), 0.7
    block = Box("", centre, (cos(yaw), sin(yaw)), (0.5 * size[0], 0.5 * size[1]), 1.0)
    walls = [Wall(w["from"], w["to"], w["thickness"]) for w in box_walls(centre, block.along, size)]
    rows = [(*b.centre, *b.along, *b.half) for b in (wall_box("", wall) for wall in walls)]
    floor = Floor(np.zeros((0, 3)), np.array(rows))
    rng = np.random.default_rng(1)
    points = rng.uniform(-4.0, 4.0, (2000, 2)) + centre
    outside = np.array([block.distance((x, y)) for x, y in points])
    apart = outside > 1e-6
    np.testing.assert_allclose(floor.clearance(points)[apart], outside[apart], atol=1e-6)
    # From anywhere on the sides inwards there is a wall.
    angles = rng.uniform(-pi, pi, 500)
    aside = block.half / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))[:, None]
    edge = np.clip(aside * np.stack([np.cos(angles), np.sin(angles)], axis=1), -np.array(block.half), block.half)
    c, s = block.along
    assert (floor.clearance(centre + edge @ np.array([[c, s], [-s, c]])) < 1e-6).all()


def test_a_world_is_a_scene_once_the_robot_has_a_way(tmp_path):
    path = tmp_path / "field.world"
    path.write_bytes(
        world(
            model(pose("2 1 0.5 0 0 0") + link(collision(cylinder()))),
            model(pose("2 -2 0.5 0 0 0") + link(collision(box(1, 1)))),
        )
    )
    scenario = load(path, WAY)
    assert (scenario.name, len(scenario.pillars), len(scenario.walls)) == ("field", 1, 4)
    with pytest.raises(InvalidValue, match="a map or a world has no robot"):
        load(path)
    with pytest.raises(InvalidValue, match=r"robot\.goal"):
        load(path, WAY | {"robot.goal": [2.0, 1.0]})
    with pytest.raises(InvalidValue, match="a world that can be read"):
        load(tmp_path / "none.world", WAY)
