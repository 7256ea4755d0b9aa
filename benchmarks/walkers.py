"""How people of a scene walk beside recorded ones: speed, acceleration, distances and times to collision.

    uv run python benchmarks/walkers.py [RECORDING...] [--scene crowds] [--seeds 10]

A recording is a text that `mjnav import crowd` takes, in metres, 10 frames in 0.4 s. The scene's people walk without a
robot, once by each law, every 0.4 s a row as in a recording. Printed for each:

    people       mean number of them at a time
    speed        median [m/s]
    turn         99.9 % of accelerations, from three rows in turn [m/s²]
    nearest      1, 10 and 50 % of distances between centres to the nearest other [m]
    collision    share of person-time with less than 0.5, 1 and 2 s to a contact at 0.5 m, both going straight on [%]
"""

import argparse
from collections.abc import Iterable, Sequence

import numpy as np

import mjnav
from mjnav.loop.simulation import people_without_robot
from mjnav.messages import Array
from mjnav.scene.crowd import read_recording
from mjnav.study.prediction import Frames

STEP = 0.4  # [s] between two rows
FRAME_RATE = 25.0  # [Hz] of the recordings
LAWS = ("orca", "moussaid_2009", "moussaid", "helbing")
CONTACT = 0.5  # [m] between centres
SOON = (0.5, 1.0, 2.0)  # [s]


def recorded(path: str) -> Array:
    """(T, P, 2) [m], NaN where a person is not there."""
    frames = Frames.of(read_recording(path), FRAME_RATE)
    times = frames.step * np.arange(max(map(max, frames.places.values())) + 1)
    return np.stack([frames.whereabouts(person, times) for person in frames.places], axis=1)


def simulated(scene: str, law: str, seeds: Iterable[int]) -> list[Array]:
    """The same of a scene's people for 30 s, by one law."""
    keys = {"behaviour": "orca"} if law == "orca" else {"behaviour": "social_force", "form": law}
    found = []
    for seed in seeds:
        chosen = {
            "seed": seed,
            "physics.engine": "kinematic",
            **{f"people.0.{key}": value for key, value in keys.items()},
        }
        scenario = mjnav.load_scenario(scene, chosen)
        every = round(STEP / scenario.control.period)
        found.append(people_without_robot(scenario, seed, round(30.0 / scenario.control.period))[::every])
    return found


def figures(runs: Sequence[Array]) -> str:
    """One row of the table."""
    count, speeds, accelerations, nearest, times = [], [], [], [], []
    for places in runs:
        velocity = np.diff(places, axis=0) / STEP
        speeds.append(np.hypot(*np.moveaxis(velocity, -1, 0)).ravel())
        accelerations.append(np.hypot(*np.moveaxis(np.diff(velocity, axis=0) / STEP, -1, 0)).ravel())
        count.append((~np.isnan(places[..., 0])).sum(axis=1))
        for here, going in zip(places[1:], velocity, strict=True):
            there = ~np.isnan(going[:, 0])
            p, v = here[there], going[there]
            if len(p) < 2:
                continue
            r, q = p[:, None] - p, v[:, None] - v
            apart = np.hypot(r[..., 0], r[..., 1]) + np.diag(np.full(len(p), np.inf))
            nearest.append(apart.min(axis=1))
            times.append(_times_to_contact(r, q, apart).min(axis=1))
    speed, acceleration, distance, time = (np.concatenate(values) for values in (speeds, accelerations, nearest, times))
    cells = [
        np.concatenate(count).mean(), np.nanmedian(speed), np.nanquantile(acceleration, 0.999),
        *np.quantile(distance, [0.01, 0.1, 0.5]), *(100.0 * (time < soon).mean() for soon in SOON),
    ]  # fmt: skip
    return "".join(f"{cell:8.2f}" for cell in cells)


def _times_to_contact(r: Array, q: Array, apart: Array) -> Array:
    """Until |r + t q| = CONTACT, inf where never or where they are nearer already, (P, P) [s]."""
    a, b, c = (q**2).sum(-1), (r * q).sum(-1), apart**2 - CONTACT**2
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (-b - np.sqrt(b * b - a * c)) / a
    return np.where((b < 0.0) & (c > 0.0) & np.isfinite(found), found, np.inf)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="*")
    parser.add_argument("--scene", default="crowds")
    parser.add_argument("--seeds", type=int, default=10)
    arguments = parser.parse_args()
    names = ["people", "speed", "turn", "1 %", "10 %", "50 %", *(f"<{soon:g} s" for soon in SOON)]
    print(f"{'':28s}" + "".join(f"{name:>8s}" for name in names))
    for path in arguments.recordings:
        print(f"{path[-26:]:28s}" + figures([recorded(path)]), flush=True)
    for law in LAWS:
        runs = simulated(arguments.scene, law, range(arguments.seeds))
        print(f"{arguments.scene + ', ' + law:28s}" + figures(runs), flush=True)


if __name__ == "__main__":
    main()
