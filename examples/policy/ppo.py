"""Trains a network in the rooms of scenes.py by PPO of stable-baselines3 (Schulman et al. 2017), then tries it.

    uv run --with stable-baselines3 python ppo.py --minutes 6        # with PyTorch; writes ppo.zip

Training and trial draw other rooms. The network sees the blocks `robot` and `people`.
"""

import argparse
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from scenes import EMPTY, REWARD, random_scene

PROGRESS = {**REWARD, "progress": 0.2}  # more of what comes at every step: PPO begins with a policy that does not drive
TRIAL = 1_000_000  # seed of the rooms that are not trained in
WORLDS, STEPS = 8, 256  # side by side; of each between two updates


class Rooms(gymnasium.Wrapper):
    """Every episode is another random room, drawn from `seed`, or on from where the draws are."""

    def __init__(self, seed: int):
        super().__init__(gymnasium.make("mjnav.gym:mjnav/Scene-v0", scene=EMPTY, reward=PROGRESS))
        self._rng = np.random.default_rng(seed)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """See `gymnasium.Env`."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        scene = random_scene(self._rng)
        return self.env.reset(seed=int(self._rng.integers(2**31)), options={**(options or {}), "scene": scene})


def outcomes(model: Any, episodes: int) -> Counter[str]:
    """How often each outcome comes in rooms that were not trained in."""
    env, found = Rooms(TRIAL), Counter()
    for _ in range(episodes):
        blocks, info = env.reset()
        done = False
        while not done:
            blocks, _, terminated, truncated, info = env.step(model.predict(blocks, deterministic=True)[0])
            done = terminated or truncated
        found[info["summary"]["outcome"]] += 1
    return found


def main() -> None:
    """Reads the command line, trains, writes the network, and tries it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=6.0, help="after which no update begins")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--episodes", type=int, default=60, help="of the trial")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("ppo.zip"))
    given = parser.parse_args()

    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import SubprocVecEnv, VecMonitor

    worlds = VecMonitor(SubprocVecEnv([partial(Rooms, given.seed * 1000 + i) for i in range(WORLDS)]))
    model = PPO(
        "MultiInputPolicy", worlds, n_steps=STEPS, batch_size=256, gamma=0.98, learning_rate=1e-3, seed=given.seed
    )
    began = time.monotonic()
    while time.monotonic() - began < 60.0 * given.minutes:
        model.learn(10 * WORLDS * STEPS, reset_num_timesteps=False)
        reward = np.mean([episode["r"] for episode in model.ep_info_buffer])
        print(f"{model.num_timesteps:8d} steps  reward {reward:6.2f}  {time.monotonic() - began:5.0f} s", flush=True)
    model.save(given.out)
    worlds.close()
    print(f"wrote {given.out}; in {given.episodes} other rooms: {dict(outcomes(model, given.episodes))}")


if __name__ == "__main__":
    main()
