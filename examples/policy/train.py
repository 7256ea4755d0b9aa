"""Trains the policy beside this file by CMA-ES, an evolution strategy (Hansen & Ostermeier 2001), through Gymnasium.

    python train.py --minutes 15          # writes weights.npz
    python train.py --generations 2       # a trial

A generation is a few candidate weight vectors, each driven through the same episodes; the next one is drawn nearer to
those with the higher reward. The same --seed and number of generations gives the same weights; with --minutes the clock
decides after how many generations training ends. Scenes and seeds of the training are none of those of study.toml.
"""

import argparse
import os
import time
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cma
import gymnasium
import numpy as np
from policy import FEATURES, WEIGHTS, action, untrained
from scenes import EMPTY, REWARD, random_scene

FIRST_SEED = 1_000_000  # of the episodes' noise, far from those of study.toml


def total_reward(weights: np.ndarray, episodes: range) -> float:
    """The mean sum of rewards over episodes, each a random scene and a seed that follow from its number."""
    totals = []
    with gymnasium.make("mjnav.gym:mjnav/Scene-v0", scene=EMPTY, features=FEATURES, reward=REWARD) as env:
        for episode in episodes:
            scene = random_scene(np.random.default_rng(episode))
            blocks, _ = env.reset(seed=episode, options={"scene": scene})
            total, done = 0.0, False
            while not done:
                blocks, reward, terminated, truncated, _ = env.step(action(weights, blocks))
                total, done = total + float(reward), terminated or truncated
            totals.append(total)
    return float(np.mean(totals))


def train(
    *, generations: int, minutes: float, seed: int, episodes: int, population: int, processes: int, sigma: float
) -> np.ndarray:
    """The mean of the strategy's last distribution: it has seen more episodes than any single candidate."""
    options = {"seed": seed, "verbose": -9, "popsize": population}
    strategy = cma.CMAEvolutionStrategy(untrained(), sigma, options)
    began = time.monotonic()
    with get_context("spawn").Pool(processes) as pool:
        generation = 0
        while generation < generations and time.monotonic() - began < 60.0 * minutes:
            first = FIRST_SEED + 100_000 * seed + generation * episodes
            candidates = strategy.ask()
            rewards = pool.map(partial(total_reward, episodes=range(first, first + episodes)), candidates, chunksize=1)
            strategy.tell(candidates, [-reward for reward in rewards])
            generation += 1
            spent = time.monotonic() - began
            print(
                f"generation {generation:3d}  reward: mean {np.mean(rewards):6.3f}, best {max(rewards):6.3f}"
                f"  sigma {strategy.sigma:.3f}  {spent:5.0f} s",
                flush=True,
            )
    return strategy.result.xfavorite


def main() -> None:
    """Reads the command line, trains, writes the weights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--generations", type=int, default=1000, help="at most")
    parser.add_argument("--minutes", type=float, default=15.0, help="after which no generation begins")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--episodes", type=int, default=6, help="of every candidate in a generation")
    parser.add_argument("--population", type=int, default=12, help="candidates in a generation")
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--sigma", type=float, default=0.5, help="first standard deviation of the weights")
    parser.add_argument("--out", type=Path, default=WEIGHTS)
    given = parser.parse_args()
    weights = train(
        generations=given.generations,
        minutes=given.minutes,
        seed=given.seed,
        episodes=given.episodes,
        population=given.population,
        processes=given.processes,
        sigma=given.sigma,
    )
    np.savez(given.out, weights=weights)
    print(f"wrote {given.out}")


if __name__ == "__main__":
    main()
