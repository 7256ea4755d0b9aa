from math import cos, hypot, nan, pi, sin

import numpy as np
import pytest

BOX = np.array([[2.0, 0.0, 0.0, 1.0, 5.0, 0.1]])  # a wall whose surface is at x = 1.9


def closest(p, v, q, u, horizon=5.0):
    """Least distance of two who keep their velocities for the horizon."""
    t = np.linspace(0.0, horizon, 501)[:, None]
    return np.hypot(*(np.subtract(p, q) + t * np.subtract(v, u)).T).min()


@pytest.mark.parametrize("seed", range(6))
def test_two_who_both_take_their_half_keep_clear_for_the_horizon(people, seed):
    rng = np.random.default_rng(seed)
    way = rng.uniform(0.7, 4.0) * np.array([cos(angle := rng.uniform(-pi, pi)), sin(angle)])
    both = people([way, -way], [-0.8 * way / hypot(*way) + rng.normal(0.0, 0.2, 2), rng.normal(0.0, 0.5, 2)])
    found = both.orca(max_speed=9.0)
    assert closest(way, found[0], -way, found[1]) >= 0.6 - 1e-6


def test_the_robots_share_is_the_part_of_the_avoidance_that_a_person_takes(people):
    both = people([(0.0, 0.0), (3.0, 0.1)], [(1.0, 0.0), (-1.0, 0.0)], robot=True)
    turn = [abs(both.orca(robot_share=share)[0] - (1.0, 0.0)).max() for share in (0.0, 0.5, 1.0)]
    assert turn[0] == pytest.approx(0.0, abs=1e-9)
    assert turn[1] == pytest.approx(0.5 * turn[2], rel=1e-9)
    unseen = people(both.position, both.velocity, robot=True, sees=False)
    assert unseen.orca()[0].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("distance", [2.0, 0.75])  # beyond the personal space, and within it
def test_a_person_keeps_the_personal_space_from_the_robot_or_comes_no_nearer(people, distance):
    both = people([(0.0, 0.0), (distance, 0.1)], [(0.8, 0.0), (0.0, 0.0)], robot=True)
    found = both.orca(robot_share=1.0, personal_space=0.2)[0]
    gap = np.hypot(distance, 0.1)
    assert closest((0.0, 0.0), found, (distance, 0.1), (0.0, 0.0)) >= min(0.8, gap) - 1e-6
    assert hypot(*found) <= 0.8 + 1e-9  # nobody is thrown back
    other = people(both.position, both.velocity)
    np.testing.assert_array_equal(other.orca(personal_space=0.2), other.orca())  # no space between people


def test_a_robot_that_is_taken_for_a_thing_at_rest_is_left_all_of_the_avoidance(people):
    place = [(0.0, 0.0), (2.0, 0.1)]
    found = people(place, [(1.0, 0.0), (-1.0, 0.3)], robot=True, at_rest=True).orca()[0]
    still = people(place, [(1.0, 0.0), (0.0, 0.0)], robot=True).orca(robot_share=1.0)[0]
    np.testing.assert_array_equal(found, still)


def test_a_wall_leaves_the_velocity_along_it_and_away_from_it(people):
    """1.9 m - 0.3 m - 1.1 m = 0.5 m of room, to be used up in 0.5 s at the soonest."""
    one = people((1.1, 0.0), (0.0, 0.0), boxes=BOX)
    assert one.orca(desired=[(1.8, 0.7)], wall_horizon=0.5)[0] == pytest.approx([1.0, 0.7])
    assert one.orca(desired=[(-1.5, 0.2)])[0] == pytest.approx([-1.5, 0.2])
    touching = people((1.7, 0.0), (0.0, 0.0), boxes=BOX)
    assert touching.orca(desired=[(1.0, 0.4)])[0] == pytest.approx([0.0, 0.4], abs=1e-9)


def test_of_people_who_leave_no_way_the_wall_is_the_one_that_is_not_given_way_to(people):
    place = [(1.55, 0.0), *[(1.0 + 0.1 * k, (-1.0) ** k * 0.65) for k in range(5)], (0.9, 0.0)]
    crowd = people(place, [(1.0, 0.0)] * 7, boxes=BOX)
    for horizon in (0.5, 2.0):
        vx = crowd.orca(wall_horizon=horizon)[:, 0]
        room = np.maximum(1.6 - crowd.position[:, 0], 0.0)
        assert (vx <= room / horizon + 1e-9).all()


def test_only_the_nearest_people_within_the_distance_count(people):
    place = [(0.0, 0.0), (2.0, 0.1), (4.0, -0.2), (9.0, 0.0)]
    crowd = people(place, [(1.0, 0.0)] + [(-1.0, 0.0)] * 3)
    two = people(place[:2], crowd.velocity[:2])
    np.testing.assert_array_equal(crowd.orca(max_neighbours=1)[0], two.orca()[0])
    np.testing.assert_array_equal(crowd.orca(neighbour_distance=3.0)[0], two.orca()[0])
    absent = people([*place[:2], (nan, nan)], [*crowd.velocity[:2], (nan, nan)])
    np.testing.assert_array_equal(absent.orca()[:2], two.orca())
