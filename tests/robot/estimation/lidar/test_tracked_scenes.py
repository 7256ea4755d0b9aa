"""Tracks by the lidar's scans in scenes: what the robot has, not what a test hands over."""

import numpy as np
import pytest

import mjnav

QUICK = ["physics.engine=kinematic", "estimation.obstacles.source=lidar", "stop_on_collision=false"]
INSIDE = 5.991  # chi-square of two degrees of freedom, 95 %


def simulation(scene, seed, *more):
    return mjnav.Simulation(mjnav.load_scenario(scene, [*QUICK, *more]), seed=seed)


def nearest(tracks, position):
    return min(tracks, key=lambda track: np.hypot(*(track.mean[:2] - position)))


@pytest.mark.parametrize(("scene", "ticks", "speed"), [("hall", 80, 0.4), ("corridor12", 60, 1.2)])
def test_the_truth_lies_in_the_95_percent_regions_of_people_who_are_seen(scene, ticks, speed):
    inside = []
    for seed in (1, 2):
        with simulation(scene, seed) as run:
            for k in range(ticks):
                tracks, places = run.beliefs.people, run.truth.people_position
                seen = [track for track in tracks if track.unseen == 0.0 and track.age > 0.5]
                for track in seen if k >= 10 else ():
                    error = places - track.mean[:2]
                    error = error[np.nanargmin(np.hypot(*error.T))]
                    inside.append(error @ np.linalg.solve(track.covariance[:2, :2], error) < INSIDE)
                run.step(speed, 0.0)
    assert len(inside) > 200
    assert 0.90 <= np.mean(inside) <= 0.995


def test_a_copy_goes_on_with_the_same_tracks_and_a_restored_run_as_well():
    with simulation("crossing3", 1) as run:
        for _ in range(15):
            run.step(run.decide())
        twin, before = run.copy(), run.copy()
        rows = []
        for one in (run, twin):
            for _ in range(8):
                one.step(one.decide())
            rows.append(one.beliefs.people)
        run.restore(before)
        for _ in range(8):
            run.step(run.decide())
        rows.append(run.beliefs.people)
    assert rows[0]
    for row in rows[1:]:
        assert [track.name for track in row] == [track.name for track in rows[0]]
        for track, expected in zip(row, rows[0], strict=True):
            assert np.array_equal(track.particles, expected.particles)
