from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.geometry.distances import nearest_pairs

POINTS = st.lists(st.tuples(*[st.floats(-2.0, 2.0)] * 2), max_size=4).map(lambda found: np.reshape(found, (-1, 2)))


@settings(max_examples=60, deadline=None)
@given(POINTS, POINTS)
def test_pairs_cost_as_little_as_the_best_of_all_assignments(first, second):
    gate = 1.0
    pairs = nearest_pairs(first, second, gate)

    def cost(pairs):
        return sum(np.linalg.norm(first[i] - second[j]) for i, j in pairs) + gate * (len(first) - len(pairs))

    padded = [*range(len(second)), *[None] * len(first)]
    every = (
        [(i, j) for i, j in enumerate(chosen) if j is not None and np.linalg.norm(first[i] - second[j]) <= gate]
        for chosen in set(permutations(padded, len(first)))
    )
    assert abs(cost(pairs) - min(map(cost, every))) < 1e-9
    assert len({j for _, j in pairs}) == len(pairs)


def test_who_is_not_there_and_who_is_too_far_is_left_out():
    people = [[np.nan, np.nan], [0.0, 0.0], [5.0, 5.0]]
    assert nearest_pairs(people, [[4.8, 5.0], [0.0, 1.1]], 1.0) == [(2, 0)]
    assert nearest_pairs(people, np.zeros((0, 2)), 1.0) == []
