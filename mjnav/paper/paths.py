"""The ablation's pictures: the ways that the degrees take past one obstacle, and the distributions that they leave.

The distributions are those of the closest obstacle at the decision of each run at which the fewest of its samples were
safe: where the method had most to do, after it was done.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.loop.episode import Episode
from mjnav.messages import Array, ConeDistribution, TickRecord
from mjnav.paper.finding import Finding
from mjnav.scenarios.spec import Scenario

# label -> degree and weight: one weight for all, then weights that make the mean's term weigh alike
VARIANTS: Mapping[str, tuple[int, float]] = MappingProxyType(
    {"d=1": (1, 1.0), "d=2": (2, 1.0), "d=3": (3, 1.0), "d=2 matched": (2, 1.0 / 2.0), "d=3 matched": (3, 1.0 / 3.0)}
)


@dataclass(frozen=True, slots=True)
class Way:
    """One run."""

    variant: str
    seed: int
    path: Array  # (T + 1, 2) of the robot
    people: Array  # (T + 1, P, 2)
    samples: Array  # (n,) of f at its hardest decision, safe where <= 0
    desired: Array  # (m,)
    safe_share: float  # of the samples, eta as it was reached

    @property
    def deviation(self) -> float:
        """Greatest distance from the x axis, which the goal lies on [m]."""
        return float(np.abs(self.path[:, 1]).max())


@dataclass(frozen=True, slots=True)
class PathsData:
    """Every run of every variant."""

    scene: str
    ways: tuple[Way, ...]

    def rows(self) -> list[dict[str, Any]]:
        """One for every run."""
        return [
            {"variant": w.variant, "seed": w.seed, "least_safe_share": w.safe_share, "max_deviation_m": w.deviation}
            for w in self.ways
        ]

    def of(self, variant: str) -> list[Way]:
        """The runs of one variant."""
        return [way for way in self.ways if way.variant == variant]


def measure(
    scenarios: Sequence[Scenario],
    *,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> PathsData:
    """Runs every variant under the seeds of the first scenario."""
    scenario, num_seeds = scenarios[0], 3 if quick else 20
    ways: list[Way] = []
    for variant, (degree, weight) in VARIANTS.items():
        parameters = {**scenario.control.parameters, "degree": degree, "weight": weight}
        of_variant = replace(scenario, control=replace(scenario.control, method="rkhs", parameters=parameters))
        for seed in range(scenario.seed, scenario.seed + num_seeds):
            ways.append(_way(variant, replace(of_variant, seed=seed)))
            progress(len(ways), num_seeds * len(VARIANTS))
    return PathsData(scenario.name, tuple(ways))


def _way(variant: str, scenario: Scenario) -> Way:
    hardest: list[ConeDistribution] = []

    def watch(record: TickRecord) -> None:
        cone = record.cone
        if cone is not None and (not hardest or cone.safe_share < hardest[0].safe_share):
            hardest[:] = [cone]

    trajectory = Episode(scenario, watch=watch, cones=True).run().trajectory
    samples, desired = (hardest[0].samples, hardest[0].desired) if hardest else (np.empty(0), np.empty(0))
    share = hardest[0].safe_share if hardest else 1.0
    return Way(
        variant, scenario.seed, trajectory.robot_pose[:, :2], trajectory.people_position, samples, desired, share
    )


def findings(data: PathsData) -> tuple[Finding, ...]:
    """None of its own: `degree` judges many seeds of the same."""
    return ()
