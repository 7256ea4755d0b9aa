"""What matching does to the samples of the closest of five people (figure 4).

At every decision the samples of f for the closest person in reach are computed under three controls: the one that the
goal alone would choose, the nominal control (the constraints at the mean), and the one that matching chose. A decision
matters where the first and the last differ. The first run is drawn at five hard decisions: those with the fewest safe
samples under the goal's control, at least 0.7 s apart, once velocities are known.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mjnav.control.base import MatchingController
from mjnav.loop.episode import Episode
from mjnav.messages import Array, TickRecord
from mjnav.motion.unicycle import integrate
from mjnav.paper import draw
from mjnav.paper.claims import Claim, Measured, MeasuredItem, Progress, mean_by_run, shown
from mjnav.paper.episodes import DIRECT
from mjnav.robot.controller import build_controller
from mjnav.scene.load import with_seed
from mjnav.scene.spec import Scenario

BINS = 30

SOURCE = "figure 4, section V-B"
CONTROLS = ("goal alone", "nominal", "matched")
GOAL, NOMINAL, MATCHED = range(len(CONTROLS))
COLOURS = (draw.VERMILION, draw.GREY, draw.BLUE)  # of CONTROLS
NUM_SNAPSHOTS, GAP = 5, 0.7  # [s] between two of them
SETTLED = 1.0  # [s] before which nothing is drawn: velocities are still guesses
ALL_SAFE = 0.99  # share of samples that counts as all of them
VIEW = 3.0  # [m] from the middle of a map to its edges
AHEAD = 1.5  # [s] of the control that is drawn


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One decision, and the samples of the closest person under each of CONTROLS."""

    run: int
    record: TickRecord
    closest: int
    f: tuple[Array, ...]  # (n,) each, safe where <= 0
    desired: Array  # (m,)
    controls: Array  # (3, 2) v, omega
    matters: bool  # whether the goal alone would choose another control

    @property
    def time(self) -> float:
        """Of the decision [s]."""
        return self.record.truth.time

    @property
    def share(self) -> Array:
        """Of the samples those that are safe under each of CONTROLS, (3,)."""
        return np.array([(f <= 0.0).mean() for f in self.f])


@dataclass(frozen=True, slots=True)
class Snapshots:
    """All decisions in reach of somebody, in the order of the runs."""

    scenario: Scenario  # of the first run
    outcomes: tuple[str, ...]  # of every run
    decisions: tuple[Snapshot, ...]

    def rows(self) -> list[dict[str, Any]]:
        """One for every decision."""
        return [
            {"run": s.run, "time_s": s.time, "closest": f"person{s.closest}", "matters": s.matters}
            | {f"safe_{name.replace(' ', '_')}": float(x) for name, x in zip(CONTROLS, s.share, strict=True)}
            for s in self.decisions
        ]

    def hardest(self) -> list[Snapshot]:
        """Of the first run those with the fewest samples safe under the goal's control, GAP apart, in order of time."""
        chosen: list[Snapshot] = []
        candidates = [s for s in self.decisions if s.run == 0 and s.matters and s.time >= SETTLED]
        for s in sorted(candidates, key=lambda s: s.share[GOAL]):
            if len(chosen) < NUM_SNAPSHOTS and all(abs(s.time - other.time) >= GAP - 1e-9 for other in chosen):
                chosen.append(s)
        return sorted(chosen, key=lambda s: s.time)


def measure_snapshots(scenarios: Sequence[Scenario], quick: bool, progress: Progress) -> Snapshots:
    """From runs of the first scenario, whose method matches distributions, from its seed on."""
    num_runs = 2 if quick else 30
    controller = build_controller(scenarios[0])
    assert isinstance(controller, MatchingController)
    decisions: list[Snapshot] = []
    outcomes: list[str] = []
    for run in range(num_runs):
        scenario, records = with_seed(scenarios[0], scenarios[0].seed + run), []
        outcomes.append(Episode(scenario, watch=records.append).run().summary["outcome"])
        snapshots = (_snapshot(run, record, controller, len(scenario.people)) for record in records)
        decisions += [snapshot for snapshot in snapshots if snapshot is not None]
        progress(run + 1, num_runs)
    return Snapshots(scenarios[0], tuple(outcomes), tuple(decisions))


def _snapshot(run: int, record: TickRecord, controller: MatchingController[Any], num_people: int) -> Snapshot | None:
    """A decision; None with nobody in reach."""
    problem, costs = controller.problem(record.seen), record.decision.costs
    block = next((b for b, j in enumerate(problem.reach.discs) if j < num_people), None)
    if block is None or costs is None:
        return None
    which = [int(np.argmin(costs.goal)), costs.nominal, int(np.argmin(costs.total))]
    f = tuple(problem.cone.samples(block, costs.v[which], costs.omega[which]).T)
    controls = np.stack([costs.v[which], costs.omega[which]], axis=1)
    desired, closest = controller.desired_cone(problem, block), problem.reach.discs[block]
    return Snapshot(run, record, closest, f, desired, controls, which[GOAL] != which[MATCHED])


def snapshot_claims(data: Snapshots) -> Iterator[Claim]:
    """Whether matching leaves the samples safe, and whether it moves them there."""
    decisions = [s for s in data.decisions if s.matters]
    if not decisions:
        return
    share, run = np.array([s.share for s in decisions]), [s.run for s in decisions]
    matched, seed = share[:, MATCHED], data.scenario.seed
    safe = mean_by_run(run, 100.0 * (matched >= ALL_SAFE), seed, "snapshots.safe", boundary=50.0)
    num_runs = len(data.outcomes)
    count = f"{len(share)} decisions of {num_runs} runs in which the closest person mattered"
    yield Claim(
        "With matched distributions the closest obstacle's samples are free of collision more often than not.",
        SOURCE,
        [Measured(safe.estimate.value > 50.0, safe.p)],
        f"At least {100 * ALL_SAFE:g} % of the samples are safe in {shown(safe.estimate, '%')} of {count}. "
        f"{data.outcomes.count('collision')} of the runs ended in a collision.",
    )
    gains = {
        CONTROLS[other]: mean_by_run(run, 100.0 * (matched - share[:, other]), seed, f"snapshots.{CONTROLS[other]}")
        for other in (GOAL, NOMINAL)
    }
    texts = [f"{shown(gain.estimate, 'points', signed=True)} against {name}" for name, gain in gains.items()]
    yield Claim(
        "Matching moves the distribution of the collision cone towards the one that is free of collision.",
        SOURCE,
        [Measured(gain.estimate.value > 0.0, gain.p) for gain in gains.values()],
        f"Safe samples of the closest person, within one decision: {'; '.join(texts)} ({count}).",
    )


def draw_snapshots(data: Snapshots) -> Figure:
    """A column a moment: the map, the distributions of f with the shares that are safe."""
    snapshots = data.hardest()
    with draw.style():
        figure = draw.new_figure(draw.TWO_COLUMNS, 3.6)
        panels = figure.subplots(2, max(1, len(snapshots)), height_ratios=(1.5, 1.0), sharey="row", squeeze=False)
        for (top, foot), snapshot in zip(panels.T, snapshots, strict=False):
            _draw_map(top, snapshot, data.scenario)
            top.set_title(f"{snapshot.time:.1f} s", loc="left")
            _draw_distributions(foot, snapshot)
            matched, goal = (100 * snapshot.share[which] for which in (MATCHED, GOAL))
            foot.set_title(f"safe: {matched:.0f} %, else {goal:.0f} %", fontsize=6.0)
        panels[0, 0].set_ylabel("from the robot [m]")
        panels[1, 0].set_ylabel("share of samples")
        draw.legend(figure, panels[1], ncols=3)
    return figure


def _draw_distributions(axes: Axes, snapshot: Snapshot) -> None:
    """Histograms of f / R² as shares of the samples; unsafe above 0."""
    samples: Mapping[str, tuple[Array, Mapping[str, Any]]] = {
        "matched": (snapshot.f[MATCHED], {"fill": True, "color": COLOURS[MATCHED], "alpha": 0.45}),
        "under the goal alone": (snapshot.f[GOAL], {"color": COLOURS[GOAL], "linestyle": "--"}),
        "desired": (snapshot.desired, {"color": draw.INK}),
    }
    edges = np.linspace(min(float(values.min(initial=0.0)) for values, _ in samples.values()), 1.0, BINS + 1)
    axes.axvspan(0.0, edges[-1], color=draw.VERMILION, alpha=0.08, linewidth=0.0)
    for label, (values, options) in samples.items():
        shares = np.histogram(values, edges)[0] / max(1, values.size)
        axes.stairs(shares, edges, label=label, **options)
    axes.set(yscale="log", ylim=(1e-3, 1.0), xlim=(edges[0], edges[-1]), xlabel="f / R²")


def _draw_map(axes: Axes, s: Snapshot, scenario: Scenario) -> None:
    """Around the robot: bodies in truth, samples, and the ways of both controls."""
    truth, seen = s.record.truth, s.record.seen
    here = truth.robot_pose[:2]
    discs = seen.obstacles[: len(scenario.people)]
    for j, (position, velocity, disc) in enumerate(
        zip(truth.people_position - here, truth.people_velocity, discs, strict=True)
    ):
        shade = "#a35f00" if j == s.closest else draw.ORANGE
        axes.add_patch(Circle((position[0], position[1]), disc.radius, color=shade, alpha=0.3))
        axes.scatter(*(disc.position - here).T, s=1.5, color=shade, linewidths=0.0)
        axes.plot(*np.array([position, position + velocity]).T, color=shade)
    axes.add_patch(Circle((0.0, 0.0), scenario.robot.radius, color=draw.SKY, alpha=0.5))
    axes.scatter(*(seen.robot_pose[:, :2] - here).T, s=1.5, color=draw.BLUE, linewidths=0.0)
    for which, dashes in ((GOAL, "--"), (MATCHED, "-")):
        v, omega = s.controls[which]
        path = np.array([integrate(truth.robot_pose, v, omega, time) for time in np.linspace(0.0, AHEAD, 20)])
        axes.plot(*(path[:, :2] - here).T, color=COLOURS[which], linestyle=dashes)
    axes.set(xlim=(-VIEW, VIEW), ylim=(-VIEW, VIEW), aspect="equal")


SNAPSHOTS = MeasuredItem(
    "Five moving obstacles: samples and distributions",
    ("five",),
    (*DIRECT, "control.degree=3", "control.weight=0.3"),  # as tuned
    measure_snapshots,
    snapshot_claims,
    draw_snapshots,
)
