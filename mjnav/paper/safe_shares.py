"""What a matching controller does to the closest person's samples, decision by decision, over runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.base import MatchingController
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.prepare import build_controller
from mjnav.messages import Array, ObstacleSamples, TickRecord
from mjnav.paper.item import Progress
from mjnav.scenarios.load import with_seed
from mjnav.scenarios.spec import Scenario

CONTROLS = ("goal alone", "nominal", "matched")
GOAL, NOMINAL, MATCHED = range(len(CONTROLS))
NUM_SNAPSHOTS, GAP = 5, 0.7  # [s] between two of them
SETTLED = 1.0  # [s] before which nothing is drawn: velocities are still guesses


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One decision, and what it was based on."""

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
    matters: bool  # whether the goal alone would choose another control

    @property
    def share(self) -> Array:
        """Of the closest person's samples, those that are safe under each of CONTROLS, (3,)."""
        return np.array([(f <= 0.0).mean() for f in self.f])


@dataclass(frozen=True, slots=True)
class Decisions:
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
    share: Array  # (n, 3) as in Snapshot
    matters: NDArray[np.bool_]  # (n,)

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision."""
        columns = zip(self.run.tolist(), self.time.tolist(), self.closest, self.matters.tolist(), strict=True)
        return [
            {"run": run, "time_s": time, "closest": f"person{closest}", "matters": matters}
            | {f"safe_{name.replace(' ', '_')}": float(s) for name, s in zip(CONTROLS, share, strict=True)}
            for (run, time, closest, matters), share in zip(columns, self.share, strict=True)
        ]


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> Decisions:
    """From runs of every scenario, from its seed on; the first run is drawn.

    Raises InvalidValue for a method that does not match distributions, and where nobody comes into reach.
    """
    num_seeds = 2 if quick else 30
    runs = [with_seed(scenario, scenario.seed + k) for scenario in scenarios for k in range(num_seeds)]
    controllers = [_controller(scenario) for scenario in runs]
    first, drawn = runs[0], ()
    outcomes: list[str] = []
    rows: list[tuple[int, float, int, Array, bool]] = []
    for scenario, controller in zip(runs, controllers, strict=True):
        outcome, decisions = _watched(scenario, controller)
        rows += [(len(outcomes), s.time, s.closest, s.share, s.matters) for s in decisions]
        drawn = drawn if outcomes else _hardest(decisions)
        outcomes.append(outcome)
        if not rows:
            raise InvalidValue("scenarios", first.name, "one in which people come into reach")
        progress(len(outcomes), len(runs))
    run, time, closest, share, matters = (np.array(column) for column in zip(*rows, strict=True))
    return Decisions(
        scene=first.name, seed=first.seed, goal=np.array(first.robot.route[-1]), radius=first.robot.radius,
        clip=controllers[0].parameters.clip, outcome=tuple(outcomes), snapshots=drawn, run=run, time=time,
        closest=closest, share=share, matters=matters,
    )  # fmt: skip


def _controller(scenario: Scenario) -> MatchingController[Any]:
    controller = build_controller(scenario)
    if not isinstance(controller, MatchingController):
        raise InvalidValue(
            "control.method", scenario.control.method, "one that matches distributions: rkhs, rkhs-paper"
        )
    return controller


def _watched(scenario: Scenario, controller: MatchingController[Any]) -> tuple[str, list[Snapshot]]:
    """A run's outcome, and its decisions with somebody in reach."""
    trail: list[Array] = []
    found: list[Snapshot] = []

    def watch(record: TickRecord) -> None:
        truth, observation, costs = record.truth, record.seen, record.decision.costs
        trail.append(truth.robot_pose[:2])
        problem = controller.problem(observation)
        block = next((b for b, j in enumerate(problem.reach.discs) if j < len(scenario.people)), None)
        if block is None or costs is None:
            return
        which = [int(np.argmin(costs.goal)), costs.nominal, int(np.argmin(costs.total))]
        found.append(
            Snapshot(
                time=truth.time,
                pose=truth.robot_pose,
                samples=observation.robot_pose,
                trail=np.array(trail),
                people=np.concatenate([truth.people_position, truth.people_velocity], axis=1),
                people_samples=observation.obstacles[: len(scenario.people)],
                closest=problem.reach.discs[block],
                f=tuple(problem.cone.samples(block, costs.v[which], costs.omega[which]).T),
                desired=controller.desired_cone(problem, block),
                controls=np.stack([costs.v[which], costs.omega[which]], axis=1),
                matters=which[GOAL] != which[MATCHED],
            )
        )

    return Episode(scenario, watch=watch).run().summary["outcome"], found


def _hardest(decisions: Sequence[Snapshot]) -> tuple[Snapshot, ...]:
    """Those with the fewest samples safe under the goal's control, GAP apart, in order of time."""
    chosen: list[Snapshot] = []
    candidates = [s for s in decisions if s.matters and s.time >= SETTLED]
    for s in sorted(candidates, key=lambda s: s.share[GOAL]):
        if len(chosen) < NUM_SNAPSHOTS and all(abs(s.time - other.time) >= GAP - 1e-9 for other in chosen):
            chosen.append(s)
    return tuple(sorted(chosen, key=lambda s: s.time))
