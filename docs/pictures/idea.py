"""The pictures of `method/idea.md`, from the functions that run: `python docs/pictures/idea.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import mjnav
from mjnav.constraints import collision_cone
from mjnav.control import make_controller
from mjnav.control.methods.rkhs import Rkhs
from mjnav.loop.run import record_at
from mjnav.messages import Array
from mjnav.rkhs import mmd_squared

BLUE, VERMILION, GREY, GREEN = "#0072b2", "#d55e00", "#8a8a8a", "#009e73"
FORMS = ("line", "ray", "segment")
HORIZON = 5.0  # [s] of the segment form
RADIUS = 0.7  # [m] R, the sum of the robot's and a person's


def new_figure(width: float, height: float) -> Figure:
    """On white, so that it can be read on a dark page too."""
    return Figure(figsize=(width, height), dpi=110, layout="constrained", facecolor="white")


def cone() -> Figure:
    """The three forms of f for a disc that is met, met later than the horizon, and left behind."""
    figure = new_figure(9.0, 2.7)
    r = np.array([-2.0, -0.5])  # of the robot from the obstacle, which stands at the origin
    cases = (("met in 2 s", (0.9, 0.1)), ("met after the horizon", (0.22, 0.07)), ("left behind", (-0.8, -0.2)))
    for axes, (name, q) in zip(figure.subplots(1, 3), cases, strict=True):
        q = np.array(q)
        axes.add_patch(Circle((0.0, 0.0), RADIUS, facecolor="#f3c9b5", edgecolor=VERMILION))
        t = np.array([-6.0, 6.0])
        axes.plot(*(r + t[:, None] * q).T, color=GREY, linewidth=0.9, linestyle=":")
        axes.plot(*(r + np.array([0.0, HORIZON])[:, None] * q).T, color=BLUE, linewidth=1.6)
        axes.annotate("", r + q, r, arrowprops={"arrowstyle": "-|>", "color": BLUE, "linewidth": 2.0})
        axes.plot(*r, "o", color=BLUE)
        axes.text(r[0] - 0.1, r[1] + 0.2, "r", color=BLUE, ha="right")
        axes.text(*(r + q + np.array([0.05, 0.12])), "q", color=BLUE)
        values = [f"{form:>8} {float(collision_cone(r, q, RADIUS, form=form, horizon=HORIZON)):+.2f}" for form in FORMS]
        axes.set_title(name, fontsize=9)
        text = "\n".join(["f [m²]", *values])
        axes.text(0.98, 0.03, text, transform=axes.transAxes, ha="right", fontsize=7.5, family="monospace")
        axes.set(xlim=(-3.4, 1.6), ylim=(-2.2, 1.4), aspect="equal", xlabel="x [m]")
        tidy(axes)
    return figure


def distributions() -> Figure:
    """F of the closest person at three controls of one decision of `crossing3`, and F^des; by the class's defaults."""
    scenario = mjnav.load_scenario("crossing3", controller=Rkhs, seed=3)
    observation = record_at(scenario, 2.9).observation
    controller = make_controller(Rkhs, scenario.robot.limits, scenario.control.period)
    problem = controller.problem(observation)  # type: ignore[attr-defined]  # of the methods that have candidates
    c, decision = problem.candidates, controller.decide(observation)
    goal, nominal = int(np.argmin(problem.goal_cost)), problem.nominal
    controls = (
        ("the goal's cheapest control", c.v[goal], c.omega[goal]),
        ("the nominal control: safe at the mean", c.v[nominal], c.omega[nominal]),
        ("the control that was chosen", decision.v, decision.omega),
    )
    found = [problem.cone.samples(0, np.array([v]), np.array([w]))[:, 0] for _, v, w in controls]
    desired = controller.closest_cone(observation, decision)[2]  # type: ignore[index]  # someone is in reach
    figure = new_figure(9.0, 3.2)
    figure.supylabel("samples [%]", fontsize=8)
    low, high = min(f.min() for f in found), max(f.max() for f in found)
    bins = np.linspace(low, high, 40)

    def shares(samples: Array) -> Array:
        return np.full(len(samples), 100.0 / len(samples))

    for axes, (name, v, w), f in zip(figure.subplots(1, 3, sharey=True), controls, found, strict=True):
        axes.axvspan(0.0, high, color="#f3c9b5", linewidth=0.0)
        axes.hist(f, bins, color=BLUE, weights=shares(f), log=True)
        axes.hist(desired, bins, color=GREEN, weights=shares(desired), histtype="step", linewidth=1.8, log=True)
        distance = mmd_squared(f, desired, degree=1)
        safe = 100.0 * np.mean(f <= 0.0)
        axes.set_title(
            f"{name}\nv = {v:.2f} m/s, ω = {w:+.2f} rad/s\n{safe:.0f} % safe, MMD² = {distance:.3f}", fontsize=9
        )
        axes.set(xlabel="f / R²: collision where above 0", xlim=(low, high), ylim=(0.1, 100.0))
        tidy(axes)
        axes.label_outer()
    return figure


def degree() -> Figure:
    """Four pairs of distributions and what each degree of the kernel sees of their difference."""
    rng = np.random.default_rng(0)
    normal = standardised(rng.normal(size=4000))
    skewed = standardised(rng.gamma(1.2, size=4000))
    pairs = (
        ("another mean", normal, normal + 0.7),
        ("another variance", normal, 1.6 * normal),
        ("another skew", normal, skewed),
        ("the mirror image", skewed, -skewed),
    )
    figure = new_figure(9.0, 2.9)
    bins = np.linspace(-5.0, 5.0, 60)
    for axes, (name, x, y) in zip(figure.subplots(1, 4, sharey=True), pairs, strict=True):
        axes.hist(x, bins, color=BLUE, density=True, alpha=0.55)
        axes.hist(y, bins, color=VERMILION, density=True, histtype="step", linewidth=1.6)
        values = "\n".join(f"d = {d}:  {mmd_squared(x, y, degree=d):8.2f}" for d in (1, 2, 3))
        axes.set_title(name, fontsize=9)
        axes.text(0.98, 0.97, values, transform=axes.transAxes, ha="right", va="top", fontsize=7.5, family="monospace")
        axes.set(xlim=(-4.5, 4.5), ylim=(0.0, 0.95))
        tidy(axes)
        axes.set_yticks([])
    return figure


def standardised(x: Array) -> Array:
    """With mean 0 and variance 1."""
    return (x - x.mean()) / x.std()


def tidy(axes: Axes) -> None:
    """Less ink."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def main(folder: Path) -> None:
    """Writes the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    for draw in (cone, distributions, degree):
        draw().savefig(folder / f"idea-{draw.__name__}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
