"""The paper's moments among five moving people: what matching does to the samples of the closest one.

At every decision the samples of f for the closest person in reach are looked at under three controls: what the goal
alone would choose, the nominal control (the constraints at the mean), and what matching chose. A decision matters
where the first and the last differ. The first run is drawn at the hardest five of those: under the goal's control the
fewest samples would be safe, at least 0.7 s apart, once velocities are known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.control.base import MatchingController
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller
from mjnav.messages import Array, ObstacleSamples, TickRecord
from mjnav.metrics.intervals import wilson
from mjnav.paper.by_run import mean_by_run
from mjnav.paper.contrast import shown
from mjnav.paper.finding import Claim, Finding, Measured, judge
from mjnav.scenarios.spec import Scenario
from mjnav.study.compare.compare import Difference

CONTROLS = ("goal alone", "nominal", "matched")
GOAL, NOMINAL, MATCHED = range(len(CONTROLS))
COLLISION = "collision"  # how a run ends that hit something
ALL_SAFE = 0.99  # share of samples that counts as all of them
NUM_SNAPSHOTS, GAP = 5, 0.7  # [s] between two of them
SETTLED = 1.0  # [s] before which nothing is drawn: velocities are still guesses
SOURCE = "the snapshots with five moving obstacles"


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One decision, and what it was made of."""

    time: float  # [s]
    pose: Array  # (3,) of the robot, in truth
    samples: Array  # (N, 3) of it, at the moment of effect
    trail: Array  # (t, 2) where it has been
    people: Array  # (P, 4) x, y, vx, vy in truth
    people_samples: tuple[ObstacleSamples, ...]  # of each, at the moment of effect
    closest: int  # whose samples these are:
    f: tuple[Array, ...]  # of each of CONTROLS, (n,) each, safe where <= 0
    desired: Array  # (m,)
    controls: Array  # (3, 2) v, omega of CONTROLS


@dataclass(frozen=True, slots=True)
class SnapshotsData:
    """The run that is drawn, and the safe shares of all runs; n decisions in reach of somebody."""

    scene: str
    seed: int
    goal: Array  # (2,)
    radius: float  # [m] of the robot
    clip: float  # no sample counts as safer
    outcome: tuple[str, ...]  # of every run
    snapshots: tuple[Snapshot, ...]
    run: NDArray[np.int64]  # (n,) the first is drawn
    time: Array  # (n,) [s]
    closest: Array  # (n,) which person
    share: Array  # (n, 3) of the closest person's samples that are safe under each of CONTROLS
    matters: NDArray[np.bool_]  # (n,) whether the goal alone would choose another control

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision."""
        found = []
        for run, time, closest, share, matters in zip(
            self.run, self.time, self.closest, self.share, self.matters, strict=True
        ):
            row = {"run": int(run), "time_s": float(time), "closest": f"person{closest}", "matters": bool(matters)}
            found.append(
                row | {f"safe_{name.replace(' ', '_')}": float(s) for name, s in zip(CONTROLS, share, strict=True)}
            )
        return found


def measure(
    scenarios: Sequence[Scenario],
    *,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SnapshotsData:
    """From runs of every scenario, from its seed on; the first run is drawn.

    Raises InvalidValue for a method that does not match distributions, and where nobody comes into reach.
    """
    num_seeds = 2 if quick else 30
    runs = [replace(scenario, seed=scenario.seed + k) for scenario in scenarios for k in range(num_seeds)]
    for scenario in scenarios:
        _controller(scenario)
    watches, outcomes = [], []
    for done, scenario in enumerate(runs):
        watch = _Watch(scenario, keep=done == 0)
        outcomes.append(Episode(scenario, watch=watch).run().summary["outcome"])
        watches.append(watch)
        progress(done + 1, len(runs))
    columns = [np.array([row for watch in watches for row in getattr(watch, key)]) for key in _Watch.COLUMNS]
    first = runs[0]
    if not watches[0].time:
        raise InvalidValue("scenarios", first.name, "one in which people come into reach")
    return SnapshotsData(
        scene=first.name,
        seed=first.seed,
        goal=np.array(first.robot.route[-1]),
        radius=first.robot.radius,
        clip=_controller(first).parameters.clip,
        outcome=tuple(outcomes),
        snapshots=watches[0].snapshots(),
        run=np.repeat(np.arange(len(runs)), [len(watch.time) for watch in watches]),
        **dict(zip(_Watch.COLUMNS, columns, strict=True)),
    )


def _controller(scenario: Scenario) -> MatchingController[Any]:
    controller = build_controller(scenario)
    if not isinstance(controller, MatchingController):
        raise InvalidValue(
            "control.method", scenario.control.method, "one that matches distributions: rkhs, rkhs-paper"
        )
    return controller


class _Watch:
    """Looks at every decision of a run; `keep` keeps what a drawing needs."""

    COLUMNS = ("time", "closest", "share", "matters")

    def __init__(self, scenario: Scenario, *, keep: bool):
        self._controller = _controller(scenario)
        self._num_people, self._keep = len(scenario.people), keep
        self._trail: list[Array] = []
        self._kept: list[Snapshot] = []
        self.time: list[float] = []
        self.closest: list[int] = []
        self.share: list[Array] = []
        self.matters: list[bool] = []

    def __call__(self, record: TickRecord) -> None:
        """One more tick."""
        self._trail.append(record.truth.robot_pose[:2])
        observation, costs = record.observation, record.decision.costs
        problem = self._controller.problem(observation)
        block = next((b for b, j in enumerate(problem.reach.discs) if j < self._num_people), None)
        if block is None or costs is None:
            return
        which = [int(np.argmin(costs.goal)), costs.nominal, int(np.argmin(costs.total))]
        f = problem.cone.samples(block, costs.v[which], costs.omega[which])
        self.time.append(record.truth.time)
        self.closest.append(problem.reach.discs[block])
        self.share.append((f <= 0.0).mean(axis=0))
        self.matters.append(which[GOAL] != which[MATCHED])
        if self._keep:
            people = np.concatenate([record.truth.people_position, record.truth.people_velocity], axis=1)
            self._kept.append(
                Snapshot(
                    time=record.truth.time,
                    pose=record.truth.robot_pose,
                    samples=observation.robot_pose,
                    trail=np.array(self._trail),
                    people=people,
                    people_samples=observation.obstacles[: self._num_people],
                    closest=self.closest[-1],
                    f=tuple(f.T),
                    desired=self._controller.desired_cone(problem, block),
                    controls=np.stack([costs.v[which], costs.omega[which]], axis=1),
                )
            )

    def snapshots(self) -> tuple[Snapshot, ...]:
        """The hardest decisions in order of time: fewest samples safe under the goal's control, GAP apart."""
        share, chosen = np.array(self.share).reshape(-1, len(CONTROLS)), []
        for i in np.argsort(np.where(self.matters, share[:, GOAL], np.inf), kind="stable").tolist():
            apart = all(abs(self.time[i] - self.time[j]) >= GAP - 1e-9 for j in chosen)
            if self.matters[i] and self.time[i] >= SETTLED and apart and len(chosen) < NUM_SNAPSHOTS:
                chosen.append(i)
        return tuple(self._kept[i] for i in sorted(chosen))


def findings(data: SnapshotsData) -> tuple[Finding, ...]:
    """Whether matching leaves the samples safe, and whether it moves them there."""
    share, run = data.share[data.matters], data.run[data.matters]
    if not len(share):
        return ()

    def mean_of(values: ArrayLike, use: str, boundary: float = 0.0) -> Difference:
        return mean_by_run(run, 100.0 * np.asarray(values), data.seed, f"snapshots.{use}", boundary=boundary)

    num_runs, matched = len(data.outcome), share[:, MATCHED]
    safe, mean = mean_of(matched >= ALL_SAFE, "safe", 50.0), mean_of(matched, "mean").estimate
    least = np.median([matched[run == one].min() for one in np.unique(run)])
    hits = sum(outcome == COLLISION for outcome in data.outcome)
    low, high = wilson(hits, num_runs) or (0.0, 1.0)
    count = f"{len(share)} decisions of {num_runs} runs in which the closest person mattered"
    gains = [mean_of(matched - share[:, other], CONTROLS[other]) for other in (GOAL, NOMINAL)]
    texts = [
        f"{shown(gain.estimate, 'points', signed=True)} against the {name}"
        for gain, name in zip(gains, ("control that the goal alone would choose", "nominal control"), strict=True)
    ]
    return judge([
        Claim(
            "With matched distributions the closest obstacle's samples are free of collision more often than not.",
            SOURCE,
            [Measured(safe.estimate.value > 50.0, safe.p)],
            f"At least {100 * ALL_SAFE:g} % of the samples are safe in {shown(safe.estimate, '%')} of {count}. On "
            f"average {shown(mean, '%')} are, at a run's worst moment {100 * least:.0f} % (median). Of {num_runs} runs "
            f"{hits} [{num_runs * low:.1f}, {num_runs * high:.1f}] ended in a collision.",
        ),
        Claim(
            "Matching moves the distribution of the collision cone towards the one that is free of collision.",
            SOURCE,
            [Measured(gain.estimate.value > 0.0, gain.p) for gain in gains],
            f"Safe samples of the closest person, within one decision: {'; '.join(texts)} ({count}).",
        ),
    ])  # fmt: skip
