"""Steps a CPU second of the Gymnasium environment, one and 64 in a vector, beside the run's own; headless, no log.

    uv run python benchmarks/env_steps.py hall

All take the same commands, half speed straight on, for --duration simulated seconds, and whatever the robot hits does
not end the run. The run and the environments are measured in turn, --repeat times, and the best of each counts. "run"
is the loop with a controller that always decides the same; the rows below it say how much of its pace is left.
"""

import argparse
import sys
import time
from collections.abc import Callable

import gymnasium
import numpy as np

import mjnav.gym  # noqa: F401
from mjnav.loop.prepare import load_scenario
from mjnav.loop.simulation import Simulation
from mjnav.scene.spec import Scenario

WORLDS = 64
COMMAND = np.array([0.5, 0.0], np.float32)


def run_steps(scenario: Scenario) -> int:
    """The loop alone: what `mjnav run` does in a tick, but for the decision."""
    simulation = Simulation(scenario, seed=0)
    while not simulation.done:
        simulation.observe()
        simulation.step(*COMMAND.tolist())
    return simulation.tick


def single_steps(env: gymnasium.Env) -> int:
    """One environment."""
    env.reset(seed=0)
    steps, done = 0, False
    while not done:
        *_, terminated, truncated, _ = env.step(COMMAND)
        steps, done = steps + 1, terminated or truncated
    return steps


def vector_steps(envs: gymnasium.vector.VectorEnv) -> int:
    """All of a vector: steps of each, added up."""
    envs.reset(seed=0)
    commands, steps, done = np.tile(COMMAND, (envs.num_envs, 1)), 0, False
    while not done:
        *_, truncated, _ = envs.step(commands)
        steps, done = steps + envs.num_envs, bool(truncated.all())
    return steps


def main() -> int:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--engine", choices=("mujoco", "kinematic"), default="mujoco")
    parser.add_argument("--duration", type=float, default=5.0, help="simulated [s] an episode")
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    overrides = (f"time_limit={given.duration}", "stop_on_collision=false", f"physics.engine={given.engine}")
    options = {"scene": given.scene, "overrides": overrides, "actions": "si"}
    scenario = load_scenario(given.scene, overrides)
    env = gymnasium.make("mjnav/Scene-v0", **options)
    envs = gymnasium.make_vec("mjnav/Scene-v0", num_envs=WORLDS, **options)
    ways: dict[str, Callable[[], int]] = {
        "run": lambda: run_steps(scenario),
        "environment": lambda: single_steps(env),
        f"{WORLDS} in a vector": lambda: vector_steps(envs),
    }
    best = dict.fromkeys(ways, 0.0)
    for way in ways.values():
        way()  # kernels are loaded
    for _ in range(given.repeat):
        for name, way in ways.items():
            began = time.process_time()
            steps = way()
            best[name] = max(best[name], steps / (time.process_time() - began))
    print(f"{given.scene}, {given.engine}, {scenario.control.rate:g} Hz, features robot and people, no log")
    for name, pace in best.items():
        print(f"{name:>15}  {pace:7.0f} steps/CPU s   {pace / best['run']:5.2f} of the run's")
    env.close()
    envs.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
