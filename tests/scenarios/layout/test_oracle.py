"""Which starts a robot that knows all could survive: cases that are decided by hand."""

import pytest

from mjnav.scenarios import loads
from mjnav.scenarios.layout.oracle import is_avoidable

HEAD = 'schema = 1\nname = "start"\n[robot]\nstart = [0, 0, 0]\ngoal = [9, 0]\n'
LANE = "".join(f"[[walls]]\nfrom = [-3, {y}]\nto = [9, {y}]\n" for y in (-0.4, 0.4))  # too narrow for two


def person(x, y, vx, vy):
    return f'[[people]]\nstart = [{x}, {y}]\nbehaviour = "constant_velocity"\nvelocity = [{vx}, {vy}]\nradius = 0.2\n'


@pytest.mark.parametrize(
    ("scene", "avoidable"),
    [
        (LANE + person(2, 0, -1.2, 0), False),  # nobody passes, and the robot does not reverse
        (LANE + person(2, 0, 1.2, 0), True),  # who walks away
        (LANE + person(8, 0, -1.2, 0), True),  # who is too far to come in 3 s
        (person(0.8, 0, -1.5, 0), False),  # 0.4 m before contact at 1.5 m/s: 0.25 s, in which 1 m/s² moves 3 cm
        (person(3.5, 0, -1.2, 0), True),  # in the open there is time to step aside
        (person(0.6, 0, 0, 0), True),  # who stands beside a robot that may stand
    ],
)
def test_a_start_is_avoidable_where_some_control_touches_nothing(scene, avoidable):
    assert is_avoidable(loads(HEAD + scene)) is avoidable
