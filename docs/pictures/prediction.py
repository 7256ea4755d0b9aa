"""The picture of `method/prediction.md`: `python docs/pictures/prediction.py FOLDER`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import mjnav
from mjnav.scene import load

BLUE, VERMILION, GREY = "#0072b2", "#d55e00", "#8a8a8a"
MODELS = ("constant_velocity", "mixture", "social_force")
STEP, NUM = 0.4, 12
MOMENT = 3.4  # [s]
SCENE = ["physics.engine=kinematic", "time_limit=9", "stop_on_collision=false", "control.method=mppi"]


def paths(model: str) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """The futures (M, 13, 2) of everybody at the moment, where they went after it (13, P, 2), and the walls."""
    scenario = load("hall", [*SCENE, f"prediction.model={model}"], seed=1)
    with mjnav.Simulation(scenario) as simulation:
        while simulation.time < MOMENT - 1e-9:
            simulation.observe()
            simulation.step(0.0, 0.0)
        observation = simulation.observe()
        while not simulation.done:
            simulation.step(0.0, 0.0)
        trajectory = simulation.trajectory
    times = STEP * np.arange(NUM + 1)
    found = []
    for person in observation.obstacles[: len(scenario.people)]:
        if person.future is None:
            found.append(person.position[:, None] + times[:, None] * person.velocity[:, None])
        else:
            found.append(np.concatenate([person.position[:, None], person.future], axis=1))
    rows = np.round((observation.time + times) / scenario.control.period).astype(int)
    rows = rows[rows < len(trajectory.time)]
    return found, trajectory.people_position[rows], observation.walls


def main(folder: Path) -> None:
    """Writes the picture."""
    figure = Figure(figsize=(10.0, 2.4), dpi=110, layout="constrained", facecolor="white")
    for axes, model in zip(figure.subplots(1, 3, sharex=True, sharey=True), MODELS, strict=True):
        found, went, walls = paths(model)
        axes.add_collection(LineCollection(list(walls), colors="black", linewidths=1.2))
        for fan in found:
            axes.add_collection(LineCollection(list(fan), colors=BLUE, linewidths=0.7, alpha=0.5))
            axes.plot(*fan[:, -1].T, ".", color=BLUE, markersize=3)
        for person in np.swapaxes(went, 0, 1):
            axes.plot(*person.T, color=VERMILION, linewidth=1.8)
            axes.plot(*person[0], "o", color=GREY, markersize=6)
        axes.set_title(model, fontsize=9)
        axes.set_aspect("equal")
        axes.set_xlim(-1.5, 13.5)
        axes.set_ylim(-3.8, 3.8)
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "prediction-fans.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
