"""How good each belief of a run was, body by body, as inspection and pages name them."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics import consistency
from mjnav.scenarios.spec import Scenario


@dataclass(frozen=True, slots=True)
class JudgedBelief:
    """The belief about one body; figures are None where there is none, or where they are infinite."""

    body: str  # "robot", "person0"
    by: str  # what it goes by, and the filter: "pose, particle"
    ticks: int  # with a belief
    rmse_m: float | None
    nees: float | None
    nees_interval: tuple[float, float] | None  # of the mean of as many independent errors, with probability 0.95
    coverage: float | None
    divergences: int
    ess_min: float | None
    ess_mean: float | None
    depleted_share: float | None


def judged_beliefs(trajectory: Trajectory, scenario: Scenario) -> list[JudgedBelief]:
    """The robot's, then each person's: where tracks carry no name, of the tracks that figures take for the person's."""
    robot, people = scenario.estimation.robot, scenario.estimation.obstacles
    found = [
        _judged(
            "robot",
            _by(robot.source, robot.filter, robot.localizer),
            consistency.consistency(consistency.robot_nees(trajectory), 3, trajectory.time),
            consistency.robot_error(trajectory),
            trajectory.robot_ess,
            consistency.robot_particles(trajectory, scenario),
        )
    ]
    errors, nees = consistency.track_error(trajectory), consistency.people_nees(trajectory)
    particles = np.full(len(trajectory.status), float(people.particles))
    found += [
        _judged(
            f"person{i}",
            _by(people.source, people.filter, people.tracker),
            consistency.consistency(nees[:, i], 4, trajectory.time),
            errors[:, i],
            trajectory.people_ess[:, i],
            particles,
        )
        for i in range(errors.shape[1])
    ]
    return found


def _by(source: str, kind: str, own: object) -> str:
    if own is not None:
        return str(getattr(own, "name", own))
    return source if source == "direct" else f"{source}, {kind}"


def _judged(
    body: str, by: str, found: consistency.Consistency, error: Array, ess: Array, particles: Array
) -> JudgedBelief:
    squared = (error[:, :2] ** 2).sum(axis=1)
    squared = squared[np.isfinite(squared)]
    return JudgedBelief(
        body=body,
        by=by,
        ticks=found.ticks,
        rmse_m=float(np.sqrt(squared.mean())) if squared.size else None,
        nees=found.nees if found.nees is not None and isfinite(found.nees) else None,
        nees_interval=found.nees_interval,
        coverage=found.coverage,
        divergences=found.divergences,
        ess_min=consistency.least(ess),
        ess_mean=consistency.mean(ess),
        depleted_share=consistency.depleted_share(ess, particles),
    )
