"""Overlaps and goals that cannot be reached are refused, touching is not; which starts a robot could survive."""

import pytest

from mjnav.errors import InvalidValue
from mjnav.scene import loads
from mjnav.scene.check import is_avoidable

HEAD = 'schema = 1\nname = "bodies"\n[robot]\nstart = [0, 0, 0]\ngoal = [9, 0]\n'
RING = [(0.7, 0), (0.4, 0.5), (-0.2, 0.6), (-0.6, 0.2), (-0.6, -0.3), (-0.2, -0.6), (0.4, -0.5)]
LONG, ONCE = "size = [4, 0.5]", "loop = false"
ROOM = "[[walls]]\nfrom = [-1, -2]\nto = [12, -2]\n[[walls]]\nfrom = [-1, -2]\nto = [-1, 2]\n"
CLOSED = ROOM + "[[walls]]\nfrom = [12, -2]\nto = [12, 2]\n[[walls]]\nfrom = [-1, 2]\nto = [12, 2]\n"


def pillar(x, y, more=""):
    return f"[[pillars]]\nposition = [{x}, {y}]\n{more}\n"


def table(x, y, more=""):
    return f"[[tables]]\nposition = [{x}, {y}]\n{more}\n"


def person(x, y):
    return f'[[people]]\nstart = [{x}, {y}]\nbehaviour = "constant_velocity"\nvelocity = [0, 0]\n'


def wall(x0, y0, x1, y1, more=""):
    return f"[[walls]]\nfrom = [{x0}, {y0}]\nto = [{x1}, {y1}]\n{more}\n"


def walker(start, *points, more=""):
    route = ", ".join(f"[{x}, {y}]" for x, y in points)
    return f'[[people]]\nstart = {list(start)}\nbehaviour = "waypoints"\nwaypoints = [{route}]\n{more}\n'


NARROW = CLOSED + pillar(5, 1.2, "radius = 0.6") + walker((2, 1), (8, 1))
REFUSED = {  # bodies, the key that is refused, and the body that is in the way
    "a start in a wall": (wall(-1, 0.1, 5, 0.1), "robot.start", "walls.0, 0.170 m further away"),
    "a start in a table leg": (table(0.8, 0.4), "robot.start", "tables.0, 0.25"),
    "a person in a wall": (ROOM + person(4, -1.8), "people.0.start", "walls.0, 0.150 m further away"),
    "a person in a table": (table(4, 2) + person(4, 2), "people.0.start", "tables.0"),
    "a pillar through a table": (table(4, 2) + pillar(4, 2), "pillars.0.position", "tables.0"),
    "a wall through a table": (wall(3, 1, 5, 3) + table(4, 2), "tables.0.position", "walls.0"),
    "a goal in a leg": (table(9.8, 0.4), "robot.goal", "tables.0"),
    "a goal in a ring": ("".join(pillar(9 + x, y) for x, y in RING), "robot.goal", "walls, legs and pillars"),
    "a leg out of the room": (CLOSED + walker((4, 0), (4, -4)), "people.0.waypoints.0", "walls.0"),
    "a narrow gap": (NARROW + pillar(5, -1.2, "radius = 1.21"), "people.0.waypoints.0", "pillars.0"),
    "a waypoint under a table": (table(4, 2) + walker((4, 0), (4, 2)), "people.0.waypoints.0", "tables.0"),
    "one close behind a thin wall": (
        wall(3, -2, 5, -2, "thickness = 0.001") + walker((4, 0), (4, -2.1)), "people.0.waypoints.0", "walls.0"
    ),
}  # fmt: skip


@pytest.mark.parametrize("title", REFUSED)
def test_bodies_that_overlap_and_routes_without_a_way_are_refused(title):
    text, key, body = REFUSED[title]
    with pytest.raises(InvalidValue) as error:
        loads(HEAD + text)
    assert str(error.value).startswith(f"scenario.toml: {key}: found (")
    assert f"clear of {body}" in str(error.value)


def test_what_was_recorded_before_routes_were_planned_still_loads():
    text = HEAD + table(4, 2) + walker((4, 0), (4, 2))
    assert loads(text, recorded=True).people[0].behaviour.waypoints == ((4.0, 2.0),)
    assert loads(HEAD + CLOSED + wall(5, -2, 5, 2), recorded=True).robot.goal == (9.0, 0.0)


ALLOWED = {
    "a person who touches a pillar": pillar(4, 2) + person(4.5, 2),
    "two people who overlap: they step apart": person(4, 2) + person(4.5, 2),
    "a start between a table's legs": table(0, 0),
    "a low pillar below a table": table(4, 2) + pillar(4, 2, "height = 0.3"),
    "a start off the end of a thick wall": wall(0.3, 0, 5, 0, "thickness = 1.0"),
    "a way past a wall's end": wall(4, 0.31, 4, 3) + walker((2, 1), (2, 0), (6, 0), more="loop = false"),
    "a wall in the way, around which there is a way": ROOM + walker((4, 0), (4, -4)),
    "a gap between pillars that is wide enough": NARROW + pillar(5, -1.2, "radius = 1.18"),
}


@pytest.mark.parametrize("title", ALLOWED)
def test_bodies_that_touch_or_pass_below_are_allowed(title):
    assert loads(HEAD + ALLOWED[title])


# ------------------------------------------------------------------------------------------ the oracle


LANE = "".join(f"[[walls]]\nfrom = [-3, {y}]\nto = [9, {y}]\n" for y in (-0.4, 0.4))  # too narrow for two


def walking(x, y, vx, vy):
    return f'[[people]]\nstart = [{x}, {y}]\nbehaviour = "constant_velocity"\nvelocity = [{vx}, {vy}]\nradius = 0.2\n'


@pytest.mark.parametrize(
    ("scene", "avoidable"),
    [
        (LANE + walking(2, 0, -1.2, 0), False),  # nobody passes, and the robot does not reverse
        (LANE + walking(2, 0, 1.2, 0), True),  # who walks away
        (LANE + walking(8, 0, -1.2, 0), True),  # who is too far to come in 3 s
        (walking(0.8, 0, -1.5, 0), False),  # 0.4 m before contact at 1.5 m/s: 0.25 s, in which 1 m/s² moves 3 cm
        (walking(3.5, 0, -1.2, 0), True),  # in the open there is time to step aside
        (walking(0.6, 0, 0, 0), True),  # who stands beside a robot that may stand
    ],
)
def test_a_start_is_avoidable_where_some_control_touches_nothing(scene, avoidable):
    assert is_avoidable(loads(HEAD + scene)) is avoidable


def test_people_count_from_when_they_enter_until_they_leave():
    for keys, avoidable in ("", False), ("enters = 3.5", True), ("leaves = 0.5", True), ("enters = 0.5", False):
        assert is_avoidable(loads(HEAD + LANE + walking(2, 0, -1.2, 0) + keys)) is avoidable, keys
    assert is_avoidable(loads(HEAD + LANE + walking(0, 0, 0, 0) + "enters = 0.5"))  # waits until the place is free


@pytest.mark.parametrize(
    ("walk", "avoidable"),
    [
        ('behaviour = "replay"\ntrack = [[0, 2, 0], [1, 0.8, 0], [2, 0, 0], [3, -1, 0]]', False),
        ('behaviour = "replay"\ntrack = [[0, 2, 0], [1, 1.2, 0], [2, 2, 0]]', True),  # turns round in time
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[-2, 0]]', False),
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[1.2, 0], [8, 0]]', True),
        ('behaviour = "waypoints"\nspeed = 1.2\nwaypoints = [[1, 0]]\nat_end = "leave"', True),
        ('behaviour = "stop_and_go"\nvelocity = [-1.2, 0]\ngo_time = 0.5\nstop_time = 9', True),
        ('behaviour = "stop_and_go"\nvelocity = [-1.2, 0]\ngo_time = 2.5\nstop_time = 9', False),
    ],
)
def test_the_oracle_knows_tracks_turns_ends_and_pauses(walk, avoidable):
    scene = HEAD + LANE + f"[[people]]\nstart = [2, 0]\nradius = 0.2\n{walk}\n"
    assert is_avoidable(loads(scene)) is avoidable
