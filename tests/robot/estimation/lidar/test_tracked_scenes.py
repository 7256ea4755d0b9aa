"""Tracks by the lidar's scans in scenes: what the robot has, not what a test hands over."""

import numpy as np
import pytest

import mjnav

QUICK = ["physics.engine=kinematic", "estimation.obstacles.source=lidar", "stop_on_collision=false"]
INSIDE = 5.991  # chi-square of two degrees of freedom, 95 %


def simulation(scene, seed, *more):
    return mjnav.Simulation(mjnav.load_scenario(scene, [*QUICK, *more]), seed=seed)


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
