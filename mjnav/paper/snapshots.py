"""Five moving obstacles (figure 4): what matching does to the samples of the closest person.

At every decision the samples of f for the closest person in reach are computed under three controls: the one that the
goal alone would choose, the nominal control (the constraints at the mean), and the one that matching chose. A decision
matters where the first and the last differ. The first run is drawn at five hard decisions: those with the fewest
safe samples under the goal's control, at least 0.7 s apart, once velocities are known.
"""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from numpy.typing import ArrayLike

from mjnav.messages import Array
from mjnav.metrics.intervals import wilson
from mjnav.motion.unicycle import integrate
from mjnav.paper import style
from mjnav.paper.contrast import mean_by_run, shown
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.item import Claim, Measured, MeasuredItem
from mjnav.paper.safe_shares import CONTROLS, GOAL, MATCHED, NOMINAL, Decisions, Snapshot, measure
from mjnav.study.compare.estimates import Difference

SOURCE = "figure 4, section V-B"
ALL_SAFE = 0.99  # share of samples that counts as all of them
VIEW = 3.0  # [m] from the middle of a map to its edges
AHEAD = 1.5  # [s] of the control that is drawn
BINS = 24
LEAST_SHARE = 1e-3  # of the distributions' logarithmic scale
COLOURS = (style.VERMILION, style.GREY, style.BLUE)  # of CONTROLS
PERSON, CLOSEST = style.ORANGE, "#a35f00"


def claims(data: Decisions) -> Iterator[Claim]:
    """Whether matching leaves the samples safe, and whether it moves them there."""
    share, run = data.share[data.matters], data.run[data.matters]
    if not len(share):
        return

    def mean_of(values: ArrayLike, use: str, boundary: float = 0.0) -> Difference:
        return mean_by_run(run, 100.0 * np.asarray(values), data.seed, f"snapshots.{use}", boundary=boundary)

    num_runs, matched = len(data.outcome), share[:, MATCHED]
    safe, mean = mean_of(matched >= ALL_SAFE, "safe", 50.0), mean_of(matched, "mean").estimate
    least = np.median([matched[run == one].min() for one in np.unique(run)])
    hits = data.outcome.count("collision")
    low, high = wilson(hits, num_runs) or (0.0, 1.0)
    count = f"{len(share)} decisions of {num_runs} runs in which the closest person mattered"
    gains = [mean_of(matched - share[:, other], CONTROLS[other]) for other in (GOAL, NOMINAL)]
    texts = [
        f"{shown(gain.estimate, 'points', signed=True)} against the {name}"
        for gain, name in zip(gains, ("control that the goal alone would choose", "nominal control"), strict=True)
    ]
    yield Claim(
        "With matched distributions the closest obstacle's samples are free of collision more often than not.",
        SOURCE,
        [Measured(safe.estimate.value > 50.0, safe.p)],
        f"At least {100 * ALL_SAFE:g} % of the samples are safe in {shown(safe.estimate, '%')} of {count}. On "
        f"average {shown(mean, '%')} are, at a run's worst moment {100 * least:.0f} % (median). Of {num_runs} runs "
        f"{hits} [{num_runs * low:.1f}, {num_runs * high:.1f}] ended in a collision.",
    )
    yield Claim(
        "Matching moves the distribution of the collision cone towards the one that is free of collision.",
        SOURCE,
        [Measured(gain.estimate.value > 0.0, gain.p) for gain in gains],
        f"Safe samples of the closest person, within one decision: {'; '.join(texts)} ({count}).",
    )


def picture(data: Decisions) -> Figure:
    """A column a moment: the map, the distributions of f, the safe shares; below, the shares over the whole run."""
    with style.style():
        fig = style.new_figure(style.TWO_COLUMNS, 5.1)
        top, foot = fig.subfigures(2, 1, height_ratios=(3.3, 1.0), squeeze=False)[:, 0]
        num = max(1, len(data.snapshots))
        grid = top.subplots(3, num, height_ratios=(1.7, 1.05, 0.5), squeeze=False)
        for column, snapshot, which in zip(grid.T, data.snapshots, "abcdefgh", strict=False):
            _draw_map(column[0], snapshot, data)
            style.letter(column[0], which, f"{snapshot.time:.1f} s")
            _draw_distributions(column[1], snapshot, data.clip)
            _draw_shares(column[2], snapshot)
        for row in grid[1:]:
            for axes in row[1:]:
                axes.tick_params(labelleft=False)
        grid[0, 0].set_ylabel("y [m]")
        grid[1, 0].set_ylabel("share of samples")
        _legend(top)
        _draw_run(foot.subplots(), data)
    return fig


def _draw_map(axes: Axes, s: Snapshot, data: Decisions) -> None:
    x, y = s.pose[:2]
    axes.plot(*s.trail.T, color=style.BLUE, linewidth=0.9, alpha=0.6)
    axes.plot(*data.goal, marker="*", color=style.GREEN, markersize=7)
    for j, (person, samples) in enumerate(zip(s.people, s.people_samples, strict=True)):
        colour = CLOSEST if j == s.closest else PERSON
        axes.add_patch(Circle((person[0], person[1]), samples.radius, facecolor=PERSON, alpha=0.3, edgecolor=colour))
        axes.scatter(*samples.position.T, s=1.5, color=colour, linewidths=0.0, zorder=3)
    colours = [CLOSEST if j == s.closest else PERSON for j in range(len(s.people))]
    axes.quiver(
        *s.people.T, color=colours, angles="xy", scale_units="xy", scale=1.0, width=0.012, headwidth=4, zorder=3
    )
    axes.add_patch(Circle((x, y), data.radius, facecolor=style.SKY, alpha=0.5, edgecolor=style.BLUE))
    axes.scatter(*s.samples[:, :2].T, s=1.5, color=style.BLUE, linewidths=0.0, zorder=3)
    for which, dashes in ((GOAL, "--"), (MATCHED, "-")):
        v, omega = s.controls[which]
        path = np.array([integrate(s.pose, v, omega, time) for time in np.linspace(0.0, AHEAD, 20)])
        axes.plot(*path[:, :2].T, color=COLOURS[which], linestyle=dashes, linewidth=1.4, zorder=4)
    axes.set(xlim=(x - VIEW, x + VIEW), ylim=(y - VIEW, y + VIEW), aspect="equal", xlabel="x [m]")
    axes.spines[["top", "right"]].set_visible(True)


def _draw_distributions(axes: Axes, s: Snapshot, clip: float) -> None:
    everything = np.concatenate([*s.f, s.desired])
    low = -clip if np.isfinite(clip) else float(everything.min())
    edges = np.linspace(low, max(1.0, float(everything.max())), BINS + 1)
    width = edges[1] - edges[0]
    edges = np.arange(np.floor(low / width), np.ceil(edges[-1] / width) + 1) * width  # one of them is 0
    axes.axvspan(0.0, edges[-1], color=style.UNSAFE, alpha=0.08, linewidth=0.0)
    axes.stairs(_shares(s.f[MATCHED], edges), edges, fill=True, color=COLOURS[MATCHED], alpha=0.45)
    axes.stairs(_shares(s.f[GOAL], edges), edges, color=COLOURS[GOAL], linewidth=0.9, linestyle="--")
    axes.stairs(_shares(s.desired, edges), edges, color="black", linewidth=0.9)
    axes.set(
        yscale="log", ylim=(LEAST_SHARE, 1.0), xlim=(edges[0], edges[-1]), xlabel="f / R²" if np.isfinite(clip) else "f"
    )


def _shares(samples: Array, edges: Array) -> Array:
    return np.histogram(np.clip(samples, edges[0], edges[-1]), edges)[0] / max(1, samples.size)


def _draw_shares(axes: Axes, s: Snapshot) -> None:
    for place, which in enumerate((MATCHED, NOMINAL, GOAL)):
        share = float(s.share[which])
        axes.barh(place, 1.0, height=0.8, color=style.PALE, alpha=0.5)
        axes.barh(place, share, height=0.8, color=COLOURS[which])
        inside = share > 0.3
        axes.annotate(
            f"{100 * share:.0f} %", (share, place), xytext=(-2.0 if inside else 2.0, 0.0), textcoords="offset points",
            ha="right" if inside else "left", va="center", fontsize=5.5, color="white" if inside else style.INK,
        )  # fmt: skip
    axes.set(xlim=(0.0, 1.0), xlabel="safe share", xticks=(0.0, 0.5, 1.0))
    axes.set_yticks(range(3), [CONTROLS[which] for which in (MATCHED, NOMINAL, GOAL)])
    axes.tick_params(axis="y", length=0)


def _draw_run(axes: Axes, data: Decisions) -> None:
    drawn = data.run == 0
    for which in (GOAL, NOMINAL, MATCHED):
        axes.plot(
            data.time[drawn], data.share[drawn, which], color=COLOURS[which], linewidth=0.9, label=CONTROLS[which]
        )
    for snapshot, name in zip(data.snapshots, "abcdefgh", strict=False):
        axes.axvline(snapshot.time, color=style.INK, linewidth=0.5, linestyle=":")
        axes.annotate(
            name, (snapshot.time, 1.0), xytext=(0, 2), xycoords=axes.get_xaxis_transform(), textcoords="offset points",
            ha="center", fontweight="bold",
        )  # fmt: skip
    axes.set(ylim=(0.0, 1.02), xlabel="time [s]", ylabel="safe share, closest")
    axes.set_xlim(float(data.time[drawn][0]), float(data.time[drawn][-1]))
    axes.set_title(f"{data.scene}, seed {data.seed}", loc="right")
    axes.grid(axis="y")


def _legend(fig: SubFigure) -> None:
    handles = [
        Patch(facecolor=style.SKY, edgecolor=style.BLUE, label="robot, its samples"),
        Patch(facecolor=PERSON, alpha=0.5, label="people, their samples"),
        Line2D([], [], color=COLOURS[MATCHED], label="matched: current distribution"),
        Line2D([], [], color=COLOURS[GOAL], linestyle="--", label="under the goal alone"),
        Line2D([], [], color="black", label="desired distribution"),
        Patch(facecolor=style.UNSAFE, alpha=0.15, label="collision"),
    ]
    fig.legend(handles=handles, loc="outside lower center", ncols=6, columnspacing=1.2)


ITEM = MeasuredItem(
    title="Five moving obstacles: samples and distributions",
    scenes=("five",),
    overrides=options({**DIRECT, "control.degree": 3, "control.weight": 0.3}),  # as tuned
    measure=measure,
    claims=claims,
    picture=picture,
)
