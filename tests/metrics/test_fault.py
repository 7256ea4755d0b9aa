from dataclasses import replace

import numpy as np
import pytest

from mjnav.messages import Contact
from mjnav.metrics import safety as fault
from mjnav.scene.people import SocialForce
from mjnav.scene.spec import ConstantVelocity, Person
from tests.metrics.conftest import make_scenario, make_trajectory


def walker(sees):
    return Person((5.0, 5.0), SocialForce(((0.0, 0.0),)), sees_robot=sees)


def hit(v, walking, *, sees, times=(0.12,), at=(1.0, 0.0)):
    """A robot that drives along +x at v and touches a person at a place who walks so, in the second tick."""
    rows = 4
    trajectory = make_trajectory(
        np.zeros((rows, 2)),
        people=np.tile(at, (rows, 1, 1)),
        robot_twist=np.tile([v, 0.0], (rows, 1)),
        people_velocity=np.tile(walking, (rows, 1, 1)),
        contacts=tuple(Contact("person", "person0", 0.0, time) for time in times),
    )
    return trajectory, replace(make_scenario(), people=(walker(sees),))


@pytest.mark.parametrize(
    ("v", "walking", "sees", "moving", "at_fault"),
    [
        (0.8, (0.0, 0.0), True, True, True),  # it ran into somebody who stood
        (0.8, (-0.5, 0.0), True, True, True),  # it came faster
        (0.5, (-0.8, 0.0), True, True, False),  # the person came faster, and could have given way
        (0.5, (-0.8, 0.0), False, True, True),  # who does not see it cannot
        (0.5, (1.2, 0.0), True, True, True),
        (-0.3, (-0.8, 0.0), True, True, False),  # it backed away
        (0.0, (-0.8, 0.0), False, False, False),  # at rest it is never at fault
        (0.09, (0.0, 0.0), False, False, False),  # what noise moves a robot that stands by
    ],
)
def test_the_rule(v, walking, sees, moving, at_fault):
    (touch,) = fault.touches(*hit(v, walking, sees=sees))
    assert (touch.moving, touch.at_fault) == (moving, at_fault)
    assert (touch.person, touch.speed) == (0, abs(v))


def test_what_counts_is_the_state_before_the_contact():
    trajectory, scenario = hit(0.8, (0.0, 0.0), sees=False)
    stopped = np.array([[0.8, 0.0], [0.8, 0.0], [0.0, 0.0], [0.0, 0.0]])  # by the contact at 0.12 s
    (touch,) = fault.touches(replace(trajectory, robot_twist=stopped), scenario)
    assert touch.moving
    assert touch.at_fault


def test_a_contact_that_lasts_is_judged_once_and_other_bodies_not_at_all():
    trajectory, scenario = hit(0.8, (0.0, 0.0), sees=False, times=(0.12, 0.2, 0.3))
    others = (Contact("wall", "wall0", 1.0, 0.05), *trajectory.contacts)
    assert len(fault.touches(replace(trajectory, contacts=others), scenario)) == 1


def test_how_many_people_see_the_robot():
    scenario, blind, seeing = make_scenario(), walker(False), walker(True)
    deaf = Person((5.0, 5.0), ConstantVelocity((1.0, 0.0)), sees_robot=True)  # walks on whatever it sees
    assert fault.sees_robot(replace(scenario, people=(deaf, replace(deaf, temperament="scared")))) == (False, True)
    for people, expected in (
        ((), None),
        ((blind,) * 3, "none"),
        ((seeing,) * 2, "all"),
        ((seeing, blind, seeing), "2 of 3"),
    ):
        assert fault.people_see_robot(replace(scenario, people=people)) == expected
