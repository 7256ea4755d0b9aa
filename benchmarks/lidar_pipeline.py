"""What a tick of the whole lidar pipeline costs: pose, detections and tracks, by beams, particles and people.

    uv run python benchmarks/lidar_pipeline.py --ticks 100

A room of 14 x 10 m with two pillars, in which people walk back and forth; the robot stands. Each row is CPU time of one
reading with a new scan, in ms: the median and the 99 % quantile of the localiser and of the tracker, and of both, as a
ratio to the likelihood of 500 particles and 60 beams, which is measured in the same run.
"""

import argparse
from dataclasses import replace
from time import process_time

import numpy as np

from mjnav.loop.prepare import load_scenario
from mjnav.robot.estimation import make_localizer, make_tracker
from mjnav.robot.estimation.base import assumed_noise
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.scene.spec import Person, Scenario, Waypoints
from mjnav.scene.ways import floor_of_lidar
from mjnav.world.simulator import Simulator

# beams, particles of the pose, particles of each person, people; the second row is the budget's
ROWS = (
    (180, 500, 200, 5),
    (360, 500, 200, 5),
    (720, 500, 200, 5),
    (360, 200, 200, 5),
    (360, 2000, 200, 5),
    (360, 500, 100, 5),
    (360, 500, 1000, 5),
    (360, 500, 200, 0),
    (360, 500, 200, 10),
    (360, 500, 200, 20),
)
WARM_UP = 10  # ticks


def room(beams: int, particles: int, tracked: int, num_people: int) -> Scenario:
    """The room, with a lidar of so many beams at once at each reading."""
    corners = [(-7.0, -5.0), (7.0, -5.0), (7.0, 5.0), (-7.0, 5.0)]
    walls = [f"{{from={list(a)},to={list(b)}}}" for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    scenario = load_scenario(
        "hall",
        [
            "physics.engine=kinematic",
            "robot.start=[0.0,0.0,0.0]",
            "robot.goal=[5.0,0.0]",
            f"walls=[{','.join(walls)}]",
            "tables=[]",
            "people=[]",
            "pillars=[{position=[2.0,2.0]},{position=[-3.0,-2.0]}]",
            f"sensors.lidar_beams={beams}",
            "estimation.robot.source=lidar",
            f"estimation.robot.particles={particles}",
            "estimation.obstacles.source=lidar",
            f"estimation.obstacles.particles={tracked}",
        ],
    )
    angles = 2.0 * np.pi * np.arange(num_people) / max(num_people, 1) + 0.2
    people = tuple(
        Person(
            start=(3.0 * np.cos(a), 3.0 * np.sin(a)),
            behaviour=Waypoints(((4.2 * np.cos(a), 4.2 * np.sin(a)), (2.0 * np.cos(a), 2.0 * np.sin(a))), speed=0.5),
        )
        for a in angles.tolist()
    )
    return replace(scenario, people=people)


def measured(scenario: Scenario, ticks: int) -> tuple[np.ndarray, np.ndarray]:
    """CPU times of localiser and tracker, (ticks,) each [ms]."""
    world = Simulator(scenario, 0)
    localizer, tracker = make_localizer(scenario, 0), make_tracker(scenario, 0)
    poses, tracks = [], []
    for _ in range(WARM_UP + ticks):
        for reading in world.sense():
            start = process_time()
            belief = localizer.update(reading)
            between = process_time()
            tracker.update(reading, belief)
            poses.append(between - start)
            tracks.append(process_time() - between)
        world.advance(0.1, (0.0, 0.0))
    return 1e3 * np.array(poses[WARM_UP:]), 1e3 * np.array(tracks[WARM_UP:])


def reference(scenario: Scenario) -> float:
    """CPU time of the likelihood of 500 particles and 60 beams [ms]."""
    field = LikelihoodField.of(
        floor_of_lidar(scenario), scenario.sensors.scanner, assumed_noise(scenario)["lidar.range"]
    )
    rng = np.random.default_rng(0)
    beams = field.beams(rng.normal(size=(360, 2)) * 3.0, 60)
    poses, times = rng.normal(size=(500, 3)) * 0.05, []
    for _ in range(50):
        start = process_time()
        field.log_ratio(poses, beams)
        times.append(process_time() - start)
    return 1e3 * float(np.median(times[10:]))


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--ticks", type=int, default=100, help="readings in each row")
    ticks = parser.parse_args().ticks
    unit = reference(room(*ROWS[0]))
    print(f"likelihood of 500 particles, 60 beams: {unit:.3f} ms")
    print("beams  particles  of a person  people    pose p50   p99   tracks p50   p99    both p50   p99   ratio")
    for row in ROWS:
        pose, tracks = measured(room(*row), ticks)
        cells = "".join(
            f"{np.median(part):12.2f}{np.quantile(part, 0.99):6.2f}" for part in (pose, tracks, pose + tracks)
        )
        beams, particles, tracked, people = row
        print(
            f"{beams:5d}{particles:11d}{tracked:13d}{people:8d}{cells}{np.median(pose + tracks) / unit:8.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
