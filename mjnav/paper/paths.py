"""The degree of the kernel (figure 5): the ways past one obstacle, and the distributions that the degrees leave.

The distributions are those of the closest obstacle at the decision of each run at which the fewest of its samples were
safe: where the method had most to do. The claims are judged by `degree`, on many seeds of the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.loop.episode import Episode
from mjnav.messages import Array, ConeDistribution, TickRecord
from mjnav.paper.degree import VARIANTS
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.item import MeasuredItem, Progress
from mjnav.paper.style import BLUE, GREY, INK, ORANGE, PALE, TWO_COLUMNS, UNSAFE, color, new_figure, style
from mjnav.scenarios.load import with_seed
from mjnav.scenarios.spec import Scenario

BINS = 30


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
class Ways:
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


def measure(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> Ways:
    """Runs every variant under the seeds of the first scenario."""
    scenario, num_seeds = scenarios[0], 3 if quick else 20
    ways: list[Way] = []
    for variant, (degree, weight) in VARIANTS.items():
        parameters = {**scenario.control.parameters, "degree": degree, "weight": weight}
        of_variant = replace(scenario, control=replace(scenario.control, method="rkhs", parameters=parameters))
        for seed in range(scenario.seed, scenario.seed + num_seeds):
            ways.append(_way(variant, with_seed(of_variant, seed)))
            progress(len(ways), num_seeds * len(VARIANTS))
    return Ways(scenario.name, tuple(ways))


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


def picture(data: Ways) -> Figure:
    """A column a variant: ways of all seeds, distributions of all seeds together, the share that is safe."""
    with style():
        fig = new_figure(TWO_COLUMNS, 3.6)
        panels = fig.subplots(3, len(VARIANTS), height_ratios=(1.6, 1.2, 0.25), sharex="row", sharey="row")
        samples = np.concatenate([part for way in data.ways for part in (way.samples, way.desired)])
        edges = np.linspace(samples.min(), samples.max(), BINS + 1)
        for column, variant in zip(panels.T, VARIANTS, strict=True):
            ways = data.of(variant)
            _ways(column[0], ways, color(variant))
            column[0].set_title(f"{variant}, λ = {VARIANTS[variant][1]:.2g}")
            _distributions(column[1], ways, edges)
            _share(column[2], float(np.mean([way.safe_share for way in ways])))
        panels[0, 0].set_ylabel("y [m]")
        panels[1, 0].set_ylabel("share of samples")
        handles, labels = panels[1, 0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=3)
    return fig


def _ways(axes: Axes, ways: list[Way], shade: str) -> None:
    for way in ways:
        for person in range(way.people.shape[1]):
            axes.plot(*way.people[:, person].T, color=ORANGE, linewidth=0.6, alpha=0.4)
        axes.plot(*way.path.T, color=shade, linewidth=0.7, alpha=0.7)
    axes.axhline(0.0, color=GREY, linewidth=0.5, linestyle=":")
    axes.set(ylim=(-2.0, 2.0), xlabel="x [m]")


def _distributions(axes: Axes, ways: list[Way], edges: Array) -> None:
    current, desired = (
        np.concatenate([part for way in ways for part in ([way.samples], [way.desired])[which]]) for which in (0, 1)
    )
    axes.axvspan(0.0, edges[-1], color=UNSAFE, alpha=0.08, linewidth=0.0)
    axes.stairs(_shares(current, edges), edges, fill=True, color=BLUE, alpha=0.5, label="current")
    axes.stairs(_shares(desired, edges), edges, color=INK, label="desired")
    axes.set(yscale="log", ylim=(1e-3, 1.0), xlabel="f / R²")


def _shares(samples: Array, edges: Array) -> Array:
    return np.histogram(samples, edges)[0] / max(1, samples.size)


def _share(axes: Axes, share: float) -> None:
    axes.barh(0, 1.0, color=PALE)
    axes.barh(0, share, color=BLUE)
    axes.annotate(f"{100.0 * share:.1f} %", (0.5, 0), ha="center", va="center", fontsize=6.0)
    axes.set(xlim=(0.0, 1.0), xticks=(0.0, 0.5, 1.0), yticks=[], xlabel="safe, least of a run")


ITEM = MeasuredItem(
    title="The degree of the kernel: ways and distributions",
    scenes=("crossing1",),
    overrides=options({**DIRECT, "physics.engine": "kinematic"}),
    measure=measure,
    claims=lambda data: (),
    picture=picture,
)
