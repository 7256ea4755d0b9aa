"""The velocities of ORCA are those of RVO2, the library of the method's authors, through pyrvo.

It computes in single precision. It differs in one thing: against a wall it takes the half-plane nearest to the present
velocity, where mjnav takes the one against the nearest point, as the paper advises. The two are one where the person
walks straight at the wall; elsewhere RVO2's may be the wider, and it is not compared.
"""

import numpy as np
import pyrvo
import pytest

PERIOD, RADIUS = 0.25, 0.3


def by_rvo2(position, velocity, desired, max_speed=1.5, wall=None):
    simulator = pyrvo.RVOSimulator(PERIOD, 10.0, 10, 5.0, 2.0, RADIUS, max_speed)
    for i, (p, v, w) in enumerate(zip(position, velocity, desired, strict=True)):
        simulator.add_agent(tuple(p))
        simulator.set_agent_velocity(i, tuple(v))
        simulator.set_agent_pref_velocity(i, tuple(w))
    if wall is not None:
        simulator.add_obstacle(wall)
        simulator.process_obstacles()
    simulator.do_step()
    return np.array([simulator.get_agent_velocity(i).to_tuple() for i in range(len(position))])


CASES = {
    "head on": ([(-2.0, 0.0), (2.0, 0.0)], [(1.2, 0.0), (-1.2, 0.0)]),
    "head on, aside": ([(-2.0, 0.1), (2.0, 0.0)], [(1.2, 0.0), (-1.2, 0.0)]),
    "crossing": ([(-2.0, 0.0), (0.0, -2.0)], [(1.2, 0.0), (0.0, 1.2)]),
    "four ways": ([(-2.0, 0.0), (0.0, -2.0), (2.0, 0.0), (0.0, 2.0)], [(1.2, 0.0), (0.0, 1.2), (-1.2, 0), (0, -1.2)]),
    "from behind": ([(-2.0, 0.05), (0.0, 0.0)], [(1.4, 0.0), (0.4, 0.0)]),
    "touching": ([(0.0, 0.0), (0.55, 0.0)], [(0.5, 0.0), (-0.5, 0.0)]),
}


@pytest.mark.parametrize("case", CASES)
def test_small_cases_agree(people, case):
    position, velocity = (np.array(part, float) for part in CASES[case])
    found = people(position, velocity).orca(max_speed=1.5, period=PERIOD)
    assert found == pytest.approx(by_rvo2(position, velocity, velocity), abs=2e-5)


def test_crowds_agree_where_half_planes_leave_a_velocity_and_where_they_leave_none(people):
    """Conditioning: where two nearly parallel lines meet, single precision moves the point."""
    rng, apart = np.random.default_rng(0), []
    for spread in (1.0, 2.0, 4.0):
        for _ in range(10):
            position, velocity = rng.uniform(-spread, spread, (8, 2)), rng.uniform(-0.8, 0.8, (8, 2))
            desired = rng.uniform(-1.0, 1.0, (8, 2))
            found = people(position, velocity).orca(desired=desired, max_speed=1.5, period=PERIOD)
            apart += np.abs(found - by_rvo2(position, velocity, desired)).max(axis=1).tolist()
    assert np.median(apart) < 1e-6
    assert np.quantile(apart, 0.97) < 1e-3
