"""GOSPA on small exact cases, against all assignments, and against Stone Soup's."""

from datetime import datetime
from itertools import permutations, product

import numpy as np
import pytest
from stonesoup.metricgenerator.ospametric import GOSPAMetric
from stonesoup.types.state import State

from mjnav.metrics.tracking import ABSENT, CUTOFF, GATE, NONE, gospa, gospa_squared, identity, track_numbers
from mjnav.scene.spec import Estimation, ObstacleEstimation


def padded(*ticks) -> np.ndarray:
    """Sets of points as one array (t, n, 2)."""
    found = np.full((len(ticks), max(map(len, ticks)), 2), np.nan)
    for row, tick in zip(found, ticks, strict=True):
        row[: len(tick)] = np.reshape(tick, (-1, 2))
    return found


@pytest.mark.parametrize(
    ("people", "tracks", "parts"),
    [
        ([], [], (0.0, 0.0, 0.0)),
        ([(0, 0)], [(0.3, 0.4)], (0.25, 0.0, 0.0)),
        ([(0, 0)], [], (0.0, 0.5, 0.0)),
        ([], [(0, 0), (5, 5)], (0.0, 0.0, 1.0)),
        ([(0, 0)], [(3, 0)], (0.0, 0.5, 0.5)),  # too far: missed, and a false track
        ([(0, 0), (0.6, 0)], [(0.5, 0)], (0.01, 0.5, 0.0)),  # the nearer person has the track
        ([(0, 0), (0.5, 0)], [(0.4, 0), (-0.9, 0)], (0.01 + 0.81, 0.0, 0.0)),
        ([(0, 0), (0.5, 0)], [(0.4, 0), (1.3, 0)], (0.16 + 0.64, 0.0, 0.0)),  # a greedy choice would pay 0.01 + 1
    ],
)
def test_gospa_of_small_cases_by_hand(people, tracks, parts):
    found = gospa_squared(padded(people), padded(tracks))
    np.testing.assert_allclose(found, [parts], atol=1e-15)


def test_it_equals_stone_soups():
    rng, now = np.random.default_rng(4), datetime(2026, 1, 1)
    metric = GOSPAMetric(c=CUTOFF, p=2)
    for sizes in [*product(range(5), range(5))][1:] * 3:  # it takes no two empty sets
        sets = [rng.uniform(0.0, 2.0, (size, 2)) for size in sizes]
        tracks, people = ([State(point[:, None], timestamp=now) for point in points] for points in sets)
        value = metric.compute_gospa_metric(tracks, people)[0].value
        (found,) = gospa_squared(sets[1][None], sets[0][None])
        assert np.sqrt(found.sum()) == pytest.approx(value["distance"], abs=1e-12)
        theirs = [value["localisation"], value["missed"], value["false"]]
        np.testing.assert_allclose(found, theirs, atol=1e-12)


def test_over_a_run_it_is_the_root_of_the_mean_square_and_its_parts_add_up(trajectory_through, scenario_with):
    people = np.array([[[1.0, 0.0]], [[2.0, 0.0]], [[np.nan] * 2], [[4.0, 0.0]]])
    tracks = np.array([[[1.3, 0.4, 0, 0]], [[np.nan] * 4], [[3.0, 0.0, 0, 0]]])
    trajectory = trajectory_through(np.zeros((4, 2)), people=people, tracks=tracks)
    found = gospa(trajectory, scenario_with(num_people=1))
    squares = np.square([found.localization, found.missed, found.false])
    np.testing.assert_allclose(squares, [0.25 / 3, 0.5 / 3, 0.5 / 3])
    assert found.total**2 == pytest.approx(squares.sum())


def test_where_the_lidar_is_the_source_its_range_bounds_people_and_tracks(trajectory_through, scenario_with):
    people = np.array([[[1.0, 0.0], [11.0, 0.0]]] * 2)
    states = np.array([[0, 7, 1.0, 0.5, 0, 0, 0], [0, 8, 12.0, 0.0, 0, 0, 0]])
    tracks = np.array([[[1.0, 0.5, 0, 0], [np.nan] * 4]])
    trajectory = trajectory_through(np.zeros((2, 2)), people=people, tracks=tracks, track_states=states)
    near, all_of_it = (
        gospa(trajectory, scenario_with(num_people=2, estimation=estimation)).total ** 2
        for estimation in (Estimation(obstacles=ObstacleEstimation(source="lidar")), Estimation())
    )
    assert (near, all_of_it) == (pytest.approx(0.25), pytest.approx(0.25 + 1.0))  # missed at 11 m, false at 12 m


def test_ticks_without_a_belief_and_scenes_without_people_have_none(trajectory_through, scenario_with):
    people = np.zeros((3, 1, 2))
    estimate = np.array([[np.nan] * 3, [0.0] * 3])
    tracks = np.array([[[np.nan] * 4], [[0.0] * 4]])
    trajectory = trajectory_through(np.zeros((3, 2)), people=people, tracks=tracks, estimate=estimate)
    assert gospa(trajectory, scenario_with(num_people=1)).total == 0.0
    blind = trajectory_through(np.zeros((3, 2)), people=people, tracks=tracks, estimate=np.full((2, 3), np.nan))
    assert gospa(blind, scenario_with(num_people=1)) is None
    assert gospa(trajectory_through([[0, 0], [1, 0]]), scenario_with()) is None


def run_of(make, people, tracks):
    """People by tick, (T, P) places x + iy or None; tracks by tick, {number: place}."""
    places = np.array([[complex(np.nan, np.nan) if z is None else z for z in row] for row in people])
    xy = np.stack([places.real, places.imag], axis=-1)
    states = [[k, number, z.real, z.imag, 0.0, 0.0, 0.0] for k, tick in enumerate(tracks) for number, z in tick.items()]
    ticks = len(people)
    return make(
        np.zeros((ticks + 1, 2)),
        people=np.concatenate([xy, xy[-1:]]),
        tracks=np.full((ticks, xy.shape[1], 4), np.nan),
        track_states=np.reshape(np.array(states, float), (-1, 7)),
    )


@pytest.mark.parametrize(
    ("people", "tracks", "switches", "fragmentations", "false", "share", "delay"),
    [
        ([[0.0]] * 4, [{7: 0.1}] * 4, 0, 0, 0.0, 1.0, 0.0),
        ([[0.0]] * 4, [{}, {}, {7: 0.1}, {7: 0.1}], 0, 0, 0.0, 0.5, 0.2),
        ([[0.0]] * 4, [{7: 0.1}, {}, {}, {7: 0.1}], 0, 1, 0.0, 0.5, 0.0),
        ([[0.0]] * 4, [{7: 0.1}, {7: 0.1}, {}, {8: 0.1}], 1, 1, 0.0, 0.75, 0.0),
        ([[0.0]] * 4, [{7: 5.0}] * 4, 0, 0, 1.0, 0.0, 0.4),  # never tracked: all the time counts
        ([[0.0]] * 4, [{7: 0.5, 8: 0.0}] + [{7: 0.5, 8: 0.6}] * 3, 0, 0, 1.0, 1.0, 0.0),  # keeps 8, though 7 is nearer
        ([[0.0], [None], [0.0], [0.0]], [{7: 0.0}, {}, {8: 0.0}, {8: 0.0}], 0, 0, 0.0, 1.0, 0.0),  # somebody else
        # Two walk past each other, and their tracks change over to the other one.
        ([[0.0, 0.6], [0.2, 0.4], [0.4, 0.2], [1.8, 0.0]], [{1: 0.0, 2: 0.6}, {1: 0.2, 2: 0.4}, {1: 0.2, 2: 0.4},
         {1: 0.0, 2: 1.8}], 2, 0, 0.0, 1.0, 0.0),
    ],
)  # fmt: skip
def test_identities_of_small_cases_by_hand(
    trajectory_through, scenario_with, people, tracks, switches, fragmentations, false, share, delay
):
    found = identity(run_of(trajectory_through, people, tracks), scenario_with(num_people=len(people[0])))
    assert (found.switches, found.fragmentations) == (switches, fragmentations)
    assert (found.false_tracks, found.tracked_share) == (pytest.approx(false), pytest.approx(share))
    assert found.first_track_delay == pytest.approx(delay)


def test_named_tracks_switch_never_and_count_within_the_gate(trajectory_through, scenario_with):
    people = np.zeros((4, 2, 2))
    people[:, 1] = 3.0
    tracks = np.zeros((3, 2, 4))
    tracks[:, 1, :2] = [[3.0, 3.0], [4.5, 3.0], [np.nan, np.nan]]
    trajectory = trajectory_through(np.zeros((4, 2)), people=people, tracks=tracks)
    found = identity(trajectory, scenario_with(num_people=2))
    assert (found.switches, found.fragmentations) == (0, 0)
    assert (found.tracked_share, found.false_tracks) == (pytest.approx(4 / 6), pytest.approx(1 / 3))


def one_tick_after_the_other(people, tracks) -> np.ndarray:
    """CLEAR MOT's pairs: who can keeps the track that it had last, then the most pairs of the least total distance."""
    numbers = np.full(np.shape(people), ABSENT)
    last: dict[int, tuple[int, int]] = {}  # person: number of its track, when it had it
    for k, (places, found) in enumerate(zip(people, tracks, strict=True)):
        present = [i for i, x in enumerate(places) if x is not None]
        last = {i: held for i, held in last.items() if i in present}
        numbers[k, present] = NONE
        pairs: dict[int, int] = {}
        for i in sorted(last, key=lambda i: (last[i][1], i), reverse=True):
            number = last[i][0]
            if number in found and number not in pairs.values() and abs(found[number] - places[i]) <= GATE:
                pairs[i] = number
        free, others = [i for i in present if i not in pairs], [n for n in found if n not in pairs.values()]
        options = [
            [(i, n) for i, n in zip(free, chosen, strict=True) if n is not None and abs(found[n] - places[i]) <= GATE]
            for chosen in permutations([*others, *[None] * len(free)], len(free))
        ]
        cost = [sum(abs(found[n] - places[i]) for i, n in some) + GATE * (len(free) - len(some)) for some in options]
        pairs |= dict(options[int(np.argmin(cost))])
        for i, number in pairs.items():
            numbers[k, i], last[i] = number, (number, k)
    return numbers


def test_the_pairs_are_those_of_clear_mot(trajectory_through, scenario_with):
    rng = np.random.default_rng(5)  # no two distances are equal, so that nothing is left to choice
    for _ in range(60):
        places = iter(rng.uniform(0.0, 1.6, 1000) + 1j * rng.uniform(0.0, 1.6, 1000))
        people = [[next(places) if rng.random() < 0.85 else None for _ in range(3)] for _ in range(8)]
        tracks = [{int(n): next(places) for n in rng.permutation(5)[: rng.integers(0, 4)]} for _ in range(8)]
        trajectory = run_of(trajectory_through, people, tracks)
        found = track_numbers(trajectory, scenario_with(num_people=3))
        assert found.tolist() == one_tick_after_the_other(people, tracks).tolist()


def test_no_people_and_no_belief_have_none(trajectory_through, scenario_with):
    assert identity(trajectory_through([[0, 0], [1, 0]]), scenario_with()) is None
    blind = trajectory_through([[0, 0], [1, 0]], people=np.zeros((2, 1, 2)), estimate=np.full((1, 3), np.nan))
    assert identity(blind, scenario_with(num_people=1)) is None
