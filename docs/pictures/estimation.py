"""The pictures of `method/estimation.md`: `python docs/pictures/estimation.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import mjnav
from mjnav.messages import TickRecord
from mjnav.noise.profiles import profile

BLUE, VERMILION, GREY = "#0072b2", "#d55e00", "#8a8a8a"
CHANNELS = ("detection.x", "odometry.v", "actuation.omega", "lidar.range")
UNITS = ("m", "m/s", "rad/s", "m")


def new_figure(width: float, height: float) -> Figure:
    """On white, so that it can be read on a dark page too."""
    return Figure(figsize=(width, height), dpi=110, layout="constrained", facecolor="white")


def noise() -> Figure:
    """Densities of four channels under three profiles."""
    figure = new_figure(9.0, 2.6)
    for axes, channel, unit in zip(figure.subplots(1, 4), CHANNELS, UNITS, strict=True):
        for name, colour, style in (("gaussian", GREY, ":"), ("pearson", BLUE, "-"), ("bimodal", VERMILION, "-")):
            distribution = profile(name)[channel]
            x = np.linspace(-4.0 * distribution.std, 4.0 * distribution.std, 600)
            axes.plot(x, np.exp(distribution.logpdf(x)), style, color=colour, linewidth=1.4, label=name)
        axes.set_title(f"{channel} [{unit}]", fontsize=9)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.set_yticks([])
        axes.tick_params(labelsize=8)
    figure.axes[0].legend(fontsize=7, frameon=False, loc="upper left")
    return figure


def beliefs() -> Figure:
    """The shape of a person's belief, over all ticks: as a filter has it, and as the readings themselves give it."""
    figure = new_figure(9.0, 2.8)
    sources = (("particle filter", []), ("direct: the reading minus noise", ["estimation.obstacles.source=direct"]))
    for axes, (name, overrides) in zip(figure.subplots(1, 2, sharex=True), sources, strict=True):
        departures: list[np.ndarray] = []

        def keep(record: TickRecord, departures: list[np.ndarray] = departures) -> None:
            track = record.tracks[0]
            departures.append(track.particles[:, 0] - np.average(track.particles[:, 0], weights=track.weights))

        scenario = mjnav.load_scenario("crossing1", ["physics.engine=kinematic", *overrides], seed=3)
        mjnav.run(scenario, watch=keep)
        found = np.concatenate(departures)
        axes.hist(found, np.linspace(-0.6, 0.6, 80), color=BLUE, density=True)
        skew = float(np.mean(((found - found.mean()) / found.std()) ** 3))
        axes.set_title(f"{name}: std {found.std():.2f} m, skew {skew:+.1f}", fontsize=9)
        axes.set_xlabel("x of the particles - their mean [m]", fontsize=8)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.set_yticks([])
        axes.tick_params(labelsize=8)
    return figure


def main(folder: Path) -> None:
    """Writes the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for draw in (noise, beliefs):
        draw().savefig(folder / f"estimation-{draw.__name__}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
