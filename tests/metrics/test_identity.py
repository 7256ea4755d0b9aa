"""Who keeps a track: small exact cases, and CLEAR MOT's rule applied one tick after the other."""

from itertools import permutations

import numpy as np
import pytest

from mjnav.metrics.tracking import ABSENT, GATE, NONE, identity, track_numbers


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
def test_small_cases_by_hand(
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
