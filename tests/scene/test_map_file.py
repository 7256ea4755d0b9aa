"""Maps of ROS map_server: what their cells are in every mode, and the walls that take their place."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.robot.seen_space import FloorMap
from mjnav.robot.wayfinder import Wayfinder
from mjnav.scene import map_file
from mjnav.scene.load import dumps, load, loads
from mjnav.scene.map_file import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    MapInfo,
    OccupancyGrid,
    edge,
    map_of,
    map_walls,
    read_map,
    rectangles,
    written_map,
)
from mjnav.scene.route import Route
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_robot
from mjnav.settings import read
from mjnav.world.simulator import Simulator


def saved(folder, grey, more: str = "", name: str = "a.pgm"):
    """A map of pixels (rows, columns), the upper row first as pictures have it."""
    Image.fromarray(np.array(grey, np.uint8)).save(folder / name)
    path = folder / "a.yaml"
    path.write_text(f"image: {name}\nresolution: 0.5\norigin: [0.0, 0.0, 0.0]\n{more}")
    return path


def cells(path) -> list[list[int]]:
    """Of a map, the upper row first."""
    return read_map(path).cells[::-1].tolist()


F, X, U = FREE, OCCUPIED, UNKNOWN
# p of 0, 60, 89, 90, 200, 205, 206 and 255 is 1, .765, .651, .647, .216, .19608, .192 and 0.
ROW = [0, 60, 89, 90, 200, 205, 206, 255]
MODES = {
    "mode: trinary": [X, X, X, U, U, U, F, F],
    "mode: trinary\nfree_thresh: 0.25": [X, X, X, U, F, F, F, F],
    "mode: trinary\noccupied_thresh: 0.2": [X, X, X, X, X, U, F, F],
    "mode: trinary\nnegate: 1": [F, U, U, U, X, X, X, X],
    "mode: scale": [X, X, X, F, F, F, F, F],
    "mode: scale\nnegate: true": [F, F, F, F, X, X, X, X],
    "mode: raw": [F, F, X, X, U, U, U, U],
    "mode: raw\nnegate: 1": [U, U, U, U, F, F, F, F],
    "": [X, X, X, U, U, U, F, F],
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", ["a.pgm", "a.png", "a.bmp"])
def test_every_mode_reads_colours_as_map_server_does(tmp_path, mode, name):
    assert cells(saved(tmp_path, [ROW], mode, name)) == [MODES[mode]]


def test_a_picture_in_text_and_one_in_colour_are_read_too(tmp_path):
    path = saved(tmp_path, [ROW])
    (tmp_path / "a.pgm").write_text("P2\n# a comment\n3 2\n255\n0 255 205\n255 255 0\n")
    assert cells(path) == [[X, F, U], [F, F, X]]
    colour = np.zeros((1, 3, 4), np.uint8)
    colour[0] = [[0, 0, 0, 255], [200, 255, 250, 255], [0, 0, 0, 0]]  # the last is transparent
    assert cells(saved(tmp_path, colour, name="a.png")) == [[X, F, U]]


YAML = """
# made by hand
image: 'a.pgm'   # beside it
resolution: 5e-1
origin:
- -1.0
- 2
- 0.5
negate: false
"""


def test_a_yaml_file_may_have_comments_quotes_and_an_array_of_lines(tmp_path):
    saved(tmp_path, [ROW])
    (tmp_path / "a.yaml").write_text(YAML)
    assert read_map(tmp_path / "a.yaml").info == MapInfo("a.pgm", 0.5, (-1.0, 2.0, 0.5))


def without(key: str) -> str:
    return "\n".join(line for line in GOOD.splitlines() if not line.startswith(key))


GOOD = "image: a.pgm\nresolution: 0.5\norigin: [0, 0, 0]\n"
BAD = {
    GOOD + "resolution: 0.1": "line 4: found 'resolution: 0.1'; allowed: one `key: value` a line, each key once",
    GOOD + "- 3": "origin: found [0, 0, 0, 3]; allowed: an array of 3 numbers",
    GOOD + "mode": "line 4: found 'mode'",
    GOOD + "ocupied_thresh: 0.5": "did you mean 'occupied_thresh'?",
    GOOD + "occupied_thresh: 65": "occupied_thresh: found 65.0; allowed:",
    GOOD + "free_thresh: 0.7": "free_thresh: found 0.7; allowed: at most occupied_thresh, 0.65",
    GOOD + "mode: tri": "mode: found 'tri'",
    GOOD + "negate: 2": "negate: found 2",
    without("image"): "image: found nothing",
    without("origin") + "\norigin: [0, 0]": "origin: found",
    without("origin") + "\norigin: [0, 0, nan]": "origin.2: found nan",
    without("origin") + "\norigin:": "origin: found",
    without("resolution") + "\nresolution: 0": "resolution: found 0",
    without("image") + "\nimage: b.pgm": "a picture that can be read (No such file or directory)",
    without("image") + "\nimage: a.yaml": "image: found 'a.yaml'; allowed: a PGM, PNG or BMP picture that can be read",
    without("image") + "\nimage: wide.png": "image: found '4097 x 1 pixels'; allowed: at most 4096 x 4096",
    without("image") + "\nimage: deep.png": "allowed: a picture with 8 bits a colour",
    without("image") + "\nimage: cut.png": "image: found 'cut.png'; allowed: a PGM",
    without("image") + "\nimage: whole.jpg": "a PGM, PNG or BMP picture that can be read (cannot identify image file)",
}


@pytest.mark.parametrize("text", BAD)
def test_a_mistake_in_a_map_is_said_with_file_and_key(tmp_path, text):
    path = saved(tmp_path, [ROW])
    Image.fromarray(np.zeros((1, 4097), np.uint8)).save(tmp_path / "wide.png")
    Image.fromarray(np.zeros((2, 2), np.uint16)).save(tmp_path / "deep.png")
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (50, 50), np.uint8)).save(tmp_path / "whole.png")
    Image.fromarray(np.zeros((2, 2), np.uint8)).save(tmp_path / "whole.jpg")
    (tmp_path / "cut.png").write_bytes((tmp_path / "whole.png").read_bytes()[:200])
    path.write_text(text)
    with pytest.raises(InvalidValue) as refused:
        read_map(path)
    assert str(refused.value).startswith(str(path))
    assert BAD[text] in str(refused.value)


# ------------------------------------------------------------------------------------------- walls


GRIDS = (
    st.integers(1, 9)
    .flatmap(lambda n: st.lists(st.lists(st.sampled_from([F, X, U]), min_size=n, max_size=n), min_size=1, max_size=9))
    .map(lambda rows: np.array(rows, np.int8))
)


@given(GRIDS)
def test_rectangles_cover_exactly_the_cells_that_are_set_each_once(grid):
    covered = np.zeros(grid.shape, int)
    for row, column, rows, columns in rectangles(grid == X):
        covered[row : row + rows, column : column + columns] += 1
    assert (covered == (grid == X)).all()


@given(GRIDS, st.booleans())
def test_the_edge_is_what_lies_beside_a_cell_that_is_not_blocked(grid, beyond):
    blocked = grid == X
    around = np.pad(blocked, 1, constant_values=beyond)
    for row, column in np.ndindex(*blocked.shape):
        inner = around[row : row + 3, column : column + 3].all()
        assert edge(blocked, beyond)[row, column] == (blocked[row, column] and not inner)


def info(yaw: float = 0.0, cell: float = 0.5) -> MapInfo:
    return MapInfo("a.pgm", cell, (1.0, -2.0, yaw))


def floor_of(walls: list[dict]):
    scenario = read(Scenario, {"name": "a", "robot": {"start": [0, 0, 0], "goal": [1, 0]}, "walls": walls})
    return floor_of_robot(scenario.walls, (), ())


@settings(deadline=None)
@given(GRIDS, st.sampled_from([0.0, 0.5 * pi, 0.3, -2.0]))
def test_walls_are_met_exactly_where_the_map_is_occupied_whatever_its_yaw(grid, yaw):
    walls = floor_of(map_walls(OccupancyGrid(info(yaw), grid), unknown_blocks=False))
    c, s = cos(yaw), sin(yaw)
    rim = edge(grid == X, beyond=False)
    rows, columns = grid.shape
    # Clearance of places a tenth of a cell from the corners and sides of every cell.
    for row, column in np.ndindex(rows, columns):
        uv = 0.5 * np.array([(column + a, row + b) for a in (0.1, 0.5, 0.9) for b in (0.1, 0.5, 0.9)])
        points = np.array([1.0, -2.0]) + uv @ np.array([[c, s], [-s, c]])
        inside = walls.clearance(points) < 0.0
        assert inside.all() if rim[row, column] else not inside.any()


def test_unknown_cells_and_all_beyond_the_map_are_blocked_or_free(tmp_path):
    grid = OccupancyGrid(info(), np.array([[F, F, U], [F, F, F]], np.int8))
    assert map_walls(grid, unknown_blocks=False) == []
    walls = floor_of(map_walls(grid, unknown_blocks=True))
    inside = [[1.25, -1.75], [1.75, -1.75], [1.25, -1.25], [1.75, -1.25], [2.25, -1.25]]
    np.testing.assert_allclose(walls.clearance(inside), 0.25)
    around = [[2.25, -1.75], [0.75, -1.75], [2.75, -1.25], [1.25, -0.75], [1.25, -2.25]]
    assert (walls.clearance(around) < 0.0).all()


def test_a_map_of_too_many_rectangles_is_refused(monkeypatch):
    monkeypatch.setattr(map_file, "MAX_WALLS", 12)
    checks = np.indices((5, 5)).sum(axis=0) % 2 * X
    assert len(map_walls(OccupancyGrid(info(), checks.astype(np.int8)), unknown_blocks=False)) == 12
    with pytest.raises(InvalidValue, match="a map of at most 12 rectangles"):
        map_walls(OccupancyGrid(info(), (X - checks).astype(np.int8)), unknown_blocks=False)


# ------------------------------------------------------------------------------- scenes with a map


ROOM = np.full((12, 20), 254)
ROOM[[0, -1]] = ROOM[:, [0, -1]] = 0
ROOM[4:8, 10] = 0  # a wall across, x from 5.0 to 5.5 m and y from 2 to 4 m
WAY = {"robot.start": [2.0, 3.0, 0.0], "robot.goal": [8.0, 3.0]}


def test_a_map_is_a_scene_whose_text_needs_no_map(tmp_path):
    path = saved(tmp_path, ROOM)
    scenario = load(path, WAY)
    assert [(w.start, w.end, w.thickness) for w in scenario.walls if w.start[0] == 5.25] == [
        ((5.25, 2.0), (5.25, 4.0), 0.5)
    ]
    assert loads(dumps(scenario), recorded=True) == scenario
    (tmp_path / "b.toml").write_text(
        'schema = 1\nname = "a"\n[map]\nfile = "a.yaml"\nheight = 2.0\n[robot]\nstart = [2, 3, 0]\ngoal = [8, 3]\n'
        "[[walls]]\nfrom = [1, 1]\nto = [2, 1]\n"
    )
    other = load(tmp_path / "b.toml")
    assert (len(other.walls), other.walls[0].height, other.walls[1].height) == (len(scenario.walls) + 1, 1.0, 2.0)
    with pytest.raises(InvalidValue, match="only a run file may name another file"):
        loads((tmp_path / "b.toml").read_text())


def test_a_start_or_a_goal_off_the_free_cells_is_refused(tmp_path):
    path = saved(tmp_path, np.where(np.arange(20) == 15, 205, ROOM))
    for point, said in (
        ([5.2, 3.0], "there it is occupied"),
        ([7.7, 3.0], "there it is unknown"),
        ([99.0, 0.0], "beyond"),
    ):
        with pytest.raises(InvalidValue, match=said) as refused:
            load(path, WAY | {"robot.goal": point})
        assert "robot.goal" in str(refused.value)
    with pytest.raises(InvalidValue, match=r"people\.0\.start.*there it is occupied"):
        load(path, WAY | {"people": [{"start": [5.2, 3.0], "behaviour": "stand"}]})
    load(path, WAY | {"map.unknown": "free"})
    with pytest.raises(InvalidValue, match=r"robot\.goal.*a point to which a way leads"):
        load(path, WAY | {"robot.goal": [9.0, 3.0]})  # unknown cells from wall to wall


def test_a_way_over_unknown_cells_costs_what_the_route_says(tmp_path):
    room = ROOM.copy()
    room[8:11, 9:12] = 205  # between the wall across and the lower one, where the way is shorter
    path = saved(tmp_path, room)
    way = WAY | {"robot.start": [2.0, 2.5, 0.0], "robot.goal": [8.0, 2.5], "route.planner": "shortest"}
    assert load(path, way | {"map.unknown": "free"}).route == Route()
    sides = []
    for factor in (1.0, 5.0):
        scenario = load(path, way | {"map.unknown": "free", "route.unknown": factor})
        assert loads(dumps(scenario), recorded=True) == scenario
        assert scenario.route is not None
        finder, start = Wayfinder(scenario.route, scenario.robot.limits), np.array(scenario.robot.start)
        finder.follow(0.0, start, np.array(scenario.robot.goal), FloorMap(scenario).known, ())
        line = finder.ahead(start[:2])[1].line
        sides.append(float(line[np.abs(line[:, 0] - 5.25).argmin(), 1]))
    assert sides[0] < 2.0
    assert sides[1] > 4.0


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_the_robot_is_stopped_by_a_wall_of_the_map(tmp_path, engine):
    way = {"physics.engine": engine, "noise.profile": "none"}
    simulator = Simulator(load(saved(tmp_path, ROOM), WAY | way), 0)
    met = set()
    for _ in range(50):
        simulator.advance(0.1, [1.0, 0.0])
        met |= {contact.kind for contact in simulator.state().contacts}
    assert met == {"wall"}
    assert simulator.state().robot_pose[0] == pytest.approx(5.0 - 0.22, abs=0.01)


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_the_lidar_sees_what_a_march_over_the_cells_sees(tmp_path, engine):
    rng = np.random.default_rng(2)
    grey = np.where((ROOM == 0) | (rng.random(ROOM.shape) < 0.15), 0, 254)
    grey[5:8, 2:6] = 254
    path = saved(tmp_path, grey)
    path.write_text(path.read_text().replace("origin: [0.0, 0.0, 0.0]", "origin: [1.0, 2.0, 0.4]"))
    grid = read_map(path)
    c, s = cos(0.4), sin(0.4)
    start = np.array([1.0, 2.0]) + np.array([[c, -s], [s, c]]) @ [2.0, 2.75]
    goal = (start + 0.3).tolist()
    more = {"physics.engine": engine, "noise.profile": "none", "sensors.lidar": {"beams": 90}}
    scenario = load(path, {"robot.start": [*start.tolist(), 0.4], "robot.goal": goal, **more})
    simulator = Simulator(scenario, 0)
    (reading, *_) = simulator.sense()
    lidar = scenario.sensors.scanner
    marched = [march(grid, start, 0.4 + angle, lidar.max_range) for angle in lidar.angles]
    np.testing.assert_allclose(reading.scan, marched, atol=0.02)


def march(grid: OccupancyGrid, start: Array, angle: float, reach: float) -> float:
    """The way to the first occupied cell in steps of 1 cm; inf beyond `reach`."""
    for way in np.arange(0.0, reach, 0.01):
        x, y = start + way * np.array([cos(angle), sin(angle)])
        if grid.cell_of((x, y)) == OCCUPIED:
            return way
    return np.inf


# ------------------------------------------------------------------------------------------ writing


@given(GRIDS)
def test_a_map_that_is_written_is_read_as_it_was(tmp_path_factory, grid):
    folder = tmp_path_factory.mktemp("written")
    text, picture = written_map(OccupancyGrid(info(0.3, 0.05), grid))
    (folder / "a.yaml").write_bytes(text)
    (folder / "a.pgm").write_bytes(picture)
    again = read_map(folder / "a.yaml")
    assert (again.info, again.cells.tolist()) == (info(0.3, 0.05), grid.tolist())


def test_a_map_may_have_a_name_with_the_marks_of_yaml(tmp_path):
    text, picture = written_map(OccupancyGrid(replace(info(), image="a #b: c.pgm"), np.zeros((2, 3), np.int8)))
    (tmp_path / "a.yaml").write_bytes(text)
    (tmp_path / "a #b: c.pgm").write_bytes(picture)
    assert read_map(tmp_path / "a.yaml").info.image == "a #b: c.pgm"


def test_cells_so_large_that_the_start_is_in_an_occupied_one_are_refused():
    floor, points = floor_of([{"from": [-1.0, 0.5], "to": [1.0, 0.5]}]), np.array([[0.0, 0.0], [4.0, 0.0]])
    with pytest.raises(InvalidValue, match=r"resolution: found 5\.0; allowed: smaller cells"):
        map_of(floor, points, 5.0, "a.pgm")


def test_a_scene_keeps_its_occupied_cells_through_map_and_scene():
    walls = [{"from": [0.03, 1.0], "to": [3.0, 1.71]}, {"from": [-1.0, -2.0], "to": [4.0, -2.0]}]
    pillars = [{"position": [2.0, -0.5], "radius": 0.01}, {"position": [1.013, -1.2], "radius": 0.3}]
    document = {"name": "a", "robot": {"start": [0, 0, 0], "goal": [4, 0]}, "walls": walls, "pillars": pillars}
    scenario = read(Scenario, document)
    floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
    points = np.array([[0.0, 0.0], [4.0, 0.0]])
    grid = map_of(floor, points, 0.05, "a.pgm")
    again = map_of(floor_of(map_walls(grid, unknown_blocks=True)), points, 0.05, "a.pgm")
    inner = again.cells[21:-21, 21:-21]  # around it is the wall of what lies beyond the first map, and a rim
    assert ((inner != FREE) == (grid.cells != FREE)).all()
    # A wall that lies on the lines of the cells has these and no others: 5 m x 0.1 m.
    assert (grid.cells[:24] == OCCUPIED).sum() == 100 * 2
