from math import cos, exp, hypot, inf, nan, pi

import numpy as np
import pytest

from mjnav.motion.social_force import FORMS

WALL = np.array([[0.0, 2.0, 1.0, 0.0, 5.0, 0.1]])  # its surface at y = 1.9
ALONE = {"drive": 0.0, "lookahead": 0.0, "obstacle_strength": 0.0}


@pytest.mark.parametrize("seed", range(3))
def test_helbings_forces_are_the_gradient_of_the_elliptic_potential(crowd, seed):
    some = crowd(seed)
    found = some.accelerations("helbing", obstacle_strength=0.0, relaxation_time=inf, cut=inf)

    def potential(r, v):
        b = 0.5 * np.sqrt((hypot(*r) + hypot(*(r - 2.0 * v))) ** 2 - (2.0 * hypot(*v)) ** 2)
        return 2.1 * exp(-b / 0.3)

    for i, row in enumerate(found):
        total = np.zeros(2)
        for j in (j for j in range(8) if j != i):
            r, v, h = some.position[i] - some.position[j], some.velocity[j], 1e-6 * np.eye(2)
            f = -np.array([(potential(r + h[k], v) - potential(r - h[k], v)) / 2e-6 for k in range(2)])
            ahead = -f @ some.velocity[i] >= cos(100.0 * pi / 180.0) * hypot(*f) * hypot(*some.velocity[i])
            total += f if ahead else 0.5 * f
        assert row == pytest.approx(total, abs=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_walls_push_away_by_their_distance_and_the_nearest_obstacle_alone_where_the_form_says_so(people, form):
    law = FORMS[form]
    pillar = np.array([[0.0, 0.0, 0.2]])
    one = people((0.0, 1.2), (0.0, 0.0), boxes=WALL, discs=pillar)  # 0.7 m to the wall, 1 m to the pillar
    skin = 0.3 if law.from_surface else 0.0
    wall, other = (law.obstacle_strength * exp(-(d - skin) / law.obstacle_range) for d in (0.7, 1.0))
    assert one.accelerations(form)[0] == pytest.approx([0.0, -wall if law.nearest_only else other - wall], abs=1e-9)


@pytest.mark.parametrize("form", ["moussaid", "moussaid_2009"])
@pytest.mark.parametrize("at_rest", [False, True])
def test_the_robot_pushes_from_its_surface_as_a_person_and_as_an_obstacle(people, form, at_rest):
    """Seen from somebody at rest at 0.5 m from its surface; the robot moves, or is taken for a thing at rest."""
    law = FORMS[form]
    speed = 0.4
    both = people([(0.0, 0.0), (1.1, 0.0)], [(0.0, 0.0), (-speed, 0.0)], robot=True, at_rest=at_rest)
    found = both.accelerations(form, personal_space=0.2, lookahead=0.0)[0]
    size = 1.0 + (0.0 if at_rest else law.velocity_weight * speed)
    as_person = law.strength * exp(-0.5 / (law.interaction_range * size))
    as_obstacle = law.obstacle_strength * exp(-0.3 / law.obstacle_range)
    assert found[0] == pytest.approx(-as_person - as_obstacle)
    assert abs(found[1]) == pytest.approx(as_person)  # n, for theta = 0


def test_two_who_walk_straight_at_one_another_both_keep_to_the_right(people):
    for ahead in np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]):
        push = people([-ahead, ahead], [ahead, -ahead]).accelerations(drive=0.0, lookahead=0.0)
        right = np.array([ahead[1], -ahead[0]])
        assert push[0] @ right > 0.1
        np.testing.assert_array_equal(push[1], -push[0])


def test_who_look_ahead_give_room_to_those_who_come_towards_them(people):
    def push(*others):
        place = [(0.0, 0.0), *[p for p, _ in others]]
        some = people(place, [(1.0, 0.0), *[v for _, v in others]])
        return some.accelerations(**(ALONE | {"lookahead": 1.0}), strength=0.0)[0].tolist()

    left, right, towards = (5.0, 0.5), (5.0, -0.5), (-1.0, 0.0)
    assert push((left, towards)) == [0.0, -0.5]
    assert push((right, towards)) == [0.0, 0.5]
    assert push((left, towards), (right, towards)) == [0.0, 0.0]
    assert push((left, towards), (left, towards), (right, towards)) == [0.0, -0.5]
    assert push((left, (1.0, 0.0)), ((5.0, 3.0), towards), ((-5.0, 0.1), towards), ((20.1, 1.0), towards)) == [0.0, 0.0]


@pytest.mark.parametrize("form", FORMS)
def test_who_is_far_absent_or_unseen_changes_no_bit(people, crowd, form):
    some = crowd(5)
    before = some.accelerations(form)
    extra = {"far": (60.0, 0.0), "absent": (nan, nan)}
    for place in extra.values():
        more = people([*some.position, place], [*some.velocity, place])
        np.testing.assert_array_equal(more.accelerations(form)[:8], before)
    near = people([*some.position, (0.1, 0.2)], [*some.velocity, (1.0, 0.0)], robot=True)
    assert (near.accelerations(form)[:8] != before).any()
    unseen = people([*some.position, (0.1, 0.2)], [*some.velocity, (1.0, 0.0)], robot=True, sees=False)
    np.testing.assert_array_equal(unseen.accelerations(form)[:8], before)


@pytest.mark.parametrize("form", FORMS)
def test_who_stand_at_one_place_are_pushed_apart_with_finite_force(people, form):
    found = people([(1.0, 1.0), (1.0, 1.0)], [(0.0, 0.0), (0.0, 0.0)]).accelerations(form)
    assert np.isfinite(found).all()
    assert found[0, 0] < 0.0 < found[1, 0]


@pytest.mark.parametrize("form", FORMS)
def test_nobody_beyond_the_cut_counts(crowd, people, form):
    some = crowd(1, num=12)
    distance = np.hypot(*(some.position - some.position[0]).T)
    within = distance <= np.median(distance)
    few = people(some.position[within], some.velocity[within])
    found = some.accelerations(form, cut=np.median(distance), lookahead=0.0)[0]
    np.testing.assert_array_equal(found, few.accelerations(form, cut=inf, lookahead=0.0)[0])
    assert (found != some.accelerations(form, cut=inf, lookahead=0.0)[0]).any()
