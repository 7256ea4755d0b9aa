"""The ways past one obstacle by degree; below each the desired (black) and the current (blue) distribution of f."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.paper.paths import VARIANTS, PathsData, Way
from mjnav.paper.pictures.lane import COLORS
from mjnav.paper.pictures.style import BLUE, GREY, INK, ORANGE, PALE, TWO_COLUMNS, UNSAFE, new_figure, style

BINS = 30


def figure(data: PathsData) -> Figure:
    """A column a variant: ways of all seeds, distributions of all seeds together, the share that is safe."""
    with style():
        fig = new_figure(TWO_COLUMNS, 3.6)
        panels = fig.subplots(3, len(VARIANTS), height_ratios=(1.6, 1.2, 0.25), sharex="row", sharey="row")
        samples = np.concatenate([part for way in data.ways for part in (way.samples, way.desired)])
        edges = np.linspace(samples.min(), samples.max(), BINS + 1)
        for column, variant in zip(panels.T, VARIANTS, strict=True):
            ways = data.of(variant)
            _ways(column[0], ways, COLORS[variant])
            column[0].set_title(f"{variant}, λ = {VARIANTS[variant][1]:.2g}")
            _distributions(column[1], ways, edges)
            _share(column[2], float(np.mean([way.safe_share for way in ways])))
        panels[0, 0].set_ylabel("y [m]")
        panels[1, 0].set_ylabel("share of samples")
        handles, labels = panels[1, 0].get_legend_handles_labels()
        fig.legend(handles, labels, loc="outside lower center", ncols=3)
    return fig


def _ways(axes: Axes, ways: list[Way], color: str) -> None:
    for way in ways:
        for person in range(way.people.shape[1]):
            axes.plot(*way.people[:, person].T, color=ORANGE, linewidth=0.6, alpha=0.4)
        axes.plot(*way.path.T, color=color, linewidth=0.7, alpha=0.7)
    axes.axhline(0.0, color=GREY, linewidth=0.5, linestyle=":")
    axes.set(ylim=(-2.0, 2.0), xlabel="x [m]")


def _distributions(axes: Axes, ways: list[Way], edges: np.ndarray) -> None:
    current, desired = (
        np.concatenate([part for way in ways for part in ([way.samples], [way.desired])[which]]) for which in (0, 1)
    )
    axes.axvspan(0.0, edges[-1], color=UNSAFE, alpha=0.08, linewidth=0.0)
    axes.stairs(_shares(current, edges), edges, fill=True, color=BLUE, alpha=0.5, label="current")
    axes.stairs(_shares(desired, edges), edges, color=INK, label="desired")
    axes.set(yscale="log", ylim=(1e-3, 1.0), xlabel="f / R²")


def _shares(samples: np.ndarray, edges: np.ndarray) -> np.ndarray:
    return np.histogram(samples, edges)[0] / max(1, samples.size)


def _share(axes: Axes, share: float) -> None:
    axes.barh(0, 1.0, color=PALE)
    axes.barh(0, share, color=BLUE)
    axes.annotate(f"{100.0 * share:.1f} %", (0.5, 0), ha="center", va="center", fontsize=6.0)
    axes.set(xlim=(0.0, 1.0), xticks=(0.0, 0.5, 1.0), yticks=[], xlabel="safe, least of a run")
