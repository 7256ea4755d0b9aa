"""The cost over (v, omega) (figure 3): whether it has kinks, and whether a gradient method does worse than samples.

Decisions are those in which obstacles matter: another candidate was chosen than the goal alone would choose. On each
of them the cost is that of the published method and of the tuned one for d = 1, 2, 3, with the nominal control and the
desired distributions held at the decision's. The grid's 402 candidates are compared with SLSQP from 1, 4 and 16
starts, in the window of one period and between the limits; the reference is the least cost that any search or a fine
grid found.
"""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import AsinhNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.metrics.intervals import mcnemar, wilson
from mjnav.paper import style
from mjnav.paper.contrast import LEAST_RUNS, mean_by_run, shown
from mjnav.paper.decision_cost import VARIANTS
from mjnav.paper.episodes import DIRECT, options
from mjnav.paper.gradient_search import BATCHES, JUMP_STEPS, NEAR, STARTS, STEPS, CostView, Searches, measure
from mjnav.paper.item import Claim, Measured, MeasuredItem

SOURCE = "figure 3, section V-A"
PUBLISHED = len(VARIANTS) - 1  # its place among them
TUNED = tuple(range(PUBLISHED))
CUT = 2  # the variant whose slope is drawn: d = 3
COLOURS = (*style.DEGREES.values(), style.ORANGE)
ENDS: Mapping[str, Any] = MappingProxyType(
    {"marker": "o", "markersize": 3.0, "markerfacecolor": style.SKY, "markeredgecolor": "black", "markeredgewidth": 0.4}
)
LEAST: Mapping[str, Any] = MappingProxyType(
    {"marker": "*", "markersize": 10, "markerfacecolor": style.VERMILION, "markeredgecolor": "white"}
)
WORSE, SAME, BETTER = style.VERMILION, style.PALE, style.GREEN


def claims(data: Searches) -> Iterator[Claim]:
    """On the cost's kinks, the gradient method's ends and its time; the published method, then the tuned one."""
    names = (((PUBLISHED,), "as published"), (TUNED, "as tuned here, d = 1, 2, 3"))
    for claim in (_kinks, _ends):
        for variants, name in names:
            yield claim(data, list(variants), name)
    yield _time(data)


def _kinks(data: Searches, variants: list[int], name: str) -> Claim:
    kinked = np.any(data.kinked[:, variants], axis=1)
    jumps = ", ".join(f"{100 * jump:.2g}" for jump in np.median(data.jumps[:, variants, 1], axis=0))
    clipped, free = (100 * data.views[view].jumps[-1] for view in (CUT, -1))
    why = (
        "The line form has a derivative wherever robot and obstacle do not move alike."
        if variants == [PUBLISHED]
        else f"They come from the clip: on the decision that is drawn, with d = 3, the jump is {clipped:.2g} % with it "
        f"and {free:.2g} % without. Where t* meets its bounds f is stationary in it, and the slope is continuous."
    )
    # The exact binomial test of one half.
    p = mcnemar(int(kinked.sum()), int((~kinked).sum())) if len(np.unique(data.run)) >= LEAST_RUNS else None
    return Claim(
        f"The cost over (v, ω), {name}, is not smooth.",
        SOURCE,
        [Measured(bool(kinked.mean() > 0.5), p)],
        f"Kinks along ω through the chosen control, the desired distributions held, at {_share(kinked)} of "
        f"{len(kinked)} decisions. The slope's largest jump within {JUMP_STEPS[1]:g} rad/s is {jumps} % of its range "
        f"(medians). {why}",
    )


def _ends(data: Searches, variants: list[int], name: str) -> Claim:
    texts, differences = [], []
    for w, window in enumerate(("what one period reaches", "the whole range between the limits")):
        against = data.against_grid[:, variants, w, 0]  # (D, n)
        difference = 100.0 * ((against > 0).mean(axis=1) - (against < 0).mean(axis=1))
        differences.append(mean_by_run(data.run, difference, int(data.seed[0]), "surface"))
        texts.append(
            f"In {window}: from one start more than {100 * NEAR:g} % worse than the 20 × 20 grid in "
            f"{_share(against > 0)}, as much better in {_share(against < 0)}, a difference of "
            f"{shown(differences[-1].estimate, 'points', signed=True)} by runs; from {STARTS[-1]} starts worse in "
            f"{_share(data.against_grid[:, variants, w, -1] > 0)}."
        )
    count = f"SLSQP on {len(data.run)} decisions of {differences[0].estimate.num} runs, {_costs(len(variants))}."
    return Claim(
        f"A gradient method finds worse controls than sampling them, on the cost {name}.",
        SOURCE,
        [Measured(differences[0].estimate.value > 0.0, differences[0].p)],
        " ".join([count, *texts]),
    )


def _time(data: Searches) -> Claim:
    grid, searched = data.grid_seconds[:, :, 0], data.seconds[:, :, 0, 0]
    slower = mean_by_run(data.run, np.log2(searched / grid).mean(axis=1), int(data.seed[0]), "surface")
    ratio = slower.estimate
    interval = "" if ratio.interval is None else f" [{2.0 ** ratio.interval[0]:.1f}, {2.0 ** ratio.interval[1]:.1f}]"
    calls = 1e6 * np.mean([view.call_seconds for view in data.views[: len(VARIANTS)]], axis=0)
    times = ", ".join(f"{time:.0f} µs for {num}" for num, time in zip(BATCHES, calls, strict=True))
    return Claim(
        "Sampling the controls takes less time than a gradient method.",
        SOURCE,
        [Measured(ratio.value > 0.0, slower.p)],
        f"On this machine SLSQP from one start takes {2.0**ratio.value:.1f}{interval} times as long as the grid in "
        f"what one period reaches (geometric mean): {1e3 * np.median(searched):.2g} ms against "
        f"{1e3 * np.median(grid):.2g} (medians; {len(data.run)} decisions of {ratio.num} runs, "
        f"{_costs(len(VARIANTS))}). It computes fewer costs, {np.median(data.points[:, :, 0, 0]):.0f} in place of 402, "
        f"but a call of the compiled cost takes {times}.",
    )


def _costs(num: int) -> str:
    return f"{num} costs each" if num > 1 else "one cost"


def _share(events: NDArray[np.bool_]) -> str:
    low, high = wilson(int(events.sum()), events.size) or (0.0, 1.0)
    return f"{100 * events.mean():.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def picture(data: Searches) -> Figure:
    """The costs of one decision, one a variant; the slope along omega and its jumps; where SLSQP ends, and its time."""
    with style.style():
        figure = style.new_figure(style.TWO_COLUMNS, 6.0)
        rows = figure.subfigures(3, 1, height_ratios=(1.15, 1.0, 1.1), squeeze=False)[:, 0]
        _draw_costs(rows[0], data)
        slope, jumps = rows[1].subplots(1, 2, width_ratios=(1.25, 1.0))
        style.letter(slope, "e", f"slope along ω at the chosen v, d = {CUT + 1}")
        _draw_slope(slope, data.views[CUT])
        style.letter(jumps, "f", "largest jump of the slope within a step")
        _draw_jumps(jumps, data.views)
        reachable, bounds, times = rows[2].subplots(1, 3)
        style.letter(reachable, "g", "within one period's reach")
        style.letter(bounds, "h", "between the limits")
        style.letter(times, "i", "time, within one period's reach")
        _draw_shares(reachable, data.against_grid[:, :, 0])
        _draw_shares(bounds, data.against_grid[:, :, 1])
        bounds.tick_params(labelleft=False)
        _draw_times(times, data)
        reachable.set_ylabel("share of decisions")
        keys = (
            (WORSE, f"SLSQP more than {100 * NEAR:g} % worse"),
            (SAME, "as good"),
            (BETTER, f"as much better than the grid, from 1, {STARTS[1]} and {STARTS[2]} starts"),
        )
        handles = [Patch(facecolor=colour, label=label) for colour, label in keys]
        rows[2].legend(handles=handles, loc="outside lower left", ncols=3)
        return figure


def _draw_costs(figure: SubFigure, data: Searches) -> None:
    scene, seed, time = data.drawn
    panels = figure.subplots(1, len(VARIANTS), sharex=True, sharey=True)
    for axes, which, name, view in zip(panels, "abcd", VARIANTS, data.views, strict=False):
        _draw_cost(figure, axes, view)
        style.letter(axes, which, name)
        axes.set_xlabel("speed v [m/s]")
    panels[0].set_ylabel("turn rate ω [rad/s]")
    figure.suptitle(f"cost of one decision: {scene}, seed {seed}, {time:.1f} s", fontsize=7.5)
    handles = [
        Line2D([], [], linestyle="none", label="least cost", **LEAST),
        Line2D([], [], linestyle="none", label="where SLSQP ends from 16 starts", **ENDS),
        Line2D([], [], color=style.GREY, linestyle="--", label="one period's reach"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


def _draw_cost(figure: SubFigure, axes: Axes, view: CostView) -> None:
    s = view.surface
    low, high = float(s.total.min()), float(s.total.max())
    norm = AsinhNorm(max(low, 1e-9 * high), low, high)
    mesh = axes.pcolormesh(
        s.v, s.omega, s.total.T, shading="nearest", cmap=style.SEQUENTIAL, norm=norm, rasterized=True
    )
    levels = np.asarray(norm.inverse(np.linspace(0.0, 1.0, 12)))[1:-1]
    axes.contour(s.v, s.omega, s.total.T, levels=levels, colors="white", linewidths=0.35, alpha=0.7)
    corner, end = s.reachable
    size = end - corner
    axes.add_patch(
        Rectangle((corner[0], corner[1]), *size, fill=False, edgecolor="white", linestyle="--", linewidth=0.9)
    )
    i, j = s.minimum or (0, 0)
    axes.plot(s.v[i], s.omega[j], linestyle="none", clip_on=False, **LEAST)
    axes.plot(*view.ends.T, linestyle="none", clip_on=False, **ENDS)
    bar = figure.colorbar(mesh, ax=axes, location="top", shrink=0.9, aspect=25, pad=0.02)
    bar.outline.set_linewidth(0.4)


def _draw_slope(axes: Axes, view: CostView) -> None:
    axes.plot(view.slope_omega, view.slope, color=COLOURS[CUT], linewidth=0.8)
    axes.set(xlim=(view.slope_omega[0], view.slope_omega[-1]), xlabel="turn rate ω [rad/s]", ylabel="dcost/dω [s/rad]")
    clips = axes.twinx()
    clips.hist(view.clips, bins=np.linspace(*axes.get_xlim(), 101).tolist(), color=style.ORANGE, alpha=0.45)
    clips.set_ylabel("pairs that meet the clip", color=style.ORANGE)
    clips.spines["right"].set_visible(True)
    clips.set_ylim(0.0, 3.0 * max(1.0, clips.get_ylim()[1]))
    axes.set_zorder(clips.get_zorder() + 1)
    axes.patch.set_visible(False)


def _draw_jumps(axes: Axes, views: tuple[CostView, ...]) -> None:
    for name, colour, view in zip(VARIANTS, COLOURS, views, strict=False):
        axes.plot(STEPS, view.jumps, marker="o", markersize=2.5, color=colour, label=name)
    axes.plot(STEPS, views[-1].jumps, color=style.DEGREES[3], linestyle=":", label="d = 3, not clipped")
    axes.set(xscale="log", yscale="log", xlabel="step in ω [rad/s]", ylabel="share of the slope's range")
    axes.grid(which="major")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_shares(axes: Axes, against: Array) -> None:
    """Stacked shares of decisions (D, V, S): a bar for every variant and number of starts."""
    num_starts = against.shape[-1]
    ticks, labels = [], []
    for v in range(against.shape[1]):
        for s in range(num_starts):
            x = v * (num_starts + 1) + s
            bottom = 0.0
            for colour, sign in ((WORSE, 1.0), (SAME, 0.0), (BETTER, -1.0)):
                share = float((against[:, v, s] == sign).mean())
                axes.bar(x, share, width=0.85, bottom=bottom, color=colour)
                bottom += share
            ticks.append(x)
            labels.append(str(STARTS[s]))
        axes.annotate(
            tuple(VARIANTS)[v], (v * (num_starts + 1) + 0.5 * (num_starts - 1), 0.0), xytext=(0.0, -16.0),
            xycoords="data", textcoords="offset points", ha="center", va="top", annotation_clip=False,
        )  # fmt: skip
    axes.set_xticks(ticks, labels)
    axes.set_ylim(0.0, 1.0)


def _draw_times(axes: Axes, data: Searches) -> None:
    """Median and the middle 80 % of times, a group for every way to search."""
    ways = [("grid", data.grid_seconds[:, :, 0])]
    ways += [(f"SLSQP, {num}", data.seconds[:, :, 0, s]) for s, num in enumerate(STARTS)]
    for x, (_, seconds) in enumerate(ways):
        for v, colour in enumerate(COLOURS):
            low, middle, high = 1e3 * np.quantile(seconds[:, v], [0.1, 0.5, 0.9])
            place = x + 0.16 * (v - 1.5)
            axes.vlines(place, low, high, color=colour, linewidth=1.6)
            axes.plot(place, middle, marker="o", color=colour, markersize=3.0)
    axes.set_xticks(range(len(ways)), [name for name, _ in ways])
    axes.set(yscale="log", ylabel="time [ms]")
    axes.grid(axis="y")


ITEM = MeasuredItem(
    title="The cost over (v, ω), and a gradient method against samples",
    scenes=("crossing1", "crossing3"),
    overrides=options(DIRECT),
    measure=measure,
    claims=claims,
    picture=picture,
)
